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
    """

    depth: Optional[npt.NDArray[np.float32]]
    planes: dict[str, npt.NDArray[np.float32]]
    stats: dict[str, Any]
    notes: list[str]

    def __new__(
        cls,
        rgba: npt.ArrayLike,
        depth: Optional[npt.NDArray[np.float32]] = None,
        planes: Optional[Mapping[str, npt.NDArray[np.float32]]] = None,
        stats: Optional[Mapping[str, Any]] = None,
        notes: Iterable[str] = (),
    ) -> Picture:
        picture = np.asarray(rgba, dtype=np.float32).view(cls)
        picture.depth, picture.planes = depth, dict(planes or {})
        picture.stats, picture.notes = dict(stats or {}), list(notes)
        return picture

    def __array_finalize__(self, source: Any) -> None:
        # What lies beside the pixels goes with an array of the same size, not with a part of it.
        whole = getattr(source, "shape", None) == self.shape
        self.depth = getattr(source, "depth", None) if whole else None
        self.planes = getattr(source, "planes", {}) if whole else {}
        self.stats = getattr(source, "stats", {}) if whole else {}
        self.notes = getattr(source, "notes", []) if whole else []

    def __reduce__(self) -> Any:
        beside = (self.depth, self.planes, self.stats, self.notes)
        return Picture, (np.asarray(self), *beside)

    def _pixels(self) -> npt.NDArray[np.float32]:
        if self.ndim != 3 or self.shape[2] != 4:
            raise ValueError(f"picture: expected the shape (height, width, 4), got {self.shape}")
        return np.ascontiguousarray(self.view(np.ndarray), dtype=np.float32)

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
