"""Pictures by many processes or machines: on Dask, on Ray, or by an executor such as that of mpi4py.

A scene is sent to each process once; it reads or prepares it once, and draws whole pictures or tiles of them. The parts are joined in order, and give the bytes that one process gives. Parts whose worker is lost are drawn by another.

>>> import numpy as np
>>> from concurrent.futures import ThreadPoolExecutor
>>> from forward_resample import Volume
>>> volume = Volume(np.arange(4096, dtype=np.uint16).reshape(16, 16, 16), size=(40, 64))
>>> with ThreadPoolExecutor(2) as executor:
...     pictures = render(volume, executor, tile=(40, 16), turntable=3)
>>> all(np.array_equal(a, b) for a, b in zip(pictures, volume.turntable(3)))
True
"""

from __future__ import annotations

import json
import pickle
import uuid
from collections import OrderedDict
from collections.abc import Callable, Sequence
from threading import Lock
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _native
from ._picture import Picture
from ._scene import Scene

#: Parts that a run is split into at least, where its pictures are few. A guess: enough for the last worker to end with the others.
_PARTS = 16

#: Side of the renderers' own tiles, px: parts begin at their edges.
_TILE = 16

#: Levels of vector instructions, the least first.
_LEVELS = ("baseline", "avx2", "avx512")

#: Scenes that this process has made, by the run that they are for; the last ones only, because they may be large.
_kept: OrderedDict[str, tuple[Scene, dict[str, Any]]] = OrderedDict()
_MOST_KEPT = 2
_lock = Lock()


class Task(NamedTuple):
    """What a part shows: columns and rows of a picture, each from the first to the one behind the last."""

    number: int
    columns: tuple[int, int]
    rows: tuple[int, int]


class Part(NamedTuple):
    """A part of a picture, and the vector instructions that drew it."""

    task: Task
    rgba: Any
    depth: Any
    planes: dict[str, Any]
    stats: str
    level: str


def render(
    scene: Scene,
    client: Any,
    *,
    tile: Optional[tuple[int, int]] = None,
    retries: int = 3,
    **options: Any,
) -> list[Picture]:
    """Draws all pictures that the options ask for, by the workers of ``client``.

    Args:
        scene: a :class:`Volume`, :class:`Mesh` or :class:`DepthImage`. Of a file only the name is sent, which all workers must be able
            to read; arrays are sent once to each.
        client: a ``dask.distributed.Client``, the module ``ray`` after ``ray.init()``, or an executor, such as
            ``mpi4py.futures.MPIPoolExecutor()``.
        tile: width and height of a part, px, rounded up to multiples of 16; without it whole pictures where they are many, and bands
            of rows where they are few. Warps are not divided within a picture.
        retries: how often a part is drawn again whose worker was lost.
        options: of the pictures: ``turntable=``, ``path=``, ``camera=``, ``size=`` and all others.

    Returns:
        The pictures in order, with the bytes that ``scene.pictures(...)`` gives on a processor with the same vector instructions.

    Raises:
        RuntimeError: workers have unlike vector instructions, so that parts would not fit together: give ``vector_level=``, such as
            ``"avx2"``; or a part was lost more than ``retries`` times.
        TypeError, ValueError, OSError: as :meth:`Scene.render`.
    """
    merged = scene._all(options)
    if "max_time" in merged:
        raise ValueError("max_time: workers are not equally fast, and would choose unlike settings: give max_error")
    sizes, has_parts = scene._sizes(merged)
    tasks = _tasks(sizes, tile if has_parts else _whole(sizes))
    recipe = pickle.dumps((scene, merged))
    token = uuid.uuid4().hex
    parts = _engine(client)(client, recipe, token, tasks, retries)
    _check_levels(parts)
    pictures = []
    for number, size in enumerate(sizes):
        own = [part for part in parts if part.task.number == number]
        pictures.append(_joined(scene, merged, own, size))
    return pictures


def _whole(sizes: Sequence[tuple[int, int]]) -> tuple[int, int]:
    return max(width for width, _ in sizes), max(height for _, height in sizes)


