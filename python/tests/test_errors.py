"""Wrong arguments are refused with sentences that name them."""

import numpy as np
import pytest

import forward_resample as fr

RAMP = np.arange(1000, dtype=np.uint16).reshape(10, 10, 10)
TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
K = [[50, 0, 31.5], [0, 50, 23.5], [0, 0, 1]]
GREY, WALL = np.full((48, 64), 128, np.uint8), np.full((48, 64), 2.0)


@pytest.mark.parametrize(
    ("error", "says", "call"),
    [
        (ValueError, r"data: expected three axes \(z, y, x\), got the shape \(10, 10\)", lambda: fr.volsplat(RAMP[0])),
        (ValueError, r"data: is empty", lambda: fr.volsplat(RAMP[:0])),
        (TypeError, r"data: expected whole or real numbers, got complex", lambda: fr.volsplat(RAMP * 1j)),
        (TypeError, r"data: expected an array of numbers, got object", lambda: fr.volsplat(object())),
        (ValueError, r"spacing: expected three numbers", lambda: fr.volsplat(RAMP, spacing=(1, 2))),
        (ValueError, r"spacing: expected numbers above 0", lambda: fr.volsplat(RAMP, spacing=(1, 2, 0))),
        (ValueError, r"direction: expected 3x3", lambda: fr.volsplat(RAMP, direction=np.eye(4))),
        (ValueError, r"axes of the volume lie in one plane", lambda: fr.volsplat(RAMP, direction=np.ones((3, 3)))),
        (ValueError, r"mask has 9x10x10 voxels", lambda: fr.volsplat(RAMP, mask=RAMP[:, :, 1:]).shape),
        (TypeError, r"no option 'colourmap2'; did you mean 'colormap'", lambda: fr.volsplat(RAMP, colourmap2="x")),
        (TypeError, r"no option 'output'", lambda: fr.volsplat(RAMP, output="a.png")),
        (TypeError, r"shade: .* is no option", lambda: fr.volsplat(RAMP, shade=object())),
        (TypeError, r"explain: expected True or False", lambda: fr.volsplat(RAMP, explain="yes")),
        (ValueError, r"invalid value '0x5' for 'size", lambda: fr.volsplat(RAMP, size=(0, 5))),
        (ValueError, r"'preset <NAME>' cannot be used with 'window", lambda: fr.volsplat(RAMP, preset="ct-bone", window=(1, 2))),
        (ValueError, r"explain: there is nothing to explain", lambda: fr.volsplat(RAMP, explain=True)),
        (ValueError, r"camera: expected position, target and up", lambda: fr.volsplat(RAMP, camera=(1, 2))),
        (ValueError, r"no camera|position", lambda: fr.volsplat(RAMP, camera={"target": (1, 2, 3)})),
        (ValueError, r"ask for 3 pictures: call pictures", lambda: fr.volsplat(RAMP, turntable=3)),
        (ValueError, r"the layout of raw files is for files", lambda: fr.Volume(RAMP, nan_as=0, dims=(1, 2, 3), type="u8").render()),
        (FileNotFoundError, r"nowhere.nrrd", lambda: fr.Volume("nowhere.nrrd").render()),
        (FileNotFoundError, r"nowhere.glb", lambda: fr.texmap("nowhere.glb")),
        (ValueError, r"direction: a file has its own", lambda: fr.Volume("a.nrrd", direction=np.eye(3))),
        (ValueError, r"cmap: neither a preset", lambda: fr.volsplat(RAMP, transfer="no such map")),
        (ValueError, r"opacity: expected linear", lambda: fr.transfer_function([[0] * 3, [1] * 3], "steep")),
        (ValueError, r"vertices: expected the shape \(n, 3\), got \(3, 2\)", lambda: fr.texmap(np.zeros((3, 2)), [[0, 1, 2]])),
        (ValueError, r"faces: expected the shape \(n, 3\)", lambda: fr.texmap(TRIANGLE, [[0, 1, 2, 0]])),
        (ValueError, r"faces: a face has the vertex -1", lambda: fr.texmap(TRIANGLE, [[0, 1, -1]])),
        (TypeError, r"faces: expected whole numbers, got float64", lambda: fr.texmap(TRIANGLE, [[0.0, 1.0, 2.0]])),
        (ValueError, r"uv: expected 3 rows", lambda: fr.texmap(TRIANGLE, [[0, 1, 2]], [[0, 0]], GREY)),
        (ValueError, r"texture: needs texture coordinates", lambda: fr.texmap(TRIANGLE, [[0, 1, 2]], texture=GREY)),
        (ValueError, r"texture: expected the shape", lambda: fr.texmap(TRIANGLE, [[0, 1, 2]], np.zeros((3, 2)), GREY[0])),
        (ValueError, r"finite numbers", lambda: fr.texmap([[np.nan, 0, 0], *TRIANGLE[1:]], [[0, 1, 2]])),
        (ValueError, r"no triangles", lambda: fr.texmap(TRIANGLE, np.zeros((0, 3), int))),
        (ValueError, r"K: expected 3x3 numbers", lambda: fr.warp(GREY, WALL, np.eye(4))),
        (ValueError, r"pose_to: expected 4x4 numbers", lambda: fr.warp(GREY, WALL, K, None, np.eye(3))),
        (ValueError, r"colour: expected the shape", lambda: fr.warp(np.zeros((4, 5, 2)), WALL, K, None, np.eye(4))),
        (ValueError, r"depth: expected the shape", lambda: fr.warp(GREY, WALL[0], K, None, np.eye(4))),
        (ValueError, r"differ in proportions", lambda: fr.warp(GREY, WALL[:20], K, None, np.eye(4))),
        (ValueError, r"camera is missing", lambda: fr.warp(GREY, WALL, to="shift:1,0,0")),
        (ValueError, r"pose_is: expected", lambda: fr.warp(GREY, WALL, K, pose_is="opengl")),
    ],
)  # fmt: skip
def test_refused(error, says, call):
    with pytest.raises(error, match=says):
        call()


