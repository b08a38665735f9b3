"""What volumes, meshes, depth images and scans have in common: options, pictures, progress."""

from __future__ import annotations

import json
import logging
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Optional, Union

import numpy as np

from . import _native
from ._picture import Path, Picture

#: True for a bar of tqdm, or a function of the finished share, 0 to 1.
Progress = Union[bool, Callable[[float], object], None]

_log = logging.getLogger("forward_resample")


class ResampleWarning(UserWarning):
    """What the command line says after ``warning:``."""


def options(command: str) -> dict[str, str]:
    """The options of a command, ``"volsplat"``, ``"gaussians"``, ``"texmap"``, ``"warp3d"`` or ``"points"``, each with the first sentence of its help.

    >>> options("volsplat")["slab"].startswith("Thickness of a slab")
    True
    """
    return dict(_native.options(command))


def as_json(value: Any) -> str:
    """JSON of dicts, lists, numbers and arrays."""

    def plain(other: Any) -> Any:
        if hasattr(other, "tolist"):
            return other.tolist()
        raise TypeError(f"{type(other).__name__} is no JSON")

    return json.dumps(value, default=plain)


def camera_option(camera: Any) -> Any:
    """A camera as the command line reads it from a file: a path, a dict, a list of dicts, or (position, target, up)."""
    if camera is None or isinstance(camera, (str, os.PathLike)):
        return camera
    if hasattr(camera, "focal_point") and hasattr(camera, "position"):
        up = getattr(camera, "up", None)
        up = getattr(camera, "viewup", (0, 1, 0)) if up is None else up
        camera = (camera.position, camera.focal_point, up)
    if isinstance(camera, dict):
        return as_json(camera)
    if isinstance(camera, (list, tuple)) and camera and all(isinstance(one, dict) for one in camera):
        return as_json(list(camera))
    vectors = np.asarray(camera, dtype=float)
    if vectors.shape != (3, 3):
        raise ValueError(f"camera: expected position, target and up (3x3 numbers), got the shape {vectors.shape}")
    position, target, up = vectors
    return as_json({"position": position, "target": target, "up": up})


def _short(value: Any) -> str:
    """A value in a line: of arrays the shape and the type."""
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return f"<{' x '.join(map(str, value.shape))} {value.dtype}>"
    if isinstance(value, (list, tuple)) and any(hasattr(one, "shape") for one in value):
        return f"[{', '.join(map(_short, value))}]"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def say(lines: list[str], explain: bool, stacklevel: int) -> None:
    """Warnings to ``warnings``, explanations to where they were asked for, all else to ``logging``."""
    for line in lines:
        kind, _, text = line.partition(": ")
        if kind == "warning":
            warnings.warn(text, ResampleWarning, stacklevel=stacklevel + 1)
        elif explain:
            print(line)
        else:
            _log.info(line)


