"""What a picture can do: be shown, saved, sent; and transfer functions of other packages."""

import io
import json
import pickle

import numpy as np
import pytest
from conftest import read_png

import forward_resample as fr

RAMP = np.arange(4096, dtype=np.uint16).reshape(16, 16, 16)


@pytest.fixture(scope="module")
def picture():
    return fr.volsplat(RAMP, size=(30, 20), layers="first-hit")


def test_a_picture_is_an_array(picture):
    assert isinstance(picture, np.ndarray)
    assert picture.shape == (20, 30, 4) and picture.dtype == np.float32 and picture.flags.c_contiguous
    assert (picture[..., :3] <= picture[..., 3:] + 1e-6).all(), "premultiplied"
    assert (2 * picture)[0, 0, 0] == 2 * picture[0, 0, 0]


def test_srgb8_is_the_png(picture, tmp_path):
    picture.save(tmp_path / "a.png")
    assert np.array_equal(read_png(tmp_path / "a.png"), picture.to_srgb8())
    assert np.array_equal(read_png(io.BytesIO(picture._repr_png_())), picture.to_srgb8())
    assert picture[..., 0]._repr_png_() is None


def test_pictures_can_be_sent(picture):
    again = pickle.loads(pickle.dumps(picture))
    assert np.array_equal(again, picture) and again.stats == picture.stats
    assert again.planes.keys() == picture.planes.keys()
    assert picture[:5].planes == {}, "planes belong to the whole"


def test_matter_takes_light(picture):
    occluded = fr.volsplat(RAMP, size=(30, 20), occlusion=True)
    near = fr.volsplat(RAMP, size=(30, 20), occlusion=2.0)
    shadowed = fr.volsplat(RAMP, size=(30, 20), light=(1, 2, 3), shadows=True, light_size=10)
    for other in (occluded, near, shadowed):
        assert np.allclose(other[..., 3], picture[..., 3], atol=1e-5), "opacity is the same"
        assert not np.allclose(other, picture, atol=0.01)
    assert not np.allclose(occluded, near, atol=0.003)


def test_stats_are_those_of_the_command_line(picture):
    assert picture.stats["wall_ms"] > 0
    planned = fr.volsplat(RAMP, size=(30, 20), max_time="1s")
    assert "planned" in planned.stats


def test_explain(capsys):
    fr.volsplat(RAMP, size=(64, 48), max_error="1/255", explain=True)
    assert "chosen" in capsys.readouterr().out


def test_linear_opacity_is_a_window(tmp_path):
    """A window of the command line is a linear opacity over its range."""
    grey = [[0, 0, 0], [1, 1, 1]]
    function = fr.transfer_function(grey, "linear", clim=(1000, 3000))
    window = fr.volsplat(RAMP, size=(30, 20), window=(2000, 2000), colormap="viridis")
    assert np.allclose(fr.volsplat(RAMP, size=(30, 20), transfer=function)[..., 3], window[..., 3], atol=1e-6)
    (tmp_path / "a.json").write_text(json.dumps(function))
    for form in (tmp_path / "a.json", dict(function), [dict(function)]):
        of_form = fr.volsplat(RAMP, size=(30, 20), transfer=form, transfer_space="srgb")
        assert np.array_equal(of_form, fr.volsplat(RAMP, size=(30, 20), transfer=function))


def test_without_a_range_the_volume_has_its_own():
    grey = [[0, 0, 0], [1, 1, 1]]
    relative = fr.volsplat(RAMP, size=(30, 20), transfer=(grey, "sigmoid"))
    fixed = fr.volsplat(RAMP, size=(30, 20), transfer=(grey, "sigmoid", (0, 4095)))
    assert np.allclose(relative, fixed, atol=1e-6)


def test_opacities_of_pyvista():
    points = lambda opacity: fr.transfer_function([[0] * 3, [1] * 3], opacity)["Points"][1::4]  # noqa: E731
    assert points("linear") == [0.0, 1.0]
    assert points("linear_r") == [1.0, 0.0]
    assert points([0, 128, 255]) == [0.0, 128 / 255, 1.0]
    assert points("sigmoid")[:: 255] == pytest.approx([1 / (1 + np.exp(10)), 1 / (1 + np.exp(-10))])
    assert points("sigmoid_5_r")[0] > 0.99 > points("sigmoid_5")[0]
    assert points("geom")[-1] == 1.0


def test_colour_maps_of_matplotlib_by_either_name():
    matplotlib = pytest.importorskip("matplotlib")
    expected = fr.volsplat(RAMP, size=(30, 20), transfer="bwr")
    for colormap in ("bwr", matplotlib.colormaps["bwr"]):
        assert np.array_equal(fr.volsplat(RAMP, size=(30, 20), colormap=colormap), expected)
    with pytest.raises(ValueError, match="nothing"):
        fr.volsplat(RAMP, size=(30, 20), colormap="nothing")


