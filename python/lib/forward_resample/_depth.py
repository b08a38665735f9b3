"""Depth images: a picture, the depth of its pixels, and the camera that took them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import as_array
from ._picture import Picture
from ._scene import Progress, Scene, as_json, say

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import DepthCall, DepthOptions, DepthPictures, DepthRender

#: Largest codes of whole numbers.
_LARGEST = {"u1": 255, "u2": 65535, "u4": 2**32 - 1, "i1": 127, "i2": 32767, "i4": 2**31 - 1}


class DepthImage(Scene):
    """A picture with depth that is seen from one new camera after another.

    Args:
        colour: (h, w), (h, w, 3) or (h, w, 4): uint8 or uint16 in sRGB, red first (OpenCV reads blue first: ``bgr[..., ::-1]``), or
            linear light in floating point; or the name of a file.
        depth: (h, w): distance along the camera's axis in world units, unless ``depth_kind=`` (``"ray"``, ``"disparity"``, ...) and
            ``depth_scale=`` say otherwise; 0, NaN and infinity are unknown. Millimetres of a depth camera in uint16 need
            ``depth_scale=0.001``. It may have another size than the colours.
        K: the camera's matrix, 3x3, in pixels, with the centre of the first pixel at (0, 0) as OpenCV and Open3D have it
            (``pixel_centre="half"`` puts it at (0.5, 0.5)). Without it ``from_=`` says what the camera is, such as ``"fov:60"``, 60 degrees from top to bottom.
        pose: 4x4, from the world to the camera: x right, y down, z forward; OpenCV's (R|t), Open3D's ``extrinsic``. The identity if
            not given.
        references: further pictures, each ``(colour, depth, K, pose)``.
        pose_is: ``"camera_from_world"``, or ``"world_from_camera"`` for poses as trajectories have them.
        threads: how many draw; all processors if not given. The pictures do not depend on it.
        options: any option of ``resample warp3d``, for all pictures.

    Raises:
        ValueError: an array or a matrix has another shape, or an option has no such value.
        TypeError: there is no such option.
    """

    if TYPE_CHECKING:

        def render(  # type: ignore[override]
            self, camera: Any = None, *, progress: Progress = None, **options: Unpack[DepthRender]
        ) -> Picture: ...

        def pictures(  # type: ignore[override]
            self, *, progress: Progress = None, **options: Unpack[DepthPictures]
        ) -> Iterator[Picture]: ...

    def __init__(
        self,
        colour: Any,
        depth: Any,
        K: Optional[npt.ArrayLike] = None,
        pose: Optional[npt.ArrayLike] = None,
        *,
        references: Sequence[tuple[Any, Any, npt.ArrayLike, npt.ArrayLike]] = (),
        pose_is: str = "camera_from_world",
        pixel_centre: str = "integer",
        threads: Optional[int] = None,
        **options: Unpack[DepthCall],
    ):
        if pose_is not in ("camera_from_world", "world_from_camera"):
            raise ValueError(f"pose_is: expected camera_from_world or world_from_camera, got '{pose_is}'")
        if pixel_centre not in ("integer", "half"):
            raise ValueError(f"pixel_centre: expected integer or half, got '{pixel_centre}'")
        self._is_inverse, self._pixel_centre = pose_is == "world_from_camera", pixel_centre
        self._options = self._given(options)
        files = [isinstance(one, (str, os.PathLike)) for one in (colour, depth)]
        if all(files) and K is None and not references:
            self._size: Optional[list[int]] = None
            self._K: Any = None
            self._native = _native.Scene.files("warp3d", [os.fspath(colour), os.fspath(depth)], threads)
            _native.check("warp3d", ["colour", "depth"], self._options)
            return
        if any(files):
            raise ValueError("colour: give both colour and depth as files, with from_= for the camera, or both as arrays")
        arrays = [_picture(colour, depth)]
        height, width = arrays[0]["colour"].shape[:2]
        self._size, self._K = [width, height], K
        if K is not None:
            self._options["from_"] = as_json(self._camera(K, pose, [width, height], "pose_from"))
        elif pose is not None:
            raise ValueError("pose: needs the camera's matrix, K")
        further = []
        for other, other_depth, other_K, other_pose in references:
            arrays.append(_picture(other, other_depth))
            size = list(arrays[-1]["colour"].shape[1::-1])
            further.append(("colour", "depth", as_json(self._camera(other_K, other_pose, size, "references"))))
        if further:
            self._options["reference"] = further
        _native.check("warp3d", ["colour", "depth"], self._options)
        self._native = _native.Scene.depth(arrays, threads)

    def _camera(self, K: npt.ArrayLike, pose: Optional[npt.ArrayLike], size: Sequence[int], name: str) -> dict[str, Any]:
        """A camera as camera files have it."""
        matrix = np.asarray(K, dtype=float)
        if matrix.shape != (3, 3):
            raise ValueError(f"K: expected 3x3 numbers, got the shape {matrix.shape}")
        if abs(matrix[0, 1]) > 1e-9 * abs(matrix[0, 0]) or not np.allclose(matrix[1:, 0], 0) or matrix[2, 2] != 1.0:
            raise ValueError("K: expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
        place = np.eye(4) if pose is None else np.asarray(pose, dtype=float)
        if place.shape not in ((4, 4), (3, 4)):
            raise ValueError(f"{name}: expected 4x4 numbers, got the shape {place.shape}")
        place = np.vstack([place[:3], [0.0, 0.0, 0.0, 1.0]])
        if self._is_inverse:
            rotation = place[:3, :3].T
            place = np.vstack([np.column_stack([rotation, -rotation @ place[:3, 3]]), [0.0, 0.0, 0.0, 1.0]])
        return {
            "width": int(size[0]),
            "height": int(size[1]),
            "fx": matrix[0, 0],
            "fy": matrix[1, 1],
            "cx": matrix[0, 2],
            "cy": matrix[1, 2],
            "pixel_centre": self._pixel_centre,
            "R": place[:3, :3].reshape(-1),
            "t": place[:3, 3],
        }

    def to(
        self, pose: npt.ArrayLike, K: Optional[npt.ArrayLike] = None, size: Optional[Sequence[int]] = None
    ) -> dict[str, Any]:
        """The options of a new camera, or of several: ``pose`` is 4x4, or (n, 4, 4).

        Args:
            pose: where the new camera is, as the picture's own pose.
            K: its matrix; that of the picture if not given.
            size: width and height of its picture, px; those of the picture if not given.
        """
        matrix = self._K if K is None else K
        if matrix is None:
            raise ValueError("K: is needed for a new pose")
        size = self._size if size is None else size
        if size is None:
            raise ValueError("size: is needed for a new pose of a picture that is a file")
        poses = np.asarray(pose, dtype=float)
        if poses.ndim == 3:
            return {"to": as_json([self._camera(matrix, one, size, "pose_to") for one in poses])}
        return {"to": as_json(self._camera(matrix, poses, size, "pose_to"))}

    def view(self, pose: npt.ArrayLike, K: Optional[npt.ArrayLike] = None, size: Optional[Sequence[int]] = None, **options: Any) -> Picture:
        """Draws what a new camera sees: see :meth:`to` for it, and :meth:`render` for the rest."""
        return self.render(**self.to(pose, K, size), **options)


def warp(
    colour: Any,
    depth: Any,
    K: Optional[npt.ArrayLike] = None,
    pose_from: Optional[npt.ArrayLike] = None,
    pose_to: Optional[npt.ArrayLike] = None,
    *,
    K_to: Optional[npt.ArrayLike] = None,
    size: Optional[Sequence[int]] = None,
    progress: Progress = None,
    **options: Unpack[DepthOptions],
) -> Picture:
    """Draws a picture with depth as another camera sees it; see :class:`DepthImage` for the arguments.

    Args:
        pose_to: the new camera, 4x4; without it an option says what is drawn, such as ``to="shift:0.1,0,0"`` or ``stereo=0.06``.
        K_to: the new camera's matrix; that of the picture if not given.
        size: width and height of the new picture, px; those of the picture if not given.

    >>> import numpy as np
    >>> K = [[50, 0, 31.5], [0, 50, 23.5], [0, 0, 1]]
    >>> grey, wall = np.full((48, 64, 3), 128, np.uint8), np.full((48, 64), 2.0)
    >>> right = np.eye(4)
    >>> right[0, 3] = -0.2
    >>> picture = warp(grey, wall, K, np.eye(4), right)
    >>> [bool(picture[24, x, 3] > 0.5) for x in (10, 62)]
    [True, False]
    """
    image = DepthImage(colour, depth, K, pose_from, **options)
    if pose_to is not None:
        return image.render(progress=progress, **image.to(pose_to, K_to, size))
    if size is not None:
        return image.render(progress=progress, size=tuple(size))
    return image.render(progress=progress)


def warp_film(
    frames: Iterable[Any], depths: Iterable[Any], *, threads: Optional[int] = None, **options: Any
) -> Iterator[Picture]:
    """Draws the pictures of a film from other eyes, one after another, as they come: for depth of a network in the same process.

    Depth is made steady and holes are filled from earlier pictures, as ``resample warp3d`` does with a film. A picture is drawn
    when it is asked for, and none is kept: a film of any length takes the memory of one picture and its background.

    Args:
        frames: pictures, each as ``colour`` of :class:`DepthImage`; all of one size.
        depths: their depths, each (h, w) of any size: larger numbers nearer, in any unit, unless ``depth_kind=`` says otherwise.
        threads: how many draw; all processors if not given. The pictures do not depend on it.
        options: any option of ``resample warp3d``, such as ``stereo=0.06, layout="half-side-by-side"`` or
            ``to="shift:0.05,0,0"``. ``relative_range=(far, near)`` holds the numbers of all depths at fixed distances; without it the
            range of each picture counts, and ``steady`` (32) aligns it with those before.

    Yields:
        One picture for each frame; ``picture.to_srgb8()`` are its bytes. The shorter of the two ends the film.

    >>> import numpy as np
    >>> frames = [np.full((48, 64, 3), 99, np.uint8)] * 3
    >>> depths = [np.tile(np.linspace(1, 2, 64, dtype=np.float32), (48, 1))] * 3
    >>> [picture.shape for picture in warp_film(frames, depths, stereo=0.06)]
    [(48, 128, 4), (48, 128, 4), (48, 128, 4)]
    """
    film = _native.Film(options, threads)

    def pictures() -> Iterator[Picture]:
        for colour, depth in zip(frames, depths):
            (rgba, z, planes, stats), lines = film.next(_picture(colour, depth))
            say(lines, False, 3)
            yield Picture(rgba, z, planes, json.loads(stats), lines)

    return pictures()


def _picture(colour: Any, depth: Any) -> dict[str, Any]:
    """The arrays of a picture, as the compiled part takes them."""
    light = as_array(colour, "colour")
    if light.ndim == 2:
        light = light[:, :, None].repeat(3, axis=2)
    if light.ndim != 3 or light.shape[2] not in (3, 4) or light.size == 0:
        raise ValueError(f"colour: expected the shape (h, w), (h, w, 3) or (h, w, 4), got {light.shape}")
    if light.dtype.kind not in "uf" or light.dtype.itemsize > (2 if light.dtype.kind == "u" else 8):
        raise TypeError(f"colour: expected uint8, uint16 or floating point, got {light.dtype}")
    largest = {"u1": 255, "u2": 65535}.get(light.dtype.str[1:], 0)
    has_alpha = light.shape[2] == 4
    light = light.astype(np.float32)
    if not has_alpha:
        light = np.concatenate([light, np.full_like(light[..., :1], largest or 1.0)], axis=2)
    distance = as_array(depth, "depth")
    distance = distance.reshape([side for side in distance.shape if side != 1]) if distance.ndim == 3 else distance
    if distance.ndim != 2 or distance.size == 0:
        raise ValueError(f"depth: expected the shape (h, w), got {distance.shape}")
    if distance.dtype.kind not in "uif" or (distance.dtype.kind != "f" and distance.dtype.itemsize > 4):
        raise TypeError(f"depth: expected whole numbers of up to 32 bits or floating point, got {distance.dtype}")
    return {
        "colour": np.ascontiguousarray(light),
        "largest": largest,
        "has_alpha": has_alpha,
        "depth": np.ascontiguousarray(distance, dtype=np.float32),
        "largest_depth": None if distance.dtype.kind == "f" else _LARGEST[distance.dtype.str[1:]],
    }
