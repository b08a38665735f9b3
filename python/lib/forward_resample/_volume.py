"""Volumes: arrays of three axes, and whatever holds one."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import as_array, scalars
from ._mesh import arrays_of
from ._picture import Picture
from ._scene import Progress, Scene
from ._transfer import is_known, transfer_options

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import VolumeCall, VolumeOptions, VolumePictures, VolumeRender

#: Options that change the voxels themselves, or are refused for arrays; all others change how voxels are drawn.
_TAKEN_OVER = ("nan_as", "rescale_values", "max_memory", "dims", "type", "endian", "skip")

#: Options of which only one can say how values become colour and opacity.
_LOOKS = ("transfer", "transfer_space", "rescale_transfer", "window", "preset", "colormap")


@dataclass
class _Placed:
    """An array [z][y][x] and where it lies: axes of the world as columns, for x, y and z."""

    array: npt.NDArray[Any]
    spacing: Any = (1.0, 1.0, 1.0)
    origin: Any = (0.0, 0.0, 0.0)
    direction: Any = field(default_factory=lambda: np.eye(3))
    up: Optional[tuple[float, float, float]] = None
    space: Optional[str] = None

    def place(self) -> dict[str, Any]:
        axes = np.asarray(self.direction) * np.asarray(self.spacing, dtype=float)
        origin = np.asarray(self.origin, dtype=float)
        return {"axes": axes.T.tolist(), "origin": origin.tolist(), "up": self.up, "space": self.space}


class Volume(Scene):
    """A volume that is drawn again and again.

    Args:
        data: an array of the shape (z, y, x) of any scalar type, in either memory order; the name of a file that ``resample`` reads
            (NRRD, NIfTI, MetaImage, DICOM, OME-Zarr, ``.npy``, ``.vti``, TIFF), which may end in ``#PART``; an ``xarray.DataArray``
            or a ``Dataset`` with one array of three axes, a Zarr array, an image of SimpleITK or nibabel, a grid of PyVista, or a tensor. The voxels of an array are copied once.
        spacing: distance between voxels along x, y and z, world units.
        origin: world position of the first voxel.
        direction: 3x3, whose columns are the world's directions of the array's x, y and z axes, as SimpleITK and ITK have it.
        transfer: how values become colour and opacity: the name of a preset (``"ct-bone"``) or of a colour map of resample or Matplotlib;
            a ParaView JSON file or its content; ``(cmap, opacity)`` or ``(cmap, opacity, clim)`` as :func:`transfer_function`
            takes them. Without it the histogram decides.
        channel_axis: the axis of an array of four that counts channels: 0 of (c, z, y, x), 1 of (z, c, y, x). All are drawn, in the usual
            colours or those of ``channel=["0:green:100,900", "1:magenta"]``, which also chooses among them.
        mask: an array of the same shape; voxels where it is 0 are hidden.
        also: further arrays of the same shape, each with its look: ``[(array, "green")]``.
        meshes: meshes that stand in the volume, in its world, each with its colour and opacity: ``[(mesh, "red,0.5")]``; ``""`` keeps its own
            colours. A mesh is ``(vertices, faces)``, or one of trimesh or Open3D. Files are given as ``mesh=["stent.stl:red"]``.
        threads: how many draw; all processors if not given. The pictures do not depend on it.
        options: any other option of ``resample volsplat``, for all pictures.

    Raises:
        ValueError: ``data`` has not three axes, holds NaN (say ``nan_as=``), or an option has no such value.
        TypeError: there is no such option, or ``data`` holds no numbers.
        OSError: the file cannot be read.

    >>> import numpy as np
    >>> volume = Volume(np.arange(4096, dtype=np.int16).reshape(16, 16, 16), spacing=(1, 1, 2))
    >>> volume.render(orbit=(30, 20), size=(32, 24)).shape
    (24, 32, 4)
    >>> Volume(np.zeros((4, 5)))
    Traceback (most recent call last):
    ValueError: data: expected three axes (z, y, x), got the shape (4, 5)
    """

    if TYPE_CHECKING:

        def render(  # type: ignore[override]
            self, camera: Any = None, *, progress: Progress = None, **options: Unpack[VolumeRender]
        ) -> Picture: ...

        def pictures(  # type: ignore[override]
            self, *, progress: Progress = None, **options: Unpack[VolumePictures]
        ) -> Iterator[Picture]: ...

    def __init__(
        self,
        data: Any,
        spacing: Optional[npt.ArrayLike] = None,
        origin: Optional[npt.ArrayLike] = None,
        direction: Optional[npt.ArrayLike] = None,
        transfer: Any = None,
        *,
        channel_axis: Optional[int] = None,
        mask: Any = None,
        also: Any = (),
        meshes: Any = (),
        threads: Optional[int] = None,
        **options: Unpack[VolumeCall],
    ):
        self._options = {}
        given = {**options, **({} if transfer is None else {"transfer": transfer})}
        self._options = self._given(given)
        standing = [(arrays_of(mesh), str(look)) for mesh, look in meshes]
        if isinstance(data, (str, os.PathLike)):
            if direction is not None:
                raise ValueError("direction: a file has its own")
            if channel_axis is not None:
                raise ValueError("channel_axis: a file has its own; channel= chooses among its channels")
            placed = {"spacing": spacing, "origin": origin, "mask": mask}
            self._options.update({name: value for name, value in placed.items() if value is not None})
            if also:
                self._options["also"] = also
            self._native = _native.Scene.files("volsplat", [os.fspath(data)], threads, standing)
            # Misspelt options are refused here as those of arrays are.
            _native.check("volsplat", ["file"], self._options)
            return
        channels = [_placed(channel) for channel in _channels(data, channel_axis)]
        held = channels[0]
        if spacing is not None:
            held.spacing = _vector(spacing, "spacing")
        if origin is not None:
            held.origin = _vector(origin, "origin")
        if direction is not None:
            held.direction = _matrix(direction)
        _native.check("volsplat", ["array"], self._options)
        taken = {name: self._options[name] for name in _TAKEN_OVER if name in self._options}
        masked = None if mask is None else _voxels(mask, "mask")
        beside = [(_voxels(array, "also"), str(look)) for array, look in also]
        arrays = [channel.array for channel in channels]
        self._native = _native.Scene.volume(arrays, held.place(), taken, (masked, beside, standing), threads)

    def _given(self, given: Any) -> dict[str, Any]:
        own = super()._given(given)
        if "transfer" in own:
            own.update(transfer_options(own.pop("transfer")))
        if "colormap" in own and not is_known("colormap", own["colormap"]):
            # A map of Matplotlib, or its name; the error for a name that nobody knows lists both places.
            own.update(transfer_options(own.pop("colormap")))
        return own

    def _all(self, given: Any) -> dict[str, Any]:
        own = self._given(given)
        base = self._options
        if any(look in own for look in _LOOKS):
            base = {name: value for name, value in base.items() if name not in _LOOKS}
        return {**base, **own}

    def set_transfer(self, transfer: Any = None, **options: Any) -> None:
        """Has all later pictures drawn with another transfer function; the voxels are not copied again.

        Args:
            transfer: as of :class:`Volume`.
            options: others that belong to it, such as ``window=(40, 400)`` or ``opacity_scale=2``.
        """
        given = {**options, **({} if transfer is None else {"transfer": transfer})}
        merged = self._all(given)
        if not given:
            merged = {name: value for name, value in merged.items() if name not in _LOOKS}
        _native.check("volsplat", ["array"], merged)
        self._options = merged


def volsplat(
    array: Any,
    spacing: Optional[npt.ArrayLike] = None,
    origin: Optional[npt.ArrayLike] = None,
    direction: Optional[npt.ArrayLike] = None,
    transfer: Any = None,
    camera: Any = None,
    size: Optional[tuple[int, int]] = None,
    *,
    meshes: Any = (),
    progress: Progress = None,
    **options: Unpack[VolumeOptions],
) -> Picture:
    """Draws a volume once; see :class:`Volume` for the arguments that place it, and :meth:`Volume.render` for the others.

    >>> import numpy as np
    >>> ramp = np.linspace(0, 1, 4096, dtype=np.float32).reshape(16, 16, 16)
    >>> picture = volsplat(ramp, size=(40, 30), transfer="viridis", max_error="1/255")
    >>> picture.shape
    (30, 40, 4)
    >>> volsplat(ramp, slabb=1)
    Traceback (most recent call last):
    TypeError: volsplat has no option 'slabb'; did you mean 'slab'?
    """
    call: dict[str, Any] = {**options}
    if size is not None:
        call["size"] = size
    return Volume(array, spacing, origin, direction, transfer, meshes=meshes, **call).render(camera, progress=progress)


def _vector(value: npt.ArrayLike, name: str) -> npt.NDArray[np.float64]:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,):
        raise ValueError(f"{name}: expected three numbers (x, y, z), got the shape {vector.shape}")
    if name == "spacing" and not (vector > 0).all():
        raise ValueError(f"spacing: expected numbers above 0, got {vector.tolist()}")
    return vector


def _matrix(value: npt.ArrayLike) -> npt.NDArray[np.float64]:
    matrix = np.asarray(value, dtype=float)
    if matrix.size != 9:
        raise ValueError(f"direction: expected 3x3 numbers, got the shape {matrix.shape}")
    return matrix.reshape(3, 3)


def _voxels(value: Any, name: str) -> npt.NDArray[Any]:
    array = scalars(as_array(value, name), name)
    if array.ndim != 3:
        advice = "; channel_axis= names the axis of channels" if array.ndim == 4 and name == "data" else ""
        raise ValueError(f"{name}: expected three axes (z, y, x), got the shape {array.shape}{advice}")
    if array.size == 0:
        raise ValueError(f"{name}: is empty, its shape is {array.shape}")
    return array


def _channels(data: Any, axis: Optional[int]) -> list[Any]:
    """The channels of data, one after the other; the data where it has no axis of them."""
    if axis is None:
        return [data]
    if type(data).__module__.split(".")[0] == "zarr":
        data = data[...]
    is_labelled = hasattr(data, "coords") and hasattr(data, "dims")
    array = data if is_labelled else as_array(data, "data")
    if array.ndim != 4 or not -4 <= axis < 4:
        raise ValueError(f"channel_axis={axis}: expected four axes and one of them, got the shape {tuple(array.shape)}")
    count = array.shape[axis]
    if count == 0:
        raise ValueError(f"data: is empty, its shape is {tuple(array.shape)}")
    if is_labelled:
        name = data.dims[axis]
        return [data.isel({name: number}) for number in range(count)]
    return list(np.moveaxis(array, axis, 0))


def _placed(data: Any) -> _Placed:
    """The array of whatever holds one, and where it lies."""
    if hasattr(data, "GetDirection") and hasattr(data, "GetSpacing"):
        return _of_simple_itk(data)
    if hasattr(data, "affine") and hasattr(data, "dataobj"):
        return _of_nibabel(data)
    if hasattr(data, "data_vars"):
        data = _only_array(data)
    if hasattr(data, "coords") and hasattr(data, "dims"):
        return _of_xarray(data)
    if hasattr(data, "active_scalars") and hasattr(data, "dimensions"):
        return _of_pyvista(data)
    if type(data).__module__.split(".")[0] == "zarr":
        if not hasattr(data, "chunks"):
            raise ValueError("data: a group of Zarr: give one of its arrays, or the path of the image")
        data = data[...]
    return _Placed(_voxels(data, "data"))


def _of_simple_itk(image: Any) -> _Placed:
    import SimpleITK

    array = SimpleITK.GetArrayViewFromImage(image)
    direction = _matrix(image.GetDirection())
    lps = "left-posterior-superior"
    return _Placed(_voxels(array, "data"), image.GetSpacing(), image.GetOrigin(), direction, (0.0, 0.0, 1.0), lps)


def _of_nibabel(image: Any) -> _Placed:
    affine = np.asarray(image.affine, dtype=float)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    direction = affine[:3, :3] / spacing
    ras = "right-anterior-superior"
    # Its arrays are [x][y][z].
    array = _voxels(np.asarray(image.dataobj).T, "data")
    return _Placed(array, spacing, affine[:3, 3], direction, (0.0, 0.0, 1.0), ras)


def _of_pyvista(grid: Any) -> _Placed:
    x, y, z = grid.dimensions
    scalars = np.asarray(grid.active_scalars)
    if scalars.shape != (x * y * z,):
        raise ValueError(f"data: expected one number for each of {x}x{y}x{z} points, got the shape {scalars.shape}")
    direction = getattr(grid, "direction_matrix", np.eye(3))
    return _Placed(_voxels(scalars.reshape(z, y, x), "data"), grid.spacing, grid.origin, np.asarray(direction))


def _only_array(data: Any) -> Any:
    """The array of an xarray.Dataset that holds one; such a set is no array itself."""
    names = [name for name in data.data_vars if data[name].ndim == 3]
    if len(names) != 1:
        found = ", ".join(f"{name!r} {tuple(data[name].shape)}" for name in data.data_vars) or "nothing"
        raise ValueError(f"data: a Dataset that holds {found}: give one array of three axes, such as dataset[NAME]")
    return data[names[0]]


def _of_xarray(data: Any) -> _Placed:
    names = {str(name).lower(): name for name in data.dims}
    if {"x", "y", "z"} <= names.keys() and data.ndim == 3:
        data = data.transpose(names["z"], names["y"], names["x"])
    array = _voxels(data.values, "data")
    spacing, origin, signs = [], [], []
    for name in reversed(data.dims):
        first, step = _steps(data, name)
        origin.append(first)
        spacing.append(abs(step))
        signs.append(np.sign(step))
    return _Placed(array, spacing, origin, np.diag(signs))


def _steps(data: Any, name: Any) -> tuple[float, float]:
    """First place and step along an axis of an xarray; 0 and 1 where it has no numbers."""
    if name not in data.coords or data.coords[name].dtype.kind not in "uif" or data.coords[name].ndim != 1:
        return 0.0, 1.0
    places = np.asarray(data.coords[name].values, dtype=float)
    if len(places) < 2:
        return float(places[0]), 1.0
    steps = np.diff(places)
    step = float(steps.mean())
    if step == 0.0 or not np.allclose(steps, step, rtol=1e-3, atol=0.0):
        raise ValueError(f"data: the coordinate '{name}' is not evenly spaced: interpolate to an even grid first")
    return float(places[0]), step
