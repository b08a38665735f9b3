"""3-D Gaussians: soft ellipsoids with an opacity and a colour that depends on the direction of view."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import as_array, table
from ._picture import Picture
from ._scene import Progress, Scene

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import GaussiansCall, GaussiansOptions, GaussiansPictures, GaussiansRender

#: The constant of the spherical harmonics of degree 0: sqrt(1/4pi).
_C0 = 0.28209479177387814


class Gaussians(Scene):
    """3-D Gaussians that are drawn again and again. The arrays are those of gsplat: tensors are taken as they are.

    Args:
        means: (n, 3) centres in the world; or the name of a file (PLY, .splat, SPZ, SOG, glTF), which has all the rest.
        quats: (n, 4) rotations from the axes of a Gaussian to the world, as quaternions w, x, y, z of any length.
        scales: (n, 3) standard deviations along these axes in world units, not their logarithms.
        opacities: (n,) parts of 1 at the centres, not their log odds.
        sh: (n, k, 3) coefficients of spherical harmonics, k = 1, 4, 9 or 16; a colour is 0.5 more than their sum.
        colours: (n, 3) in place of ``sh``: uint8, or parts of 1.
        blend: ``"srgb"`` where colours are display-referred, as nearly all are trained; ``"linear"`` where they are linear light.
        threads: how many draw; all processors if not given. The pictures do not depend on it.
        options: any option of ``resample gaussians``, for all pictures.

    Without ``camera`` or ``up``, -y is up, as in files of PLY: training keeps the axes of cameras, whose y points down.

    Raises:
        ValueError: an array has another shape or a number that cannot be, an option has no such value.
        TypeError: there is no such option.
        OSError: the file cannot be read.

    >>> ball = Gaussians([[0, 0, 0]], [[1, 0, 0, 0]], [[1, 1, 1]], [0.9], colours=[[1, 0.5, 0]])
    >>> ball.render(size=(32, 24)).shape
    (24, 32, 4)
    >>> Gaussians([[0, 0, 0]], [[1, 0, 0, 0]], [[1, 1, -5]], [0.9], colours=[[1, 0.5, 0]])
    Traceback (most recent call last):
    ValueError: scales: row 0 has a number below 0: expected standard deviations, not their logarithms
    """

    if TYPE_CHECKING:

        def render(  # type: ignore[override]
            self, camera: Any = None, *, progress: Progress = None, **options: Unpack[GaussiansRender]
        ) -> Picture: ...

        def pictures(  # type: ignore[override]
            self, *, progress: Progress = None, **options: Unpack[GaussiansPictures]
        ) -> Iterator[Picture]: ...

    def __init__(
        self,
        means: Any,
        quats: Any = None,
        scales: Any = None,
        opacities: Any = None,
        sh: Any = None,
        *,
        colours: Any = None,
        blend: str = "srgb",
        threads: Optional[int] = None,
        **options: Unpack[GaussiansCall],
    ):
        self._options = self._given(options)
        _native.check("gaussians", ["means"], self._options)
        if isinstance(means, (str, os.PathLike)):
            if any(part is not None for part in (quats, scales, opacities, sh, colours)):
                raise ValueError("means: is a file, which has rotations, scales, opacities and colours of its own")
            self._native = _native.Scene.files("gaussians", [os.fspath(means)], threads)
            return
        if blend not in ("srgb", "linear"):
            raise ValueError(f"blend: expected 'srgb' or 'linear', got {blend!r}")
        arrays = _arrays(means, quats, scales, opacities, sh, colours)
        self._native = _native.Scene.gaussians({**arrays, "is_linear": blend == "linear"}, threads)


def splats(
    means: Any,
    quats: Any = None,
    scales: Any = None,
    opacities: Any = None,
    sh: Any = None,
    camera: Any = None,
    size: Optional[tuple[int, int]] = None,
    *,
    colours: Any = None,
    blend: str = "srgb",
    progress: Progress = None,
    **options: Unpack[GaussiansOptions],
) -> Picture:
    """Draws 3-D Gaussians once; see :class:`Gaussians` for the arrays, and :meth:`Gaussians.render` for the other arguments.

    >>> picture = splats([[0, 0, 0]], [[1, 0, 0, 0]], [[1, 1, 1]], [0.9], [[[1, 0, 0]]], size=(33, 33), model="mip")
    >>> picture.shape
    (33, 33, 4)
    """
    call: dict[str, Any] = {**options}
    if size is not None:
        call["size"] = size
    scene = Gaussians(means, quats, scales, opacities, sh, colours=colours, blend=blend, **call)
    return scene.render(camera, progress=progress)


def _arrays(means: Any, quats: Any, scales: Any, opacities: Any, sh: Any, colours: Any) -> dict[str, Any]:
    given = {"quats": quats, "scales": scales, "opacities": opacities}
    missing = [name for name, value in given.items() if value is None]
    if missing:
        raise ValueError(f"{missing[0]}: is missing: Gaussians have means, quats, scales, opacities, and sh or colours")
    if (sh is None) == (colours is None):
        raise ValueError("sh: expected either sh or colours")
    parts = as_array(opacities, "opacities")
    if parts.ndim == 1:
        parts = parts[:, None]
    if parts.ndim != 2 or parts.shape[1] != 1:
        raise ValueError(f"opacities: expected the shape (n,), got {as_array(opacities, 'opacities').shape}")
    arrays: dict[str, Any] = {
        "means": table(means, "means", 3, np.float64),
        "quats": table(quats, "quats", 4, np.float32),
        "scales": table(scales, "scales", 3, np.float32),
        "opacities": np.ascontiguousarray(parts, dtype=np.float32),
        "harmonics": None,
    }
    if sh is not None:
        arrays["colours"], arrays["harmonics"] = _harmonics(as_array(sh, "sh"))
    else:
        arrays["colours"] = _colours(as_array(colours, "colours"))
    _check(arrays, "colours" if sh is None else "sh")
    return arrays


def _harmonics(sh: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float32], Optional[npt.NDArray[np.float32]]]:
    """Colours of degree 0, and the coefficients of higher degrees in rows."""
    if sh.ndim != 3 or sh.shape[1] not in (1, 4, 9, 16) or sh.shape[2] != 3:
        raise ValueError(f"sh: expected the shape (n, k, 3) with k = 1, 4, 9 or 16, got {sh.shape}")
    sh = sh.astype(np.float32)
    colours = np.ascontiguousarray(np.float32(0.5) + np.float32(_C0) * sh[:, 0])
    if sh.shape[1] == 1:
        return colours, None
    return colours, np.ascontiguousarray(sh[:, 1:]).reshape(len(sh), 3 * (sh.shape[1] - 1))


def _colours(colours: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    if colours.ndim != 2 or colours.shape[1] != 3:
        raise ValueError(f"colours: expected the shape (n, 3), got {colours.shape}")
    if colours.dtype == np.uint8:
        return np.ascontiguousarray(colours.astype(np.float32) / np.float32(255.0))
    return np.ascontiguousarray(colours, dtype=np.float32)


def _check(arrays: dict[str, Any], colour_name: str) -> None:
    """Refuses arrays of other lengths, and numbers that no Gaussian has."""
    count = len(arrays["means"])
    if count == 0:
        raise ValueError("means: is empty: there is nothing to draw")
    for key, array in arrays.items():
        name = colour_name if key in ("colours", "harmonics") else key
        if array is None:
            continue
        if len(array) != count:
            raise ValueError(f"{name}: expected {count} rows, one for each mean, got {len(array)}")
        _refuse(~np.isfinite(array).all(axis=1), f"{name}: row {{}} has a number that is not finite: leave such Gaussians out")
    _refuse((arrays["scales"] < 0).any(axis=1), "scales: row {} has a number below 0: expected standard deviations, not their logarithms")
    parts = arrays["opacities"][:, 0]
    _refuse((parts < 0) | (parts > 1), "opacities: row {} is not within 0 and 1: expected parts of 1, not their log odds")
    _refuse((arrays["quats"] == 0).all(axis=1), "quats: row {} has the length 0: expected w, x, y, z")


def _refuse(wrong: npt.NDArray[np.bool_], says: str) -> None:
    if wrong.any():
        raise ValueError(says.format(int(np.argmax(wrong))))
