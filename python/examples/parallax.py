"""A photograph with a depth map, seen from a camera that sways."""

import numpy as np

import forward_resample as fr

# A floor with a ball on it stands for the photograph and its depth.
height, width = 180, 240
K = np.array([[220.0, 0, 119.5], [0, 220, 89.5], [0, 0, 1]])
v, u = np.mgrid[:height, :width]
rays = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones((height, width))], axis=-1)
floor = np.where(rays[..., 1] > 0.05, 1.0 / np.maximum(rays[..., 1], 0.05), 20.0)
b, c = rays @ [0.0, 0.5, 4.0], np.sum(rays**2, axis=-1)
inside = b**2 - c * (0.25 + 16.0 - 0.36)
ball = np.where(inside > 0, (b - np.sqrt(np.maximum(inside, 0))) / c, np.inf)
depth = np.minimum(floor, ball)
place = rays * depth[..., None]
checker = (np.floor(place[..., 0] * 2) + np.floor(place[..., 2] * 2)) % 2
colour = np.where(ball[..., None] < floor[..., None], [220, 90, 40], checker[..., None] * 90 + [80, 90, 110]).astype(np.uint8)

image = fr.DepthImage(colour, depth, K, fill="background")
fr.write_film("parallax.apng", image.pictures(sway=(1.5, 12)), fps=12, count=12)
