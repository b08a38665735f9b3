"""Files of h5py, netCDF4 and others, against the arrays that were put into them."""

from pathlib import Path

import numpy as np
import pytest

import forward_resample as fr

SIZE = {"size": (40, 30), "preset": "ct"}


@pytest.fixture
def codes():
    z, y, x = np.mgrid[0:12, 0:16, 0:20]
    return (1000 * np.exp(-((z - 6) ** 2 / 10 + (y - 8) ** 2 / 20 + (x - 9) ** 2 / 30))).astype("int16")


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"dtype": ">i2"},
        {"dtype": "f8"},
        {"chunks": (4, 8, 8), "compression": "gzip", "shuffle": True},
        {"chunks": (4, 8, 8), "compression": "lzf"},
        {"chunks": (4, 8, 8), "compression": "szip"},
        {"chunks": (4, 8, 8), "fletcher32": True},
        {"chunks": (5, 7, 9), "scaleoffset": 0},
    ],
)
@pytest.mark.parametrize("version", ["earliest", "latest"])
def test_h5py(codes, tmp_path, options, version):
    h5py = pytest.importorskip("h5py")
    if options.get("compression") == "szip" and not h5py.h5z.filter_avail(h5py.h5z.FILTER_SZIP):
        pytest.skip("this h5py has no SZIP")
    with h5py.File(tmp_path / "a.h5", "w", libver=version) as file:
        array = file.create_dataset("inner/volume", data=codes, **options)
        array.attrs["element_size_um"] = [2.0, 1.0, 0.5]
        file["small"] = np.zeros((2, 2, 2))
    expected = fr.volsplat(codes, spacing=(0.5, 1.0, 2.0), **SIZE)
    assert np.array_equal(fr.volsplat(tmp_path / "a.h5", **SIZE), expected)


def test_masks_and_user_blocks(codes, tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        file["mask"] = codes > 300
    expected = fr.volsplat((codes > 300).astype("uint8"), size=(40, 30))
    assert np.array_equal(fr.volsplat(tmp_path / "a.mat", size=(40, 30)), expected)


@pytest.mark.parametrize("kind", ["NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA", "NETCDF4"])
def test_netcdf(codes, tmp_path, kind):
    netcdf = pytest.importorskip("netCDF4")
    with netcdf.Dataset(tmp_path / "a.nc", "w", format=kind) as file:
        for name, size, step in zip(("time", "z", "y", "x"), (None, *codes.shape), (1.0, 2.0, -1.0, 0.5), strict=True):
            file.createDimension(name, size)
            if size:
                file.createVariable(name, "f4", (name,))[:] = step * np.arange(size)
        array = file.createVariable("T", "f4", ("time", "z", "y", "x"), fill_value=-999.0)
        film = np.stack([codes, 2.0 * codes]).astype("f4")
        film[0, 3, 4, 5] = np.nan
        array[:] = np.ma.masked_invalid(film)
    place = {"spacing": (0.5, 1.0, 2.0), "direction": np.diag([1, -1, 1])}
    expected = film[0].copy()
    expected[3, 4, 5] = np.nanmin(expected)
    drawn = fr.volsplat(f"{tmp_path / 'a.nc'}#time=0", **SIZE)
    assert np.array_equal(drawn, fr.volsplat(expected, **place, **SIZE))


def test_xarray_writes_what_is_read(codes, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("netCDF4")
    data = xarray.DataArray(codes, dims=("z", "y", "x"), coords={"x": 0.25 * np.arange(codes.shape[2])}, name="T")
    data.to_netcdf(tmp_path / "a.nc")
    assert np.array_equal(fr.volsplat(tmp_path / "a.nc", **SIZE), fr.volsplat(data, **SIZE))


def test_minc_of_nibabel(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    folder = Path(nibabel.__file__).parent / "tests" / "data"
    files = ["tiny.mnc", "minc1_1_scale.mnc", "minc2_1_scale.mnc", "small.mnc", "minc2_baddim.mnc"]
    found = [folder / name for name in files if (folder / name).is_file()]
    if not found:
        pytest.skip("this nibabel has no files of MINC")
    for path in found:
        image = nibabel.load(path)
        # Its arrays are [z][y][x] here, and its axes as well.
        real = np.asarray(image.dataobj, dtype="f4")
        twin = nibabel.Nifti1Image(real.T, image.affine[:, [2, 1, 0, 3]])
        look = {"size": (40, 30), "colormap": "viridis"}
        assert np.allclose(fr.volsplat(path, **look), fr.volsplat(twin, **look), atol=1e-3), path.name