def _tasks(sizes: Sequence[tuple[int, int]], tile: Optional[tuple[int, int]]) -> list[Task]:
    if tile is not None and (len(tile) != 2 or min(tile) < 1):
        raise ValueError(f"tile: expected a width and a height above 0, got {tile}")
    tasks = []
    for number, (width, height) in enumerate(sizes):
        across, down = tile or (width, -(-height * len(sizes) // _PARTS))
        spans = [_spans(side, each) for side, each in ((width, across), (height, down))]
        tasks += [Task(number, columns, rows) for rows in spans[1] for columns in spans[0]]
    return tasks


def _spans(side: int, each: int) -> list[tuple[int, int]]:
    each = -(-each // _TILE) * _TILE
    return [(first, min(first + each, side)) for first in range(0, side, each)]


def draw_part(recipe: bytes, token: str, task: Task) -> Part:
    """Draws one part; runs on the workers."""
    with _lock:
        if token not in _kept:
            while len(_kept) >= _MOST_KEPT:
                _kept.popitem(last=False)
            _kept[token] = pickle.loads(recipe)
        scene, merged = _kept[token]
        rgba, depth, planes, stats = scene._part(merged, *task)
    level = _native.vector_level(merged.get("vector_level", "auto"))
    return Part(task, rgba, depth, planes, stats, level)


_Engine = Callable[[Any, bytes, str, "list[Task]", int], "list[Part]"]


def _engine(client: Any) -> _Engine:
    if hasattr(client, "scatter") and hasattr(client, "gather"):
        return _by_dask
    if hasattr(client, "remote") and hasattr(client, "put"):
        return _by_ray
    if hasattr(client, "submit"):
        return _by_executor
    raise TypeError(f"client: expected a client of Dask, the module ray, or an executor, got {type(client).__name__}")


def _by_dask(client: Any, recipe: bytes, token: str, tasks: list[Task], retries: int) -> list[Part]:
    found: dict[Task, Part] = {}
    fault: Optional[BaseException] = None
    for _ in range(retries + 1):
        left = [task for task in tasks if task not in found]
        if not left:
            break
        # What a lost worker held alone is sent again; a part whose worker is lost Dask itself gives to another.
        sent = client.scatter(recipe, broadcast=True, hash=False)
        futures = [client.submit(draw_part, sent, token, task, pure=False) for task in left]
        for task, future in zip(left, futures):
            try:
                found[task] = future.result()
            except Exception as error:
                if not _is_lost(error):
                    client.cancel(futures)
                    raise
                fault = error
    return _all_of(tasks, found, fault)


def _is_lost(error: BaseException) -> bool:
    """Whether a worker was lost, and not the drawing wrong."""
    names = {kind.__name__ for kind in type(error).__mro__}
    return not names.isdisjoint({"KilledWorker", "CancelledError", "FutureCancelledError", "CommClosedError"})


def _by_ray(ray: Any, recipe: bytes, token: str, tasks: list[Task], retries: int) -> list[Part]:
    remote = ray.remote(max_retries=retries)(draw_part)
    sent = ray.put(recipe)
    parts: list[Part] = ray.get([remote.remote(sent, token, task) for task in tasks])
    return parts


def _by_executor(executor: Any, recipe: bytes, token: str, tasks: list[Task], retries: int) -> list[Part]:
    futures = [executor.submit(draw_part, recipe, token, task) for task in tasks]
    return [future.result() for future in futures]


def _all_of(tasks: list[Task], found: dict[Task, Part], fault: Optional[BaseException]) -> list[Part]:
    lost = [task for task in tasks if task not in found]
    if lost:
        raise RuntimeError(f"{len(lost)} of {len(tasks)} parts were lost again and again") from fault
    return [found[task] for task in tasks]


def _check_levels(parts: list[Part]) -> None:
    levels = sorted({part.level for part in parts}, key=_LEVELS.index)
    if len(levels) > 1:
        raise RuntimeError(
            f"the workers have unlike vector instructions, {' and '.join(levels)}, whose pictures differ in the last digits: "
            f"give vector_level='{levels[0]}'"
        )


def _joined(scene: Scene, merged: dict[str, Any], parts: list[Part], size: tuple[int, int]) -> Picture:
    def whole(read: Callable[[Part], Any]) -> Any:
        first = read(parts[0])
        joined = np.empty((size[1], size[0], *first.shape[2:]), first.dtype)
        for part in parts:
            joined[slice(*part.task.rows), slice(*part.task.columns)] = read(part)
        return joined

    rgba = scene._finished(merged, whole(lambda part: part.rgba))
    depth = None if parts[0].depth is None else whole(lambda part: part.depth)
    planes = {name: whole(lambda part, name=name: part.planes[name]) for name in parts[0].planes}  # type: ignore[misc]
    stats = [json.loads(part.stats) for part in parts]
    return Picture(rgba, depth, planes, stats[0] if len(stats) == 1 else {"parts": stats})
