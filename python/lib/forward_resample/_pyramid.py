"""Volumes beyond memory: a pyramid of levels, of which each picture fetches the bricks that it sees, as coarse as they may be."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from typing import Any, NamedTuple, Optional

import numpy as np
import numpy.typing as npt

from . import _native
from ._scene import Progress, Scene, _bar
from ._picture import Picture
from ._transfer import TransferFunction, transfer_function
from ._volume import Volume

_Floats = npt.NDArray[np.float64]
_Picture = npt.NDArray[np.float32]
#: Two corners of a box, in voxels of the finest level.
_Box = tuple[_Floats, _Floats]
#: Columns and rows of sub-pixels, each from the first to the one behind the last.
_Rect = tuple[int, int, int, int]

#: Voxels along a side of a brick.
_SIDE = 64

#: The finest level of at most so many voxels is read wholly: 256^3.
_HELD_VOXELS = 1 << 24

#: Beyond this even the coarsest level is too much to be read wholly.
_MOST_VOXELS = 1 << 28

#: The shares of the allowed error that a brick may take, and what is left out behind nearly opaque ones. Several bricks in a row may
#: err, and predictions are several times too large; what comes of it is measured on the page.
_OF_BRICK, _OF_HIDDEN = 0.5, 0.25

#: From level to level differences become a quarter where a field is smooth (errors grow with the square of the spacing), and a half
#: at edges. The half is trusted alone.
_LEAST_GROWTH = 0.5

#: They become eight times as large at most: so much of a spot is lost where it is smaller than a voxel of both.
_MOST_GROWTH = 8.0

#: The values of a finer level may reach beyond those of the coarser one by this share of their range, if not by more. A guess.
_FINER_RANGE = 0.25

#: Bricks whose voxels are smaller than this on the screen are not compared, px. What it costs and saves is measured on the page.
_FINEST_PX = 0.25

#: Levels beyond the one that is held: three in a row tell what a brick may show.
_COARSER = 3

#: The eye of a parallel view is so far from the volume, in lengths of its diagonal: beyond any slope that matters.
_FAR = 1e9

#: Side of the tiles that one process draws one after another, px.
_TILE = 256

#: Bricks end this far, in voxels, behind their faces, so that a plane of samples on a face belongs to one of them.
_BEHIND_FACE = 2.3e-4

#: Options that say what is seen and how it is finished, and not how a brick is drawn.
_OF_VIEWS = (
    "camera orbit fov up projection size turntable path fps background bits subpixels max_error explain opacity_unit".split()
)

#: Options that bricks cannot be drawn with, each by itself.
_REFUSED = ("crop_voxels", "gradient_filter", "layers", "blend", "iso", "with_iso", "with_slice", "shadows", "occlusion", "mask", "also", "labels", "channel", "order", "max_time", "max_memory", "preset", "colormap", "window")


class _View(NamedTuple):
    """A camera over the sub-pixels of a tile."""

    matrix: _Floats
    shift: _Floats
    focal: _Floats
    centre: _Floats
    size: tuple[int, int]
    near: float
    is_parallel: bool

    def rect(self, corners: _Floats) -> Optional[_Rect]:
        """Columns and rows, each from the first to the one behind the last, that a box may cover."""
        seen = corners @ self.matrix.T + self.shift
        if (seen[:, 2] <= self.near).all():
            return None
        if not self.is_parallel and (seen[:, 2] <= self.near).any():
            return 0, self.size[0], 0, self.size[1]
        places = seen[:, :2] / (1.0 if self.is_parallel else seen[:, 2:]) * self.focal + self.centre
        low = np.clip(np.floor(places.min(0)) - 1, 0, self.size).astype(int)
        high = np.clip(np.ceil(places.max(0)) + 1, 0, self.size).astype(int)
        if (low >= high).any():
            return None
        return int(low[0]), int(high[0]), int(low[1]), int(high[1])

    def eye(self, length: float) -> _Floats:
        """Where rays come from: of parallel ones so far away, for a volume of this length, that they are parallel."""
        seen = np.array([0.0, 0.0, -_FAR * length]) if self.is_parallel else np.zeros(3)
        return np.asarray(np.linalg.solve(self.matrix, seen - self.shift))

    def px(self, side: float, corners: _Floats) -> float:
        """The largest length on the screen of a side of a voxel in a box."""
        nearest = float((corners @ self.matrix[2] + self.shift[2]).min())
        return side * float(self.focal.max()) / (1.0 if self.is_parallel else max(nearest, self.near))


class Pyramid(Scene):
    """A volume that is larger than memory: an OME-Zarr image with levels, in a folder or far away.

    The finest level of at most ``held_voxels`` is read wholly. Of the others a picture fetches bricks of 64^3 voxels: those that its tiles see,
    neither transparent nor hidden, each from the coarsest level whose error is predicted to be small enough. To predict it, a brick is
    drawn from two levels or three.

    Args:
        data: a group of Zarr, a path, or a URL that fsspec reads (``"https://..."``, ``"s3://..."``).
        transfer: ``(cmap, opacity)``, ``(cmap, opacity, clim)`` or what :func:`transfer_function` gives. Opacities are per voxel of the
            finest level, unless ``opacity_unit=`` says otherwise.
        spacing: distance between the finest voxels along x, y and z; without it that of the image.
        at: the place along the axes before z, such as (time, channel).
        cache: a folder for what was fetched, which processes may share.
        held_voxels: the finest level of at most so many voxels is read wholly.
        finest_px: bricks whose voxels are smaller than this on the screen are drawn as they are, px; larger is cheaper.
        threads: how many draw.
        options: of every picture: ``max_error="1/255"`` (the default) is the error of a pixel that is allowed for coarse levels,
            ``subpixels=4`` (the default) has 4x4 samples in each.

    Raises:
        ValueError: ``data`` has no levels or not three axes; an option cannot be had for bricks.

    Limits: light emitted and absorbed. What is so small that no coarser level shows it is not found.
    """

    def __init__(
        self,
        data: Any,
        transfer: Any,
        *,
        spacing: Optional[npt.ArrayLike] = None,
        at: tuple[int, ...] = (),
        cache: Optional[str] = None,
        held_voxels: int = _HELD_VOXELS,
        finest_px: float = _FINEST_PX,
        threads: Optional[int] = None,
        **options: Any,
    ):
        from . import _chunks

        group, self._store = _chunks.opened(data, None if cache is None else os.fspath(cache))
        levels = _chunks.levels(group, at)
        held = next((number for number, level in enumerate(levels) if level.shape.prod() <= held_voxels), len(levels) - 1)
        if levels[held].shape.prod() > _MOST_VOXELS:
            raise ValueError(f"data: its coarsest level has {levels[held].shape.prod()} voxels: add coarser ones")
        levels[held] = levels[held].hold()
        self._levels = levels[: held + 1]
        for _ in range(_COARSER):
            self._levels.append(self._levels[-1].halved())
        self._held = held
        self._threads = threads
        self._finest_px = finest_px
        self._spacing = np.asarray(_chunks.spacing(group) if spacing is None else spacing, float)
        root = self._levels[held]
        function = _function(transfer, root.array)
        self._values, self._opacities = np.array(function["Points"], float).reshape(-1, 4)[:, :2].T
        unit = options.setdefault("opacity_unit", float(self._spacing.min()))
        coarse = self._spacing * root.scale
        overview = Volume(root.array, coarse, self._spacing * root.offset, transfer=function, opacity_unit=unit, threads=threads)
        self._native = overview._native
        self._options = {}
        self._options = self._all({**overview._options, **options})

    def _all(self, given: Any) -> dict[str, Any]:
        merged = super()._all(given)
        refused = [name for name in _REFUSED if name in merged]
        if refused:
            raise ValueError(f"{refused[0]}: cannot be had for a pyramid, which is drawn brick by brick")
        return merged

    def render(self, camera: Any = None, *, progress: Progress = None, **options: Any) -> Picture:
        """Draws one picture; see :meth:`Scene.render`. ``picture.stats`` says how many bricks were drawn and how many bytes fetched."""
        pictures = self.pictures(progress=progress, **(options if camera is None else {**options, "camera": camera}))
        return next(pictures)

    def pictures(self, *, progress: Progress = None, **options: Any) -> Iterator[Picture]:
        """Draws all pictures that the options ask for, one after another."""
        from .distributed import _joined, _tasks, draw_scene

        merged = self._all(options)
        sizes, _ = self._sizes(merged)
        tasks = _tasks(sizes, (_TILE, _TILE))
        with _bar(progress, len(sizes)) as shown:
            parts = []
            for done, task in enumerate(tasks):
                parts.append(draw_scene(self, merged, task))
                if shown is not None:
                    shown((done + 1) / len(tasks))
                if done + 1 == len(tasks) or tasks[done + 1].number != task.number:
                    yield _joined(self, merged, parts, sizes[task.number])
                    parts = []

    def write(self, path: Any, **options: Any) -> None:
        """Not for pyramids: draw ``pictures`` and save each."""
        raise TypeError("write: draw pictures() and save each")

    def _overview(self, merged: dict[str, Any]) -> dict[str, Any]:
        return {name: value for name, value in merged.items() if name not in ("max_error", "subpixels")}

    def _sizes(self, merged: dict[str, Any]) -> tuple[list[tuple[int, int]], bool]:
        return super()._sizes(self._overview(merged))

    def _finished(self, merged: dict[str, Any], rgba: Any) -> Any:
        return super()._finished(self._overview(merged), rgba)

    def _part(self, merged: dict[str, Any], number: int, columns: tuple[int, int], rows: tuple[int, int]) -> Any:
        self._native.prepare(self._overview(merged))
        camera = json.loads(self._native.cameras())[number]
        before = self._store.fetched, self._store.fetched_bytes
        tile = _Tile(self, merged, camera, columns, rows)
        rgba = tile.draw()
        fetched = {"chunks_fetched": self._store.fetched - before[0], "bytes_fetched": self._store.fetched_bytes - before[1]}
        return rgba, None, {}, json.dumps({**tile.counts, **fetched})

    def _shows(self, low: float, high: float) -> bool:
        """Whether any value of a range is seen."""
        inside = self._opacities[(self._values >= low) & (self._values <= high)]
        ends = np.interp((low, high), self._values, self._opacities)
        return bool(ends.any() or inside.any())


class _Tile:
    """One tile: bricks from the eye away, each laid behind those before it."""

    def __init__(self, pyramid: Pyramid, merged: dict[str, Any], camera: dict[str, Any], columns: tuple[int, int], rows: tuple[int, int]):
        self.pyramid, self.camera = pyramid, camera
        self.samples = int(merged.get("subpixels", 4))
        # Two samples beyond its rim would change nothing: each is drawn by itself.
        self.first = np.array([columns[0], rows[0]])
        size = ((columns[1] - columns[0]) * self.samples, (rows[1] - rows[0]) * self.samples)
        focal = np.array([camera["fx"], camera["fy"]]) * self.samples
        centre = (np.array([camera["cx"], camera["cy"]]) - self.first) * self.samples
        rotation = np.array(camera["R"]).reshape(3, 3)
        matrix = rotation * pyramid._spacing
        is_parallel = camera.get("projection") == "orthographic"
        self.view = _View(matrix, np.array(camera["t"]), focal, centre, size, camera["near"], is_parallel)
        self.last = pyramid._levels[0].shape - 1.0
        self.eye = self.view.eye(float(np.linalg.norm(self.last * pyramid._spacing)))
        # Parts that are cut off show nothing at any level, so that they are not walked through.
        self.kept = [np.zeros(3), self.last]
        if merged.get("crop") is not None:
            low, high = _numbers(merged["crop"], 6).reshape(2, 3) / pyramid._spacing
            self.kept = [np.maximum(self.kept[0], low), np.minimum(self.kept[1], high)]
        planes = merged.get("clip_plane")
        self.planes = np.zeros((0, 4)) if planes is None else _numbers(planes, 4)
        self.options = {name: value for name, value in merged.items() if name not in _OF_VIEWS}
        # Smooth gradients look farther than a brick's margin.
        self.options.update(subpixels=1, opacity_unit=merged["opacity_unit"], gradient_filter="central")
        self.margin = 1 if "shade" in merged or "gradient_opacity" in merged else 0
        most = float(Fraction(str(merged.get("max_error", "1/255"))))
        self.allowed, self.hidden = _OF_BRICK * most, _OF_HIDDEN * most
        self.rgba = np.zeros((size[1], size[0], 4), np.float32)
        self.counts = {"bricks": 0, "compared": 0, "transparent": 0, "hidden": 0}

    def draw(self) -> _Picture:
        held = self.pyramid._held
        self.walk(held, np.full(3, -0.5), self.last + 0.5)
        height, width = (side // self.samples for side in self.rgba.shape[:2])
        cells = self.rgba.reshape(height, self.samples, width, self.samples, 4)
        return np.ascontiguousarray(cells.mean((1, 3), dtype=np.float32))

    def walk(self, level: int, low: _Floats, high: _Floats) -> None:
        """Draws the bricks of a level in a box, the nearest first: along each axis a ray only moves away from the eye."""
        side = _SIDE * self.pyramid._levels[level].scale
        counts = np.maximum(np.ceil((high - low) / side - 1e-6).astype(int), 1)
        own = np.floor((self.eye - low) / side)
        places = np.array(list(product(*map(range, counts))))
        for place in places[np.argsort(np.abs(places - own).sum(1), kind="stable")]:
            first = low + place * side
            self.brick(level, first, np.minimum(first + side, high))

    def brick(self, level: int, low: _Floats, high: _Floats) -> None:
        inner = np.maximum(low, self.kept[0]), np.minimum(high, self.kept[1])
        corners = np.array(list(product(*zip(*inner))))
        rect = self.view.rect(corners)
        if rect is None or (inner[0] >= inner[1]).any() or self.is_clipped(corners):
            return
        left, right, top, bottom = self.whole_pixels(rect)
        window = (slice(top, bottom), slice(left, right))
        behind = 1.0 - self.rgba[window][..., 3:]
        if behind.max() < self.hidden:
            self.counts["hidden"] += 1
            return
        if not self.may_show(level + 1, inner):
            self.counts["transparent"] += 1
            return
        rect = left, right, top, bottom
        fine = self.drawn(level, inner, rect)
        if level > 0 and self.voxel_px(level, corners) > self.pyramid._finest_px:
            self.counts["compared"] += 1
            if self.is_coarse(level, inner, rect, fine, behind):
                self.walk(level - 1, low, high)
                return
        self.counts["bricks"] += 1
        self.rgba[window] += behind * fine

    def is_clipped(self, corners: _Floats) -> bool:
        """Whether a plane cuts off all of a box."""
        sides = corners @ (self.planes[:, :3] * self.pyramid._spacing).T - self.planes[:, 3]
        return bool((sides.max(0) < 0).any()) if len(self.planes) else False

    def is_coarse(self, level: int, box: _Box, rect: _Rect, fine: _Picture, behind: _Picture) -> bool:
        """Whether the levels below this one would change a picture by more than is allowed, as far as those above it tell."""
        if not fine.any():
            return self.may_show(level, box)
        coarse = self.drawn(level + 1, box, rect)
        last = self.difference(fine, coarse, behind)
        if last * _series(_LEAST_GROWTH, level) > self.allowed:
            return True
        if last * _series(_MOST_GROWTH, level) <= self.allowed:
            return False
        before = self.difference(coarse, self.drawn(level + 2, box, rect), behind)
        return _continued(last, before, level) > self.allowed

    def difference(self, fine: _Picture, coarse: _Picture, behind: _Picture) -> float:
        """The largest difference of the pixels of two pictures, behind what is before them."""
        height, width = (side // self.samples for side in fine.shape[:2])
        cells = ((fine - coarse) * behind).reshape(height, self.samples, width, self.samples, 4)
        return float(np.abs(cells.mean((1, 3))).max())

    def may_show(self, number: int, box: _Box) -> bool:
        """Whether the levels below this one may have values in a box that are seen, as far as it and two above it tell."""
        blocks = [level.block(*box, 0)[0] for level in self.pyramid._levels[number : number + 3]]
        lowest, highest = ([float(end(block)) for block in blocks] for end in (np.min, np.max))
        reach = _FINER_RANGE * (highest[0] - lowest[0])
        below = _continued(lowest[1] - lowest[0], lowest[2] - lowest[1], number)
        above = _continued(highest[0] - highest[1], highest[1] - highest[2], number)
        return self.pyramid._shows(lowest[0] - max(reach, below), highest[0] + max(reach, above))

    def voxel_px(self, level: int, corners: _Floats) -> float:
        """The largest side of a voxel on the screen, in a box."""
        side = float((self.pyramid._levels[level].scale * self.pyramid._spacing).max())
        return self.view.px(side, corners) / self.samples

    def whole_pixels(self, rect: _Rect) -> _Rect:
        left, right, top, bottom = rect
        side = self.samples
        return left // side * side, -(-right // side) * side, top // side * side, -(-bottom // side) * side

    def drawn(self, number: int, box: _Box, rect: _Rect) -> _Picture:
        """A box of a level by itself, on the sub-pixels of a rectangle."""
        left, right, top, bottom = rect
        level, spacing = self.pyramid._levels[number], self.pyramid._spacing
        block, first = level.block(*box, self.margin)
        if not self.pyramid._shows(float(block.min()), float(block.max())):
            return np.zeros((bottom - top, right - left, 4), np.float32)
        place = {
            "axes": np.diag(spacing * level.scale).tolist(),
            "origin": (spacing * (level.offset + level.scale * first)).tolist(),
            "up": None,
            "space": None,
        }
        ends = [level.index(end) - first + _BEHIND_FACE for end in box]
        camera = {
            "width": right - left,
            "height": bottom - top,
            "fx": self.view.focal[0],
            "fy": self.view.focal[1],
            "cx": self.view.centre[0] - left,
            "cy": self.view.centre[1] - top,
            "R": self.camera["R"],
            "t": self.camera["t"],
            "near": self.camera["near"],
            "projection": "orthographic" if self.view.is_parallel else "perspective",
        }
        scene = _native.Scene.volume([block], place, {}, (None, [], []), self.pyramid._threads)
        scene.prepare({**self.options, "camera": camera, "crop_voxels": np.concatenate(ends).tolist()})
        return scene.draw_window(0, (0, right - left), (0, bottom - top))[0]


def _series(ratio: float, count: int) -> float:
    return sum(ratio**power for power in range(1, count + 1))


def _continued(last: float, before: float, count: int) -> float:
    """The sum of ``count`` further changes, after two that were measured: each grows, or falls, as the last did."""
    if last <= 0.0:
        return 0.0
    growth = last / before if before > 0.0 else _MOST_GROWTH
    return last * _series(min(max(growth, _LEAST_GROWTH), _MOST_GROWTH), count)


def _numbers(value: Any, count: int) -> _Floats:
    """Rows of numbers, written as the command line or Python has them."""
    rows = [value] if isinstance(value, str) else value
    parts = [row.split(",") if isinstance(row, str) else row for row in rows]
    return np.array(parts, float).reshape(-1, count)


def _function(transfer: Any, overview: npt.NDArray[Any]) -> TransferFunction:
    """A transfer function whose range is known."""
    clim = float(overview.min()), float(overview.max())
    if isinstance(transfer, tuple) and len(transfer) == 2:
        return transfer_function(*transfer, clim if clim[0] < clim[1] else (clim[0], clim[0] + 1.0))
    if isinstance(transfer, tuple) and len(transfer) == 3:
        return transfer_function(*transfer)
    if isinstance(transfer, TransferFunction) and transfer.has_range:
        return transfer
    raise ValueError("transfer: expected (cmap, opacity), (cmap, opacity, clim) or a transfer function with a range")
