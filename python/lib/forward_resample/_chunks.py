"""Chunks of a Zarr group that is read a little at a time: fetched once, kept in a folder that several processes share."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path
from threading import Lock
from typing import Any, Optional

import numpy as np
import numpy.typing as npt
import zarr
from zarr.storage import WrapperStore

#: Decoded chunks that a process keeps, bytes.
_KEPT_BYTES = 256 << 20

#: Chunks that are asked for at the same time. A guess: a far server answers one in some 50 ms.
_AT_ONCE = 8

#: The end of the name of a chunk that the store has not: all of its voxels are the fill value.
_MISSING = ".missing"


class CachedStore(WrapperStore[Any]):
    """A store whose values are kept in a folder. A value is written under another name and renamed: no reader sees half of it."""

    def __init__(self, store: Any, folder: Optional[str] = None):
        super().__init__(store)
        self.folder = folder
        #: Values and bytes that were asked of the store itself.
        self.fetched, self.fetched_bytes = 0, 0

    def _with_store(self, store: Any) -> CachedStore:
        return type(self)(store, self.folder)

    def __reduce__(self) -> Any:
        return type(self), (self._store, self.folder)

    async def get(self, key: str, prototype: Any, byte_range: Any = None) -> Any:
        if byte_range is not None or self.folder is None:
            return self._count(await self._store.get(key, prototype, byte_range))
        # Keys of chunks have slashes, and some systems know no difference between upper and lower case.
        path = Path(self.folder) / hashlib.sha256(key.encode()).hexdigest()
        if path.exists():
            return prototype.buffer.from_bytes(path.read_bytes())
        missing = path.with_suffix(_MISSING)
        if missing.exists():
            return None
        value = self._count(await self._store.get(key, prototype))
        _write(missing if value is None else path, b"" if value is None else value.to_bytes())
        return value

    def _count(self, value: Any) -> Any:
        if value is not None:
            self.fetched += 1
            self.fetched_bytes += len(value)
        return value


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent)
    with os.fdopen(handle, "wb") as file:
        file.write(content)
    os.replace(name, path)


class Level:
    """One level of a pyramid: voxels, and where they lie. Axes are x, y, z; positions are voxels of the finest level."""

    def __init__(self, array: Any, at: tuple[int, ...], scale: Any, offset: Any):
        self.array, self.at = array, at
        self.scale, self.offset = np.asarray(scale, float), np.asarray(offset, float)
        self.shape = np.array(array.shape[-1:-4:-1])
        self.chunk = np.array(getattr(array, "chunks", array.shape)[-1:-4:-1])
        self._kept: OrderedDict[tuple[int, ...], npt.NDArray[Any]] = OrderedDict()
        self._lock = Lock()
        self._most = max(64, _KEPT_BYTES // int(self.chunk.prod() * array.dtype.itemsize))

    def hold(self) -> Level:
        """The same level, read wholly."""
        whole = np.asarray(self.array[(*self.at, Ellipsis)])
        return Level(whole, (), self.scale, self.offset)

    def halved(self) -> Level:
        """The level that is twice as coarse, of means; this one is held."""
        padded = np.pad(self.array.astype(np.float32), [(0, side % 2) for side in self.array.shape], "edge")
        steps = [2 if side > 1 else 1 for side in self.array.shape]
        halves = [np.add.reduceat(padded, np.arange(0, padded.shape[0], steps[0]), 0)]
        for axis in (1, 2):
            halves.append(np.add.reduceat(halves[-1], np.arange(0, halves[-1].shape[axis], steps[axis]), axis))
        factor = np.array(steps[::-1], float)
        mean = (halves[-1] / factor.prod()).astype(np.float32)
        return Level(mean, (), self.scale * factor, self.offset + 0.5 * (factor - 1) * self.scale)

    def index(self, position: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.asarray((position - self.offset) / self.scale)

    def block(self, low: Any, high: Any, margin: int) -> tuple[npt.NDArray[Any], npt.NDArray[np.int64]]:
        """The voxels [z][y][x] around a box, continued beyond the ends of the volume, and the index of the first."""
        first = np.floor(self.index(low)).astype(int) - margin
        end = np.ceil(self.index(high)).astype(int) + 1 + margin
        inner_first, inner_end = np.clip(first, 0, self.shape - 1), np.clip(end, 1, self.shape)
        block = self._read(inner_first, inner_end)
        before, after = inner_first - first, end - inner_end
        if before.any() or after.any():
            block = np.pad(block, list(zip(before[::-1], after[::-1])), "edge")
        return np.ascontiguousarray(block), first

    def _read(self, first: npt.NDArray[np.int64], end: npt.NDArray[np.int64]) -> npt.NDArray[Any]:
        if isinstance(self.array, np.ndarray):
            return self.array[tuple(slice(a, b) for a, b in zip(first[::-1], end[::-1]))]
        low, high = first // self.chunk, (end - 1) // self.chunk
        places = list(product(*(range(a, b + 1) for a, b in zip(low, high))))
        with self._lock:
            missing = [place for place in places if place not in self._kept]
        # Threads wait for a far server at the same time.
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            found = dict(zip(missing, pool.map(self._fetch, missing)))
        block = np.empty((end - first)[::-1], self.array.dtype)
        with self._lock:
            for place in places:
                chunk = found[place] if place in found else self._kept.pop(place)
                self._kept[place] = chunk
                start = np.array(place) * self.chunk
                a, b = np.maximum(start, first), np.minimum(start + chunk.shape[::-1], end)
                to = tuple(slice(x, y) for x, y in zip((a - first)[::-1], (b - first)[::-1]))
                of = tuple(slice(x, y) for x, y in zip((a - start)[::-1], (b - start)[::-1]))
                block[to] = chunk[of]
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
        return block

    def _fetch(self, place: tuple[int, ...]) -> npt.NDArray[Any]:
        start = np.array(place) * self.chunk
        end = np.minimum(start + self.chunk, self.shape)
        return np.asarray(self.array[(*self.at, *(slice(a, b) for a, b in zip(start[::-1], end[::-1])))])


def opened(source: Any, cache: Optional[str]) -> tuple[Any, CachedStore]:
    """The group of a source, through a cache."""
    group = source if hasattr(source, "store") else zarr.open_group(os.fspath(source), mode="r")
    # Two pyramids may share a folder.
    folder = None if cache is None else str(Path(cache) / hashlib.sha256(str(group.store).encode()).hexdigest()[:16])
    cached: Any = zarr.open_group(store=CachedStore(group.store, folder), path=group.path, mode="r")
    # A store that may be written to is opened again as one that may not.
    return cached, cached.store


def levels(group: Any, at: tuple[int, ...]) -> list[Level]:
    """The levels of an OME-Zarr image, the finest first."""
    attributes = dict(group.attrs)
    attributes = attributes.get("ome", attributes)
    try:
        datasets = attributes["multiscales"][0]["datasets"]
    except (KeyError, IndexError, TypeError):
        raise ValueError("data: expected an OME-Zarr image, which has 'multiscales'") from None
    found: list[Level] = []
    first: Any = None
    for dataset in datasets:
        array = group[dataset["path"]]
        if array.ndim != 3 + len(at):
            raise ValueError(f"data: the array '{dataset['path']}' has {array.ndim} axes: expected {3 + len(at)}, as at={at} says")
        scale, translation = _transforms(dataset, array.ndim)
        first = first or (scale, translation)
        relative = (scale / first[0])[-1:-4:-1]
        moved = ((translation - first[1]) / first[0])[-1:-4:-1]
        # Many writers leave the translation out, although a mean of voxels lies in their middle.
        offset = moved if moved.any() else 0.5 * (relative - 1)
        found.append(Level(array, at, relative, offset))
    return found


def spacing(group: Any) -> npt.NDArray[np.float64]:
    """The distance of the finest voxels along x, y and z."""
    attributes = dict(group.attrs)
    dataset = attributes.get("ome", attributes)["multiscales"][0]["datasets"][0]
    return np.asarray(_transforms(dataset, 3)[0][-1:-4:-1])


def _transforms(dataset: Any, axes: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    scale, translation = np.ones(axes), np.zeros(axes)
    for transform in dataset.get("coordinateTransformations", ()):
        if transform.get("type") == "scale":
            scale = np.array(transform["scale"], float)
        elif transform.get("type") == "translation":
            translation = np.array(transform["translation"], float)
    return scale, translation



__all__ = ["CachedStore", "Level", "levels", "opened", "spacing"]
