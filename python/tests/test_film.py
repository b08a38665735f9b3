"""Films of arrays: fed one picture after another, the pictures of the command line."""

import itertools

import numpy as np
import pytest

import forward_resample as fr
from conftest import read_png

SIZE = (96, 64)


def film(count):
    """Pictures of a post that walks before a striped wall, and depths whose unit changes from picture to picture."""
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    for number in range(count):
        is_post = (x >= 20 + 3 * number) & (x < 40 + 3 * number)
        stripes = 120 + 60 * np.sin(0.4 * x)
        colour = np.stack([np.where(is_post, 220, stripes), np.where(is_post, 40, y + 60), 90 + 0 * x], axis=2)
        depth = np.where(is_post, 200.0, 60.0) + (number % 2)
        yield colour.astype(np.uint8), depth.astype(np.uint8)


def test_the_pictures_of_the_command_line(resample, tmp_path):
    from PIL import Image

    for number, (colour, depth) in enumerate(film(5)):
        Image.fromarray(colour).save(tmp_path / f"c_{number}.png")
        Image.fromarray(depth).save(tmp_path / f"z_{number}.png")
    resample(
        "warp3d", tmp_path / "c_%d.png", tmp_path / "z_%d.png", "--from", "fov:35", "--depth-kind", "relative", "--relative-range", "60,201",
        "--fill", "film", "--tolerance", "0.03", "--stereo", "0.06", "--method", "rows", "-o", tmp_path / "out_%d.png",
    )  # fmt: skip
    frames, depths = zip(*film(5))
    drawn = list(fr.warp_film(frames, depths, stereo=0.06, relative_range=(60, 201)))
    assert len(drawn) == 5
    for number, picture in enumerate(drawn):
        assert np.array_equal(picture.to_srgb8(), read_png(tmp_path / f"out_{number}.png")), number


def test_pictures_are_drawn_when_they_are_asked_for():
    asked = []

    def endless():
        for number in itertools.count():
            asked.append(number)
            yield next(film(1))[0]

    pictures = fr.warp_film(endless(), itertools.repeat(next(film(1))[1]), to="shift:0.05,0,0")
    first = next(pictures)
    assert first.shape == (SIZE[1], SIZE[0], 4) and len(asked) == 1
    next(pictures)
    assert len(asked) == 2


def test_the_background_of_earlier_pictures_fills_holes():
    frames, depths = zip(*film(12))
    options = {"to": "shift:0.1,0,0", "relative_range": (60, 201), "steady": 0}
    alone = list(fr.warp_film(frames, depths, fill="none", **options))
    filled = list(fr.warp_film(frames, depths, **options))
    open_pixels = [int((picture[..., 3] < 0.5).sum()) for picture in alone]
    assert open_pixels[-1] > 60, open_pixels
    assert (filled[-1][..., 3] > 0.5).all()


def test_what_does_not_fit_is_refused():
    colour, depth = next(film(1))
    with pytest.raises(ValueError, match="film"):
        fr.warp_film([colour], [depth], sway=(4, 12))
    with pytest.raises(TypeError):
        fr.warp_film([colour], [depth], no_such_option=1)
    with pytest.raises(ValueError, match="new camera"):
        fr.warp_film([colour], [depth])
    with pytest.raises(ValueError, match="shape"):
        next(fr.warp_film([colour], [depth[0]], stereo=0.06))