class Scene:
    """A scene that is drawn: see :class:`Volume`, :class:`Gaussians`, :class:`Mesh`, :class:`DepthImage` and :class:`Points`."""

    _native: _native.Scene
    #: Options of every picture.
    _options: dict[str, Any]
    #: The arguments that it was made of, for other processes.
    _made: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls, *arguments: Any, **named: Any) -> Scene:
        scene = super().__new__(cls)
        scene._made = (arguments, named)
        return scene

    def __repr__(self) -> str:
        """The kind of the scene, what it was made of, and its options."""
        arguments, named = self._made
        own = [_short(one) for one in arguments] + [f"{name}={_short(value)}" for name, value in named.items()]
        return f"{type(self).__name__}({', '.join(own)})"

    def __reduce__(self) -> Any:
        return _made_again, (type(self), *self._made, self._options)

    def _all(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """The options of a picture: those of the scene, and over them those of the call."""
        return {**self._options, **self._given(given)}

    def _given(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Options in Python's own types as the command takes them."""
        own = dict(given)
        if "camera" in own:
            own["camera"] = camera_option(own["camera"])
        return own

    def _sizes(self, merged: dict[str, Any]) -> tuple[list[tuple[int, int]], bool]:
        """Width and height of each picture that the options ask for, and whether they are drawn in parts."""
        self._native.prepare(merged)
        return self._native.sizes()

    def _part(self, merged: dict[str, Any], number: int, columns: tuple[int, int], rows: tuple[int, int]) -> Any:
        """A part of a picture, without what lies behind it: colours, depth, planes, stats."""
        self._native.prepare(merged)
        return self._native.draw_window(number, columns, rows)

    def _finished(self, merged: dict[str, Any], rgba: Any) -> Any:
        """A whole picture with what lies behind it."""
        self._native.prepare(merged)
        return self._native.finished(rgba)

    def _drawn(self, number: int, notes: list[str], explain: bool, progress: Optional[Callable[[float], object]]) -> Picture:
        (rgba, depth, planes, stats), lines = self._native.draw(number, progress)
        say(lines, explain, 4)
        camera = json.loads(self._native.cameras())[number]
        return Picture(rgba, depth, planes, json.loads(stats), notes + lines, camera, self._native.colours())

    def render(self, camera: Any = None, *, progress: Progress = None, **options: Any) -> Picture:
        """Draws one picture.

        Args:
            camera: a dict as camera files have it (``position``, ``target``, ``up``; or ``fx``, ``fy``, ``cx``, ``cy``, ``R``, ``t``),
                ``(position, target, up)`` as PyVista has it, or the name of a camera file. Without it the visible part is framed as
                ``orbit=(azimuth, elevation)`` says.
            progress: True for a bar of tqdm, or a function of the finished share.
            options: any option of the command, such as ``size=(800, 600)`` or ``max_error="1/255"``.

        Returns:
            The picture, linear light and premultiplied.

        Raises:
            TypeError: an option has no such name; the message names those that look like it.
            ValueError: an option has a value that it cannot have, or they ask for several pictures.
            OSError: a file cannot be read.
            KeyboardInterrupt: after Ctrl-C, at once.
        """
        if camera is not None:
            options["camera"] = camera
        merged = self._all(options)
        explain = bool(merged.get("explain"))
        count, lines = self._native.prepare(merged)
        say(lines, explain, 2)
        if count != 1:
            raise ValueError(f"the options ask for {count} pictures: call pictures()")
        with _bar(progress, 1) as shown:
            return self._drawn(0, lines, explain, shown)

    def pictures(self, *, progress: Progress = None, **options: Any) -> Iterator[Picture]:
        """Draws all pictures that the options ask for, one after another: those of ``turntable=``, ``path=``, or a list of cameras.

        Args and errors are those of :meth:`render`.
        """
        merged = self._all(options)
        explain = bool(merged.get("explain"))
        count, lines = self._native.prepare(merged)
        say(lines, explain, 2)
        return self._iterated(merged, count, lines, progress)

    def _iterated(self, merged: dict[str, Any], count: int, lines: list[str], progress: Progress) -> Iterator[Picture]:
        with _bar(progress, count) as shown:
            for number in range(count):
                # Another picture may have been drawn since; where none was, this costs nothing.
                self._native.prepare(merged)

                def share(done: float, number: int = number) -> None:
                    if shown is not None:
                        shown((number + done) / count)

                yield self._drawn(number, lines, bool(merged.get("explain")), share if shown else None)
                share(1.0)

    def turntable(self, n: int, *, progress: Progress = None, **options: Any) -> list[Picture]:
        """Draws ``n`` pictures once around the visible part, from the azimuth of ``orbit=`` on.

        >>> import numpy as np
        >>> import forward_resample as fr
        >>> ramp = np.arange(4096, dtype=np.uint16).reshape(16, 16, 16)
        >>> len(fr.Volume(ramp).turntable(3, size=(16, 16)))
        3
        """
        return list(self.pictures(progress=progress, turntable=n, **options))

    def write(self, path: Path, **options: Any) -> None:
        """Draws all pictures and writes them as the command line does: ``.png``, ``.exr``, numbered by ``%04d``, or one animation.

        Raises:
            TypeError, ValueError, OSError: as :meth:`render`; nothing is written then.
        """
        merged = self._all(options)
        lines = self._native.write(os.fspath(path), merged)
        say(lines, bool(merged.get("explain")), 2)


def _made_again(kind: type[Scene], arguments: tuple[Any, ...], named: dict[str, Any], options: dict[str, Any]) -> Scene:
    """A scene in another process."""
    scene = kind(*arguments, **named)
    scene._options = options
    return scene


class _bar:
    """A function that shows the finished share, or None."""

    def __init__(self, progress: Progress, pictures: int):
        self.progress, self.pictures = progress, pictures
        self.bar: Any = None

    def __enter__(self) -> Optional[Callable[[float], object]]:
        if callable(self.progress):
            return self.progress
        if not self.progress:
            return None
        from tqdm.auto import tqdm  # type: ignore[import-untyped]

        form = "{percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
        if self.pictures > 1:
            form = "{n:.0f}/{total} " + form
        self.bar = tqdm(total=self.pictures, bar_format=form)
        return self.show

    def show(self, share: float) -> None:
        self.bar.n = share * self.pictures
        self.bar.refresh()

    def __exit__(self, *error: Any) -> None:
        if self.bar is not None:
            if error[0] is None:
                self.show(1.0)
            self.bar.close()
