"""Frames of an RGB-D camera, put together in a view between them."""

import numpy as np

import forward_resample as fr

K = np.array([[200.0, 0, 119.5], [0, 200, 89.5], [0, 0, 1]])


def frame(x):
    """What a camera at (x, 0, 0) sees of a wall with a box before it: 8-bit colours, depth in millimetres."""
    v, u = np.mgrid[:180, :240]
    ray_x, ray_y = (u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]
    is_box = (abs(x + 1.5 * ray_x) < 0.3) & (abs(1.5 * ray_y) < 0.4)
    z = np.where(is_box, 1.5, 3.0)
    place_x, place_y = x + z * ray_x, z * ray_y
    stripes = np.sin(12 * place_x) * np.sin(12 * place_y)
    colour = np.stack([128 + 80 * stripes, np.where(is_box, 200, 110), np.where(is_box, 60, 160)], axis=-1)
    return colour.astype(np.uint8), (1000 * z).astype(np.uint16)


def pose(x):
    """World from camera, as trajectories have it."""
    place = np.eye(4)
    place[0, 3] = x
    return place


first, *others = [(*frame(x), K, pose(x)) for x in (-0.3, 0.3)]
image = fr.DepthImage(*first, references=others, pose_is="world_from_camera", depth_scale=0.001)
between = image.view(pose(0.0))
print("seen by at least one frame:", float(np.mean(between[..., 3] > 0.5)))
between.save("rgbd_sequence.png")
