"""Arrays of every type and order, and of other packages, give the same pictures."""

import numpy as np
import pytest

import forward_resample as fr

SIZE = {"size": (48, 40)}


@pytest.fixture(scope="module")
def codes(blob):
    return np.round(blob / blob.max() * 100).astype(np.uint8)


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8", ">i2", ">f8", "g"])
def test_types(codes, dtype):
    expected = fr.volsplat(codes, **SIZE)
    picture = fr.volsplat(codes.astype(dtype), **SIZE)
    # 8-bit histograms have a bin a value, so that only those of the same kind agree to the bit.
    assert np.allclose(picture, expected, atol=0.02), np.abs(picture - expected).max()
    assert picture.max() > 0.1


def test_bool(codes):
    mask = codes > 50
    assert np.array_equal(fr.volsplat(mask, **SIZE), fr.volsplat(mask.astype(np.uint8), **SIZE))


@pytest.mark.parametrize("dtype", ["u1", "i2", "u8", "f4", "f8"])
def test_orders_and_strides(codes, dtype):
    array = codes.astype(dtype)
    expected = fr.volsplat(array, **SIZE)
    wide = np.zeros((array.shape[0], 2 * array.shape[1], 3 * array.shape[2]), dtype)
    wide[:, ::2, ::3] = array
    others = {
        "fortran": np.asfortranarray(array),
        "strided": wide[:, ::2, ::3],
        "mirrored twice": np.ascontiguousarray(array[::-1, :, ::-1])[::-1, :, ::-1],
        "axes swapped": np.ascontiguousarray(array.swapaxes(0, 1)).swapaxes(0, 1),
        "read-only": array.copy(),
    }
    others["read-only"].flags.writeable = False
    for name, other in others.items():
        assert np.array_equal(fr.volsplat(other, **SIZE), expected), name


def test_the_first_axis_is_z():
    array = np.zeros((3, 5, 9), np.float32)
    array[1, 2, 1:8] = 1.0
    # A bar along x, seen along z: wide.
    picture = fr.volsplat(array, orbit=(0, 0), **SIZE)
    rows, columns = np.nonzero(picture[..., 3] > 0.1)
    assert np.ptp(columns) > 2 * np.ptp(rows)


def test_a_change_of_the_array_changes_nothing(codes):
    array = codes.copy()
    volume = fr.Volume(array, **SIZE)
    expected = volume.render()
    array[:] = 0
    volume.set_transfer(window=(50, 50))
    assert np.array_equal(volume.render(), fr.volsplat(codes, window=(50, 50), **SIZE))
    assert expected.max() > 0.1


def test_direction(codes):
    turned = fr.volsplat(codes, direction=np.diag([-1, 1, 1]), orbit=(0, 0), **SIZE)
    assert not np.array_equal(turned, fr.volsplat(codes, orbit=(0, 0), **SIZE))
    mirrored = fr.volsplat(codes[:, :, ::-1], orbit=(0, 0), **SIZE)
    assert np.allclose(turned, mirrored, atol=2e-3)


def test_mask_and_further_volumes(codes, tmp_path):
    mask = (np.indices(codes.shape).sum(axis=0) > 40).astype(np.uint8)
    other = np.roll(codes, 9, axis=2)
    for name, array in {"codes": codes, "mask": mask, "other": other}.items():
        np.save(tmp_path / f"{name}.npy", array)
    of_files = fr.Volume(tmp_path / "codes.npy", mask=tmp_path / "mask.npy", also=[(str(tmp_path / "other.npy"), "green")])
    of_arrays = fr.Volume(codes, mask=mask, also=[(other, "green")])
    assert np.array_equal(of_files.render(**SIZE), of_arrays.render(**SIZE))


def test_nan(blob):
    array = blob.copy()
    array[2, 3, 4] = np.nan
    with pytest.raises(ValueError, match=r"voxel \(4,3,2\) is NaN"):
        fr.volsplat(array, **SIZE)
    clean = np.nan_to_num(array, nan=0.25)
    assert np.array_equal(fr.volsplat(array, nan_as=0.25, **SIZE), fr.volsplat(clean, **SIZE))


def test_simple_itk(codes, tmp_path):
    itk = pytest.importorskip("SimpleITK")
    image = itk.GetImageFromArray(codes)
    image.SetSpacing((0.5, 0.75, 2.0))
    image.SetOrigin((1.0, 2.0, 3.0))
    image.SetDirection((0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0))
    itk.WriteImage(image, str(tmp_path / "a.nrrd"))
    of_file = fr.Volume(tmp_path / "a.nrrd", up="z").render(**SIZE)
    assert np.allclose(fr.Volume(image, up="z").render(**SIZE), of_file, atol=1e-5)


