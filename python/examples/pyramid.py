"""A volume larger than memory: a pyramid in a folder or at a URL, of which a picture fetches the bricks that it sees."""

import numpy as np
import zarr

import forward_resample as fr

z, y, x = np.meshgrid(*[np.linspace(-1, 1, 128, dtype=np.float32)] * 3, indexing="ij", sparse=True)
level = np.exp(-20 * (np.sqrt(x**2 + y**2 + z**2) - 0.7 + 0.1 * np.sin(9 * x) * np.sin(9 * y)) ** 2)

image = zarr.open_group("shell.zarr", mode="w")
datasets = []
for number in range(4):
    image.create_array(str(number), data=(255 * level).astype(np.uint8), chunks=(32, 32, 32))
    datasets.append({"path": str(number), "coordinateTransformations": [{"type": "scale", "scale": [2.0**number] * 3}]})
    half = len(level) // 2
    level = level.reshape(half, 2, half, 2, half, 2).mean((1, 3, 5))
axes = [{"name": name, "type": "space"} for name in "zyx"]
image.attrs["ome"] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": datasets}]}

# "s3://bucket/shell.zarr" and "https://..." do as well; held_voxels= is small here so that something is left to fetch.
shell = fr.Pyramid("shell.zarr", ("viridis", [0, 0, 0.1, 0.6], (0, 255)), opacity_unit=4.0, held_voxels=1 << 15, shade="phong")
picture = shell.render(orbit=(30, 20), size=(400, 300), background="black")
print(picture.stats)
picture.save("pyramid.png")
