"""Pictures: arrays that know how they are shown and saved."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _native

Path = Union[str, "os.PathLike[str]"]


class Picture(np.ndarray):
    """A picture: float32 of the shape (height, width, 4), red, green, blue and alpha.

    Colours are linear light, premultiplied with alpha; rows run from the top. It is an array in every other way. A notebook
    shows it as a picture.

    Attributes:
        depth: camera z of what each pixel shows, float32 (height, width), in world units, infinite where that is nothing; or None.
        planes: further planes by name, such as those of ``layers=``.
        stats: counts and times of the drawing, as ``--stats`` has them, and under ``"planned"`` what ``max_error`` or
            ``max_time`` chose.
        notes: the sentences that the command line would have printed.
        camera: the camera as camera files have it: ``width``, ``height``, ``fx``, ``fy``, ``cx``, ``cy`` in px from the upper left corner,
            ``R`` (row by row) and ``t`` from the world to the camera (x right, y down, z forward), ``near``, and
            ``projection`` where it is ``"orthographic"``; or None.
        colours: ``(low, high)`` and the display colours (n, 3) from the one to the other, where values have one scale of colours; or None.
    """

    depth: Optional[npt.NDArray[np.float32]]
    planes: dict[str, npt.NDArray[np.float32]]
    stats: dict[str, Any]
    notes: list[str]
    camera: Optional[dict[str, Any]]
    colours: Optional[tuple[tuple[float, float], npt.NDArray[np.float64]]]

    def __new__(
        cls,
        rgba: npt.ArrayLike,
        depth: Optional[npt.NDArray[np.float32]] = None,
        planes: Optional[Mapping[str, npt.NDArray[np.float32]]] = None,
        stats: Optional[Mapping[str, Any]] = None,
        notes: Iterable[str] = (),
        camera: Optional[Mapping[str, Any]] = None,
        colours: Optional[tuple[tuple[float, float], npt.ArrayLike]] = None,
    ) -> Picture:
        picture = np.asarray(rgba, dtype=np.float32).view(cls)
        picture.depth, picture.planes = depth, dict(planes or {})
        picture.stats, picture.notes = dict(stats or {}), list(notes)
        picture.camera = None if camera is None else dict(camera)
        picture.colours = None
        if colours is not None:
            (low, high), shown = colours
            picture.colours = ((float(low), float(high)), np.asarray(shown, dtype=np.float64))
        return picture

    def __array_finalize__(self, source: Any) -> None:
        # What lies beside the pixels goes with an array of the same size, not with a part of it.
        whole = getattr(source, "shape", None) == self.shape
        self.depth = getattr(source, "depth", None) if whole else None
        self.planes = getattr(source, "planes", {}) if whole else {}
        self.stats = getattr(source, "stats", {}) if whole else {}
        self.notes = getattr(source, "notes", []) if whole else []
        self.camera = getattr(source, "camera", None) if whole else None
        self.colours = getattr(source, "colours", None) if whole else None

    def __reduce__(self) -> Any:
        beside = (self.depth, self.planes, self.stats, self.notes, self.camera, self.colours)
        return Picture, (np.asarray(self), *beside)

    def _pixels(self) -> npt.NDArray[np.float32]:
        if self.ndim != 3 or self.shape[2] != 4:
            raise ValueError(f"picture: expected the shape (height, width, 4), got {self.shape}")
        return np.ascontiguousarray(self.view(np.ndarray), dtype=np.float32)

    def project(self, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Places of points of the world in the picture.

        Args:
            points: (n, 3) or (3,), world units.

        Returns:
            As many rows of x and y, px from the upper left corner (the centre of the first pixel is at 0.5, 0.5), and camera z,
            world units. Points behind the eye of a perspective camera have NaN for x and y.

        Raises:
            ValueError: the picture has no camera, or the points have not three coordinates.

        >>> camera = {"width": 4, "height": 2, "fx": 2, "fy": 2, "cx": 2, "cy": 1, "R": [1, 0, 0, 0, 1, 0, 0, 0, 1], "t": [0, 0, 5]}
        >>> Picture(np.zeros((2, 4, 4)), camera=camera).project([[0, 0, 0], [1, -1, -3]]).tolist()
        [[2.0, 1.0, 5.0], [3.0, 0.0, 2.0]]
        """
        if self.camera is None:
            raise ValueError("project: this picture has no camera; a part of a picture has none")
        world = np.asarray(points, dtype=np.float64)
        if world.shape[-1:] != (3,):
            raise ValueError(f"points: expected the shape (n, 3), got {world.shape}")
        camera = self.camera
        x, y, z = np.moveaxis(world @ np.reshape(camera["R"], (3, 3)).T + np.asarray(camera["t"]), -1, 0)
        if camera.get("projection") == "orthographic":
            scale = np.ones_like(z)
        else:
            scale = np.divide(1.0, z, out=np.full_like(z, np.nan), where=z > 0)
        return np.stack([camera["fx"] * x * scale + camera["cx"], camera["fy"] * y * scale + camera["cy"], z], axis=-1)

    def to_srgb8(self) -> npt.NDArray[np.uint8]:
        """The picture as a PNG has it: uint8 (height, width, 4), sRGB with straight alpha.

        >>> Picture([[[0.25, 0.25, 0.25, 0.5]]]).to_srgb8().tolist()
        [[[188, 188, 188, 128]]]
        """
        return _native.srgb8(self._pixels())

    def save(self, path: Path, bits: Optional[int] = None) -> None:
        """Writes the picture to a ``.png`` of 8 or 16 ``bits``, or to an ``.exr``, which also holds depth and planes.

        Raises:
            ValueError: the name has another ending, or ``bits`` does not go with it.
            OSError: the file cannot be written.
        """
        _native.save(os.fspath(path), self._pixels(), self.depth, self.planes, bits)

    def _repr_png_(self) -> Optional[bytes]:
        if self.ndim != 3 or self.shape[2] != 4:
            return None
        return _native.png(self._pixels())


def write_film(path: Path, pictures: Iterable[npt.NDArray[np.float32]], fps: int = 25, count: Optional[int] = None) -> None:
    """Writes pictures of one size as an animation: ``.apng``, ``.webp``, ``.gif``, or through the program ffmpeg ``.mp4``, ``.webm``, ``.mkv``.

    Args:
        path: the file.
        pictures: arrays of the shape (height, width, 4), linear light, premultiplied.
        fps: pictures a second.
        count: how many there are, where ``pictures`` does not say it.

    Raises:
        ValueError: the name has another ending, or the pictures differ in size.
        OSError: the file cannot be written.
    """
    if count is None:
        pictures = list(pictures)
        count = len(pictures)
    arrays = (Picture(picture)._pixels() for picture in pictures)
    _native.write_film(os.fspath(path), arrays, count, fps)
