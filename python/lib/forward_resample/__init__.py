"""Pictures of arrays: volumes, 3-D Gaussians, textured meshes, depth images and scans of points, drawn by the CPU without a display.

The pictures are those of the command line ``resample``, byte for byte, and every option of its commands is a keyword
argument: ``--max-error 1/255`` is ``max_error="1/255"``. :func:`options` lists them.

>>> import numpy as np
>>> import forward_resample as fr
>>> z, y, x = np.mgrid[-1:1:32j, -1:1:32j, -1:1:32j]
>>> ball = (np.sqrt(x * x + y * y + z * z) < 0.7).astype(np.uint8)
>>> picture = fr.volsplat(ball, size=(64, 48))
>>> picture.shape, picture.dtype.name
((48, 64, 4), 'float32')

Pictures are linear light with premultiplied alpha; ``picture.to_srgb8()`` gives the bytes of a PNG, ``picture.save(path)``
writes one.
"""

from ._depth import DepthImage, warp, warp_film
from ._gaussians import Gaussians, splats
from ._mesh import Mesh, texmap
from ._native import __version__
from ._picture import Picture, write_film
from ._plot import plot
from ._points import Points, points
from ._pyramid import Pyramid
from ._scene import ResampleWarning, options
from ._transfer import TransferFunction, transfer_function
from ._view import Viewer, view
from ._volume import Volume, volsplat

__all__ = [
    "DepthImage",
    "Gaussians",
    "Mesh",
    "Picture",
    "Points",
    "Pyramid",
    "ResampleWarning",
    "TransferFunction",
    "Viewer",
    "Volume",
    "__version__",
    "options",
    "plot",
    "points",
    "splats",
    "texmap",
    "transfer_function",
    "view",
    "volsplat",
    "warp",
    "warp_film",
    "write_film",
]