def test_matplotlib():
    matplotlib = pytest.importorskip("matplotlib")
    named = fr.volsplat(RAMP, size=(30, 20), transfer=("bone", "linear"))
    given = fr.volsplat(RAMP, size=(30, 20), transfer=(matplotlib.colormaps["bone"], [0, 1]))
    assert np.array_equal(named, given)
    assert np.array_equal(fr.volsplat(RAMP, size=(30, 20), transfer="bone"), named)
    # The names that resample knows itself are its own, with the opacity of the histogram.
    assert np.array_equal(fr.volsplat(RAMP, size=(30, 20), transfer="magma"), fr.volsplat(RAMP, size=(30, 20), colormap="magma"))


def test_options_are_those_of_the_command_line():
    for command in ("volsplat", "texmap", "warp3d"):
        assert {"size", "max_error", "background"} <= fr.options(command).keys()
        assert all(fr.options(command).values()), "each has its help"


def test_figures(blob):
    """Bars, axes and captions are drawn into pictures of arrays, as on the command line."""
    size = {"size": (160, 120), "orbit": (30, 20), "background": "white"}
    plain = fr.volsplat(blob, **size)
    for figure in [{"scale_bar": True}, {"scale_bar": 2.0}, {"colour_bar": "blob"}, {"axes": True}, {"caption": "a blob"}]:
        drawn = fr.volsplat(blob, **size, **figure)
        assert 20 < (drawn != plain).any(axis=2).sum() < 4000, figure
    box = fr.volsplat(blob, axes="box", **size)
    assert (box != plain).any()
    with pytest.raises(ValueError, match="shorter bar"):
        fr.volsplat(blob, scale_bar=1e6, **size)


def test_a_picture_knows_its_camera_and_projects_points():
    voxels = np.zeros((21, 21, 21), dtype=np.uint8)
    # No two of them lie behind each other, and none at the rim, where half of it is cut off.
    places = [(1, 1, 1), (19, 1, 5), (3, 19, 1), (19, 19, 19), (4, 15, 12)]
    for z, y, x in places:
        voxels[z, y, x] = 255
    volume = fr.Volume(voxels, spacing=(1, 2, 3), window=(128, 255))
    for projection in ("perspective", "orthographic"):
        picture = volume.render(orbit=(30, 20), size=(400, 320), projection=projection)
        assert (picture.camera["width"], picture.camera["height"]) == (400, 320)
        alpha = np.asarray(picture)[..., 3].astype(float)
        rows, columns = np.mgrid[:320, :400] + 0.5
        for x, y, z in picture.project([(x * 1.0, y * 2.0, z * 3.0) for z, y, x in places]):
            near = alpha * (np.hypot(columns - x, rows - y) < 14)
            assert near.sum() > 1
            middle = [(near * place).sum() / near.sum() for place in (columns, rows)]
            assert np.hypot(x - middle[0], y - middle[1]) < 0.5, projection
            assert picture.depth is None or abs(z - picture.depth[int(y), int(x)]) < 3.0
    assert picture[:10].camera is None
    with pytest.raises(ValueError, match="no camera"):
        picture[:10].project([0, 0, 0])
    with pytest.raises(ValueError, match="expected the shape"):
        picture.project([0, 0])
    behind = fr.Picture(np.zeros((2, 2, 4)), camera={**picture.camera, "projection": "perspective"})
    eye = -np.reshape(picture.camera["R"], (3, 3)).T @ np.asarray(picture.camera["t"])
    forward = np.reshape(picture.camera["R"], (3, 3))[2]
    assert np.isnan(behind.project(eye - forward)[:2]).all()
    again = pickle.loads(pickle.dumps(picture))
    assert again.camera == picture.camera
    low, high = picture.colours[0]
    assert low < high and picture.colours[1].shape == (256, 3)
    assert again.colours[0] == (low, high)


def test_matplotlib_shows_a_picture_as_a_png_does():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    ramp = np.arange(4096, dtype=np.uint16).reshape(16, 16, 16)
    picture = fr.volsplat(ramp, size=(64, 48), background="white")
    ax = fr.plot(picture, label="counts")
    shown = ax.images[0]
    assert np.array_equal(shown.get_array(), picture.to_srgb8())
    assert list(shown.get_extent()) == [0, 64, 48, 0]
    bar = ax.figure.axes[1]
    assert bar.get_ylabel() == "counts"
    assert np.allclose(bar.get_ylim(), picture.colours[0])
    plt.close(ax.figure)
    _, own = plt.subplots()
    assert fr.plot(picture, own, colour_bar=False) is own and len(own.figure.axes) == 1
    plt.close(own.figure)


def test_scenes_say_what_they_were_made_of():
    volume = fr.Volume(np.zeros((4, 5, 6), dtype=np.int16), spacing=(1, 1, 2), preset="ct-bone")
    assert repr(volume) == "Volume(<4 x 5 x 6 int16>, spacing=(1, 1, 2), preset='ct-bone')"