def test_nibabel(codes, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    affine = np.array([[-0.5, 0, 0, 10], [0, 0.75, 0.1, -20], [0, 0.1, 2, 30], [0, 0, 0, 1.0]])
    image = nibabel.Nifti1Image(codes.T, affine)
    nibabel.save(image, tmp_path / "a.nii")
    loaded = nibabel.load(tmp_path / "a.nii")
    assert np.allclose(fr.volsplat(loaded, **SIZE), fr.Volume(tmp_path / "a.nii").render(**SIZE), atol=1e-5)


def test_xarray(codes):
    xarray = pytest.importorskip("xarray")
    z, y, x = codes.shape
    places = {"x": 1.0 + 0.5 * np.arange(x), "y": 2.0 - 0.75 * np.arange(y), "z": 2.0 * np.arange(z)}
    data = xarray.DataArray(codes, dims=("z", "y", "x"), coords=places)
    place = {"spacing": (0.5, 0.75, 2.0), "origin": (1.0, 2.0, 0.0), "direction": np.diag([1, -1, 1])}
    expected = fr.volsplat(codes, **place, **SIZE)
    assert np.array_equal(fr.volsplat(data, **SIZE), expected)
    assert np.array_equal(fr.volsplat(data.transpose("x", "z", "y"), **SIZE), expected)
    places["x"] = places["x"] ** 2
    with pytest.raises(ValueError, match="'x' is not evenly spaced"):
        fr.volsplat(xarray.DataArray(codes, dims=("z", "y", "x"), coords=places))


def test_xarray_datasets(codes):
    xarray = pytest.importorskip("xarray")
    temperature = xarray.DataArray(codes, dims=("z", "y", "x"))
    one = xarray.Dataset({"T": temperature, "level": ("z", np.arange(codes.shape[0]))})
    assert np.array_equal(fr.volsplat(one, **SIZE), fr.volsplat(codes, **SIZE))
    for several in (one.assign(p=2 * temperature), xarray.Dataset()):
        with pytest.raises(ValueError, match="Dataset .* dataset"):
            fr.volsplat(several, **SIZE)


def test_zarr(codes, tmp_path):
    zarr = pytest.importorskip("zarr")
    array = zarr.create_array(str(tmp_path / "a.zarr"), shape=codes.shape, chunks=(8, 16, 16), dtype=codes.dtype)
    array[...] = codes
    assert np.array_equal(fr.volsplat(array, **SIZE), fr.volsplat(codes, **SIZE))


def test_zarr_filters(codes, tmp_path):
    zarr = pytest.importorskip("zarr")
    numcodecs = pytest.importorskip("numcodecs.zarr3")
    path = tmp_path / "a.zarr"
    words = {"shape": codes.shape, "chunks": (8, 16, 16), "dtype": codes.dtype}
    array = zarr.create_array(str(path), filters=[numcodecs.Delta(dtype=codes.dtype.str)], **words)
    array[...] = codes
    assert np.array_equal(fr.Volume(path).render(**SIZE), fr.volsplat(codes, **SIZE))


def test_dlpack(codes):
    class Tensor:
        """What an array of another package is, seen from here."""

        def __dlpack__(self, **words):
            return codes.__dlpack__(**words)

        def __dlpack_device__(self):
            return codes.__dlpack_device__()

    assert np.array_equal(fr.volsplat(Tensor(), **SIZE), fr.volsplat(codes, **SIZE))


def test_torch(codes):
    torch = pytest.importorskip("torch")
    tensor = torch.from_numpy(codes.astype(np.float32)).requires_grad_()
    assert np.array_equal(fr.volsplat(tensor, **SIZE), fr.volsplat(codes.astype(np.float32), **SIZE))


def test_a_mesh_casts_shadows():
    """A square above a larger one takes light from it; a ground below both takes its shadow."""
    square = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], np.float32)
    vertices = np.concatenate([square * 2, square + [0, 1, 0]])
    faces = np.array([[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6]])
    lit = fr.texmap(vertices, faces, shade="pbr", orbit=(20, 40), **SIZE)
    shadowed = fr.texmap(vertices, faces, shadows=True, orbit=(20, 40), **SIZE)
    assert np.array_equal(lit[..., 3], shadowed[..., 3])
    assert shadowed[..., :3].sum() < 0.98 * lit[..., :3].sum()
    ground = fr.texmap(vertices, faces, shadows="ground", orbit=(20, 40), **SIZE)
    beside = (lit[..., 3] == 0) & (ground[..., 3] > 0)
    assert beside.any() and not ground[beside][:, :3].any()


def test_trimesh():
    trimesh = pytest.importorskip("trimesh")
    from PIL import Image

    box = trimesh.creation.box()
    expected = fr.texmap(box.vertices, box.faces, **SIZE)
    assert np.array_equal(fr.texmap(box, **SIZE), expected)
    uv = np.asarray(box.vertices)[:, :2] + 0.5
    checker = (np.indices((16, 16)).sum(axis=0) % 2 * 255).astype(np.uint8)
    box.visual = trimesh.visual.TextureVisuals(uv=uv, image=Image.fromarray(checker))
    expected = fr.texmap(box.vertices, box.faces, uv, checker, **SIZE)
    assert np.array_equal(fr.texmap(box, **SIZE), expected)
    of_corners = fr.texmap(box.vertices, box.faces, uv[box.faces].reshape(-1, 2), checker, **SIZE)
    assert np.allclose(of_corners, expected, atol=0.05)


