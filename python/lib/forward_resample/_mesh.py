"""Textured meshes: vertices, faces, and what lies on them."""

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

    from ._options import MeshCall, MeshOptions, MeshPictures, MeshRender

#: Options that are read with the mesh; all others change how it is drawn.
_TAKEN_OVER = ("environment", "texture", "max_memory")


class Mesh(Scene):
    """A mesh that is drawn again and again.

    Args:
        vertices: (n, 3) world positions; or the name of a file (glTF, OBJ, PLY, STL), which may end in ``#SCENE``; or a mesh of trimesh
            or Open3D, which has all the rest.
        faces: (m, 3) indices of vertices, counter-clockwise seen from the front. Both sides are seen.
        uv: texture coordinates, (n, 2) for the vertices or (3 m, 2) for the corners of the faces; (0, 0) is the bottom left of the
            texture, as in OBJ.
        texture: (h, w), (h, w, 3) or (h, w, 4): uint8 or uint16 in sRGB, or linear light in floating point; a picture of Pillow; or the
            name of a file.
        normals: (n, 3); without them faces are flat.
        colours: (n, 3) or (n, 4), uint8 in sRGB, or parts of 1.
        threads: how many draw; all processors if not given. The pictures do not depend on it.
        options: any option of ``resample texmap``, for all pictures.

    Raises:
        ValueError: an array has another shape, a face names a vertex that is not there, an option has no such value.
        TypeError: there is no such option.
        OSError: the file cannot be read.

    >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], colours=[[255, 0, 0]] * 3)
    >>> mesh.render(size=(32, 24)).shape
    (24, 32, 4)
    >>> Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]])
    Traceback (most recent call last):
    ValueError: faces: a face has the vertex 3, but there are 3
    """

    if TYPE_CHECKING:

        def render(  # type: ignore[override]
            self, camera: Any = None, *, progress: Progress = None, **options: Unpack[MeshRender]
        ) -> Picture: ...

        def pictures(  # type: ignore[override]
            self, *, progress: Progress = None, **options: Unpack[MeshPictures]
        ) -> Iterator[Picture]: ...

    def __init__(
        self,
        vertices: Any,
        faces: Any = None,
        uv: Any = None,
        texture: Any = None,
        *,
        normals: Any = None,
        colours: Any = None,
        threads: Optional[int] = None,
        **options: Unpack[MeshCall],
    ):
        self._options = self._given(options)
        if isinstance(texture, (str, os.PathLike)):
            self._options["texture"], texture = os.fspath(texture), None
        _native.check("texmap", ["mesh"], self._options)
        if isinstance(vertices, (str, os.PathLike)):
            if any(part is not None for part in (faces, uv, texture, normals, colours)):
                raise ValueError("vertices: is a file, which has faces, uv and texture of its own")
            self._native = _native.Scene.files("texmap", [os.fspath(vertices)], threads)
            return
        if faces is None:
            vertices, faces, uv, texture, normals, colours = _parts(vertices)
        taken = {name: self._options[name] for name in _TAKEN_OVER if name in self._options}
        arrays = _arrays(vertices, faces, uv, normals, colours)
        arrays.update(_texture(texture))
        if uv is None and (texture is not None or "texture" in taken):
            raise ValueError("texture: needs texture coordinates, uv")
        self._native = _native.Scene.mesh(arrays, taken, threads)


def texmap(
    vertices: Any,
    faces: Any = None,
    uv: Any = None,
    texture: Any = None,
    camera: Any = None,
    size: Optional[tuple[int, int]] = None,
    *,
    normals: Any = None,
    colours: Any = None,
    progress: Progress = None,
    **options: Unpack[MeshOptions],
) -> Picture:
    """Draws a mesh once; see :class:`Mesh` for what it is made of, and :meth:`Mesh.render` for the other arguments.

    >>> quad = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> checker = np.kron([[0, 1] * 4, [1, 0] * 4] * 4, np.full((8, 8), 255)).astype(np.uint8)
    >>> picture = texmap(quad, [[0, 1, 2], [0, 2, 3]], [[0, 0], [1, 0], [1, 1], [0, 1]], checker, size=(64, 64))
    >>> bool(picture[32, 32, 3] == 1)
    True
    """
    call: dict[str, Any] = {**options}
    if size is not None:
        call["size"] = size
    mesh = Mesh(vertices, faces, uv, texture, normals=normals, colours=colours, **call)
    return mesh.render(camera, progress=progress)


def arrays_of(mesh: Any) -> dict[str, Any]:
    """The arrays of ``(vertices, faces)``, or of a mesh of trimesh or Open3D."""
    parts = (*mesh, None, None, None, None) if isinstance(mesh, tuple) else _parts(mesh)
    vertices, faces, uv, texture, normals, colours = parts
    return {**_arrays(vertices, faces, uv, normals, colours), **_texture(texture)}


