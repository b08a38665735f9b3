"""A simulation in xarray, one picture a time step, over the same transfer function."""

import numpy as np
import xarray as xr

import forward_resample as fr

# Heat that spreads from two places.
side = np.linspace(0.0, 1.0, 48)
heat = np.zeros((48, 48, 48), np.float32)
heat[10:16, 10:16, 10:16] = heat[30:34, 20:26, 32:38] = 1.0
steps = []
for _ in range(6):
    steps.append(heat.copy())
    for _ in range(12):
        neighbours = sum(np.roll(heat, shift, axis) for axis in range(3) for shift in (-1, 1))
        heat = heat + 0.15 * (neighbours - 6 * heat)
run = xr.DataArray(np.stack(steps), dims=("time", "z", "y", "x"), coords={"z": side, "y": side, "x": side})

function = fr.transfer_function("inferno", [0.0, 0.05, 0.2, 0.6], clim=(0.0, 0.2))
camera = ((1.3, 1.0, 1.9), (0.5, 0.5, 0.5), (0, 1, 0))
frames = [fr.volsplat(run.isel(time=step), transfer=function, camera=camera, size=(240, 200), background="black") for step in range(6)]
fr.write_film("xarray_simulation.apng", frames, fps=4)