def test_linear_textures():
    vertices, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]]
    codes = np.full((4, 4, 3), 188, np.uint8)
    eight = fr.texmap(vertices, faces, uv, codes, shade="unlit", **SIZE)
    sixteen = fr.texmap(vertices, faces, uv, codes.astype(np.uint16) * 257, shade="unlit", **SIZE)
    linear = fr.texmap(vertices, faces, uv, np.full((4, 4, 3), 0.5029), shade="unlit", **SIZE)
    assert np.allclose(eight, sixteen, atol=1e-4) and np.allclose(eight, linear, atol=1e-4)


def test_depth_types():
    K = [[50, 0, 31.5], [0, 50, 23.5], [0, 0, 1]]
    grey = np.full((48, 64), 128, np.uint8)
    metres = np.full((48, 64), 2.0)
    metres[10:30, 20:40] = 1.0
    shift = {"to": "shift:0.1,0,0"}
    expected = fr.warp(grey, metres, K, **shift)
    for dtype in ("u2", "i2", "i4", "f4", "f8"):
        codes = (metres * 1000).astype(dtype)
        assert np.allclose(fr.warp(grey, codes, K, depth_scale=0.001, **shift), expected, atol=1e-5), dtype
    linear = np.full((48, 64, 3), float(fr.warp(grey, metres, K, to="shift:0,0,0")[20, 30, 0]))
    assert np.allclose(fr.warp(linear, np.asfortranarray(metres)[:, :, None], K, **shift), expected, atol=1e-5)
    disparity = 50 * 0.1 / metres
    found = fr.warp(grey, disparity, K, depth_kind="disparity", baseline=0.1, **shift)
    assert np.allclose(found, expected, atol=1e-4)


def test_channels(codes):
    """An axis of channels is drawn as its channels are, wherever it stands."""
    channels = np.stack([codes, codes[::-1], codes // 2]).astype(np.uint8)
    size = {"size": (64, 48), "orbit": (30, 20)}
    first = fr.volsplat(channels, channel_axis=0, **size)
    usual = fr.volsplat(channels, channel_axis=0, channel=["0:#00ffff", "1:#ff00ff", "2:#ffff00"], **size)
    assert first.max() > 0.5
    np.testing.assert_array_equal(first, usual)
    for axis, moved in [(1, np.moveaxis(channels, 0, 1)), (-1, np.moveaxis(channels, 0, -1))]:
        np.testing.assert_array_equal(fr.volsplat(moved, channel_axis=axis, **size), first)
    # The first channel has a colour as the others do, and one may be left out.
    green = fr.volsplat(channels, channel_axis=0, channel="0:green:0,100", **size)
    assert green[..., 1].max() > 0.5 and green[..., 0].max() == 0
    assert fr.volsplat(codes, channel="0:green", **size)[..., 0].max() == 0
    with pytest.raises(ValueError, match="channel_axis= names the axis of channels"):
        fr.volsplat(channels)
    with pytest.raises(ValueError, match="expected four axes"):
        fr.volsplat(codes, channel_axis=0)
    with pytest.raises(ValueError, match="from 0 to 2"):
        fr.volsplat(channels, channel_axis=0, channel="3:red")


def test_meshes_stand_in_a_volume(codes, tmp_path):
    nz, ny, nx = codes.shape
    pane = ([[0, 0, 2 * nz], [nx, 0, 2 * nz], [nx, ny, 2 * nz], [0, ny, 2 * nz]], [[0, 1, 2], [0, 2, 3]])
    view = {"orbit": (0, 0), "background": "black", **SIZE}
    bare = fr.volsplat(codes, **view)
    solid = fr.volsplat(codes, meshes=[(pane, "red")], **view)
    assert solid[20, 24, 0] > 0.5 and solid[20, 24, 1] == 0.0
    path = tmp_path / "pane.obj"
    lines = [f"v {x} {y} {z}" for x, y, z in pane[0]] + ["f 1 2 3", "f 1 3 4"]
    path.write_text("\n".join(lines) + "\n")
    of_file = fr.volsplat(codes, mesh=[f"{path}:red"], **view)
    assert np.allclose(solid, of_file, atol=1e-6)
    np.save(tmp_path / "codes.npy", codes)
    volume = fr.Volume(tmp_path / "codes.npy", meshes=[(pane, "red,0.25")])
    veiled = volume.render(**view)
    assert not np.array_equal(veiled, bare) and not np.array_equal(veiled, solid)
    with pytest.raises(ValueError, match="meshes: .*expected #rrggbb"):
        fr.volsplat(codes, meshes=[(pane, "rot")], **view)
    with pytest.raises(TypeError, match="expected an array with faces"):
        fr.volsplat(codes, meshes=[("pane", "red")], **view)