def _arrays(vertices: Any, faces: Any, uv: Any, normals: Any, colours: Any) -> dict[str, Any]:
    places = table(vertices, "vertices", 3, np.float64)
    corners = as_array(faces, "faces")
    if corners.dtype.kind not in "ui":
        raise TypeError(f"faces: expected whole numbers, got {corners.dtype}")
    corners = table(corners, "faces", 3, np.int64)
    if corners.size and (corners.min() < 0 or corners.max() >= len(places)):
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise ValueError(f"faces: a face has the vertex {wrong}, but there are {len(places)}")
    arrays: dict[str, Any] = {
        "uv": None if uv is None else table(uv, "uv", 2, np.float64),
        "normals": None if normals is None else table(normals, "normals", 3, np.float64),
        "colours": None if colours is None else _codes(as_array(colours, "colours"), "colours"),
    }
    if arrays["uv"] is not None and len(arrays["uv"]) == 3 * len(corners) != len(places):
        # Corners of their own.
        of_corner = corners.reshape(-1)
        places, corners = places[of_corner], np.arange(len(of_corner)).reshape(-1, 3)
        for name in ("normals", "colours"):
            arrays[name] = None if arrays[name] is None else arrays[name][of_corner]
    for name, array in arrays.items():
        if array is not None and len(array) != len(places):
            raise ValueError(f"{name}: expected {len(places)} rows, one for each vertex, got {len(array)}")
    return {"vertices": places, "faces": corners.astype(np.uint32), **arrays}


def _codes(array: npt.NDArray[Any], name: str) -> npt.NDArray[np.uint8]:
    """Colours of rows or pixels as 8 bits of sRGB, with alpha."""
    if array.dtype.kind == "f":
        array = np.round(np.clip(array, 0.0, 1.0) * 255.0)
    if array.ndim < 2 or array.shape[-1] not in (3, 4):
        raise ValueError(f"{name}: expected three or four numbers for each, got the shape {array.shape}")
    array = array.astype(np.uint8)
    if array.shape[-1] == 3:
        array = np.concatenate([array, np.full_like(array[..., :1], 255)], axis=-1)
    return np.ascontiguousarray(array)


def _texture(texture: Any) -> dict[str, Any]:
    nothing = {"texture": None, "texture_linear": None}
    if texture is None:
        return nothing
    if hasattr(texture, "convert") and hasattr(texture, "getbands"):
        texture = texture.convert("RGBA")
    array = as_array(texture, "texture")
    if array.ndim == 2:
        array = array[:, :, None].repeat(3, axis=2)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or array.size == 0:
        raise ValueError(f"texture: expected the shape (h, w), (h, w, 3) or (h, w, 4), got {array.shape}")
    if array.dtype == np.uint8:
        return {**nothing, "texture": _codes(array, "texture")}
    if array.dtype == np.uint16:
        parts = array / np.float32(65535.0)
        light = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        light[..., 3:] = parts[..., 3:]
    elif array.dtype.kind == "f":
        light = array
    else:
        raise TypeError(f"texture: expected uint8, uint16 or floating point, got {array.dtype}")
    light = light.astype(np.float32)
    if light.shape[2] == 3:
        light = np.concatenate([light, np.ones_like(light[..., :1])], axis=2)
    return {**nothing, "texture_linear": np.ascontiguousarray(light)}


def _parts(mesh: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    """Vertices, faces, uv, texture, normals and colours of a mesh of another package."""
    if hasattr(mesh, "triangle_uvs") and hasattr(mesh, "triangles"):
        return _of_open3d(mesh)
    if hasattr(mesh, "geometry") and hasattr(mesh, "dump"):
        raise ValueError("vertices: a scene of trimesh: give one mesh of it, such as scene.to_geometry()")
    if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
        kind = type(mesh).__name__
        raise TypeError(f"vertices: expected an array with faces, a file, or a mesh of trimesh or Open3D, got {kind}")
    visual: Any = getattr(mesh, "visual", None)
    uv = texture = colours = None
    if getattr(visual, "kind", None) == "texture":
        uv = visual.uv
        material = visual.material
        texture = getattr(material, "baseColorTexture", None)
        texture = getattr(material, "image", None) if texture is None else texture
        uv = None if texture is None else uv
    elif getattr(visual, "kind", None) == "vertex":
        colours = visual.vertex_colors
    return mesh.vertices, mesh.faces, uv, texture, None, colours


def _of_open3d(mesh: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    def given(value: Any) -> Any:
        return np.asarray(value) if len(value) else None

    textures = getattr(mesh, "textures", [])
    texture = np.asarray(textures[0]) if len(textures) else None
    # It keeps textures as they are drawn by OpenGL: their first row is the bottom one.
    uv = given(mesh.triangle_uvs) if texture is not None else None
    return (
        np.asarray(mesh.vertices),
        np.asarray(mesh.triangles),
        uv,
        texture,
        given(mesh.vertex_normals),
        given(mesh.vertex_colors),
    )