def test_files_that_cannot_be_written(tmp_path):
    picture = fr.volsplat(RAMP, size=(8, 8))
    with pytest.raises(ValueError, match="unknown picture format"):
        picture.save(tmp_path / "a.gif")
    with pytest.raises((OSError, ValueError), match="does not exist"):
        picture.save(tmp_path / "nowhere" / "a.png")
    with pytest.raises(ValueError, match="expected the shape"):
        picture[0].save(tmp_path / "a.png")
    with pytest.raises(ValueError, match="animation's name"):
        fr.write_film(tmp_path / "a.png", [picture])


def test_nothing_is_written_where_arrays_are_drawn(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fr.volsplat(RAMP, size=(8, 8), layers="first-hit")
    assert list(tmp_path.iterdir()) == []


def test_a_scene_goes_on_after_an_error():
    volume = fr.Volume(RAMP, size=(16, 16))
    expected = volume.render()
    for wrong in ({"slab": -1}, {"camera": "nowhere.json"}, {"camera": {"fx": 1}}, {"transfer": "nowhere.json"}):
        with pytest.raises((ValueError, OSError)):
            volume.render(**wrong)
        assert np.array_equal(volume.render(), expected), wrong


def test_warnings_are_pythons():
    with pytest.warns(fr.ResampleWarning, match="nothing is visible"):
        fr.volsplat(RAMP, window=(5000, 10), size=(8, 8))


def test_typed_options_are_those_of_the_command_line():
    import forward_resample._options as module
    import typed_options

    with open(module.__file__, encoding="utf-8") as file:
        written = file.read()
    assert written == typed_options.text(), "run python/tests/typed_options.py"
    assert "slab" in module.VolumeOptions.__annotations__
    assert "from_" in module.DepthOptions.__annotations__
