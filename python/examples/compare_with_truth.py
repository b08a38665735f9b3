"""How far settings are from the most exact picture, and what they cost."""

import time

import numpy as np

import forward_resample as fr

z, y, x = np.mgrid[-1:1:64j, -1:1:64j, -1:1:64j]
waves = np.sin(14 * np.hypot(x, np.hypot(y, z))).astype(np.float32)
volume = fr.Volume(waves, transfer=("coolwarm", [0, 0, 0.2, 0, 0.6]), size=(240, 240))

truth = volume.render(slab=0.125, subpixels=8, min_transmittance=0.00001)
covered = truth[..., 3] > 0
for options in ({"slab": 2, "subpixels": 1}, {}, {"max_error": "1/64"}):
    start = time.perf_counter()
    picture = volume.render(**options)
    error = float(np.sqrt(np.mean((picture - truth)[covered] ** 2)))
    print(f"{options}: error {error:.5f}, {1e3 * (time.perf_counter() - start):.0f} ms")
