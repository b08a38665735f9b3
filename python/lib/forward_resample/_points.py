"""Scans of points: opaque surfaces, drawn without a mesh."""

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

    from ._options import PointsCall, PointsOptions, PointsPictures, PointsRender


class Points(Scene):
    """A scan that is drawn again and again: every point is a disc of the surface through its neighbours.

    Args:
        positions: (n, 3) places in the world; or the name of a file (PLY, LAS, LAZ, E57, PCD, PTX, PTS, XYZ), which has all the rest.
        colours: (n, 3) sRGB: whole numbers from 0 to 255, or parts of 1 in floating point.
        intensities: (n,) strengths of the returns, of any range.
        classes: (n,) whole numbers from 0 to 255, as the LAS standard numbers them.
        threads: how many draw; all processors if not given. The pictures do not depend on it.
        options: any option of ``resample points``, for all pictures.

    Without ``camera`` or ``up``, z is up. Discs have normals and radii of their own, which the places alone decide.

    Raises:
        ValueError: an array has another shape or a number that cannot be, an option has no such value.
        TypeError: there is no such option.
        OSError: the file cannot be read.

    >>> y, x = np.mgrid[0:30, 0:40]
    >>> floor = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    >>> Points(floor, color_by="normal").render(size=(32, 24)).shape
    (24, 32, 4)
    >>> Points(floor, colours=[[255, 0, 0]])
    Traceback (most recent call last):
    ValueError: colours: expected 1200 rows, one for each position, got 1
    """

    if TYPE_CHECKING:

        def render(  # type: ignore[override]
            self, camera: Any = None, *, progress: Progress = None, **options: Unpack[PointsRender]
        ) -> Picture: ...

        def pictures(  # type: ignore[override]
            self, *, progress: Progress = None, **options: Unpack[PointsPictures]
        ) -> Iterator[Picture]: ...

    def __init__(
        self,
        positions: Any,
        colours: Any = None,
        *,
        intensities: Any = None,
        classes: Any = None,
        threads: Optional[int] = None,
        **options: Unpack[PointsCall],
    ):
        self._options = self._given(options)
        _native.check("points", ["positions"], self._options)
        if isinstance(positions, (str, os.PathLike)):
            if any(part is not None for part in (colours, intensities, classes)):
                raise ValueError("positions: is a file, which has colours, intensities and classes of its own")
            with open(positions, "rb"):
                pass  # Raises what Python says of such a file.
            self._native = _native.Scene.files("points", [os.fspath(positions)], threads)
            return
        self._native = _native.Scene.points(_arrays(positions, colours, intensities, classes), threads)


def points(
    positions: Any,
    colours: Any = None,
    camera: Any = None,
    size: Optional[tuple[int, int]] = None,
    *,
    intensities: Any = None,
    classes: Any = None,
    progress: Progress = None,
    **options: Unpack[PointsOptions],
) -> Picture:
    """Draws a scan once; see :class:`Points` for the arrays, and :meth:`Points.render` for the other arguments.

    >>> y, x = np.mgrid[0:30, 0:40]
    >>> picture = points(np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), size=(33, 33), color_by="height")
    >>> picture.shape
    (33, 33, 4)
    """
    call: dict[str, Any] = {**options}
    if size is not None:
        call["size"] = size
    scene = Points(positions, colours, intensities=intensities, classes=classes, **call)
    return scene.render(camera, progress=progress)


def _arrays(positions: Any, colours: Any, intensities: Any, classes: Any) -> dict[str, Any]:
    arrays: dict[str, Any] = {
        "positions": table(positions, "positions", 3, np.float64),
        "colours": None if colours is None else _colours(as_array(colours, "colours")),
        "intensities": None if intensities is None else _column(as_array(intensities, "intensities"), "intensities"),
        "classes": None if classes is None else _classes(_column(as_array(classes, "classes"), "classes")),
    }
    count = len(arrays["positions"])
    if count == 0:
        raise ValueError("positions: is empty: there is nothing to draw")
    for name, array in arrays.items():
        if array is None:
            continue
        if len(array) != count:
            raise ValueError(f"{name}: expected {count} rows, one for each position, got {len(array)}")
        _refuse(~np.isfinite(array).all(axis=1), f"{name}: row {{}} has a number that is not finite: leave such points out")
    if arrays["intensities"] is not None:
        arrays["intensities"] = arrays["intensities"].astype(np.float32)
    return arrays


def _column(array: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != 2 or array.shape[1] != 1:
        raise ValueError(f"{name}: expected the shape (n,), got {array.shape}")
    return np.ascontiguousarray(array)


def _colours(colours: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """sRGB in 8 bits, as scans have it."""
    if colours.ndim != 2 or colours.shape[1] != 3:
        raise ValueError(f"colours: expected the shape (n, 3), got {colours.shape}")
    if colours.dtype.kind in "iu":
        codes = ((colours >= 0) & (colours <= 255)).all(axis=1)
        _refuse(np.asarray(~codes), "colours: row {} is not within 0 and 255: expected 8 bits, or parts of 1 in floating point")
        return np.ascontiguousarray(colours, dtype=np.uint8)
    parts = colours.astype(np.float64)
    within = ((parts >= 0) & (parts <= 1)).all(axis=1)
    _refuse(np.asarray(~within), "colours: row {} is not within 0 and 1: expected 8 bits in whole numbers, or parts of 1")
    return np.ascontiguousarray(np.floor(255 * parts + 0.5).astype(np.uint8))


def _classes(classes: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    whole = (classes >= 0) & (classes <= 255) & (classes == np.floor(classes))
    _refuse(~whole[:, 0], "classes: row {} is no whole number from 0 to 255")
    return classes.astype(np.uint8)


def _refuse(wrong: npt.NDArray[np.bool_], says: str) -> None:
    if wrong.any():
        raise ValueError(says.format(int(np.argmax(wrong))))
