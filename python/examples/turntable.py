"""A turntable, as a video where ffmpeg is there, else as an animation."""

import shutil

import numpy as np

import forward_resample as fr

z, y, x = np.mgrid[-1:1:64j, -1:1:64j, -1:1:64j]
knot = np.exp(-30 * ((np.hypot(x, y) - 0.6 - 0.2 * np.sin(3 * np.arctan2(y, x))) ** 2 + (z - 0.3 * np.cos(3 * np.arctan2(y, x))) ** 2))

volume = fr.Volume(knot, transfer="plasma", shade="phong", up="z", background="black")
name = "turntable.mp4" if shutil.which("ffmpeg") else "turntable.webp"
volume.write(name, turntable=24, size=(320, 240))
