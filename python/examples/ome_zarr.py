"""An OME-Zarr image: a level of the pyramid by its path, or its array by zarr-python."""

import numpy as np
import zarr

import forward_resample as fr

z, y, x = np.mgrid[-1:1:64j, -1:1:64j, -1:1:64j]
cells = sum(np.exp(-60 * ((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2)) for a, b, c in np.random.default_rng(5).uniform(-0.7, 0.7, (30, 3)))
cells = (255 * cells / cells.max()).astype(np.uint8)

image = zarr.create_group("cells.zarr", overwrite=True, zarr_format=2)
levels = []
for level in range(2):
    step = 2**level
    array = cells[::step, ::step, ::step]
    image.create_array(str(level), shape=array.shape, chunks=(32, 32, 32), dtype="u1", chunk_key_encoding={"name": "v2", "separator": "/"})[:] = array
    scale = {"type": "scale", "scale": [0.4 * step, 0.2 * step, 0.2 * step]}
    levels.append({"path": str(level), "coordinateTransformations": [scale]})
axes = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
image.attrs["multiscales"] = [{"version": "0.4", "axes": axes, "datasets": levels}]

fine = fr.Volume("cells.zarr").render(transfer="viridis", size=(400, 300), background="black")
coarse = fr.Volume("cells.zarr#level=1").render(transfer="viridis", size=(400, 300), background="black")
by_zarr = fr.volsplat(image["0"], spacing=(0.2, 0.2, 0.4), transfer="viridis", size=(400, 300), background="black")
assert np.array_equal(fine, by_zarr)
print("error of the coarser level:", float(np.sqrt(np.mean((fine - coarse) ** 2))))
fine.save("ome_zarr.png")
