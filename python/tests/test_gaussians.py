"""3-D Gaussians of arrays: pictures of the command line, conventions of gsplat, errors."""

import numpy as np
import pytest

import forward_resample as fr

COUNT = 300
SIZE = {"size": (60, 48)}


def arrays(coefficients=4, seed=1):
    """Means, quats (w, x, y, z), scales, opacities, sh of a cloud."""
    random = np.random.default_rng(seed)
    return (
        random.normal(size=(COUNT, 3)).astype(np.float32),
        random.normal(size=(COUNT, 4)).astype(np.float32),
        np.exp(random.normal(-2.0, 0.5, size=(COUNT, 3))).astype(np.float32),
        random.uniform(0.05, 0.95, size=COUNT).astype(np.float32),
        random.normal(0.0, 0.4, size=(COUNT, coefficients, 3)).astype(np.float32),
    )


def write_ply(path, means, quats, scales, opacities, sh):
    """As INRIA's code writes it."""
    rest = sh[:, 1:].transpose(0, 2, 1).reshape(len(means), -1)
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", *(f"f_rest_{number}" for number in range(rest.shape[1]))]
    names += ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(means)}"]
    head += [f"property float {name}" for name in names] + ["end_header", ""]
    odds = np.log(opacities / (1 - opacities))[:, None]
    table = np.concatenate([means, sh[:, 0], rest, odds, np.log(scales), quats], axis=1)
    path.write_bytes("\n".join(head).encode() + table.astype("<f4").tobytes())


@pytest.mark.parametrize("coefficients", [1, 4, 9, 16])
def test_arrays_and_their_file_agree(tmp_path, coefficients):
    given = arrays(coefficients)
    write_ply(tmp_path / "a.ply", *given)
    # Logarithms of scales and odds are rounded in the file, and a rounding may move the end of a slab: by less of a picture where slabs are thin.
    of_file = fr.splats(tmp_path / "a.ply", slab_error=0.001, **SIZE)
    of_arrays = fr.splats(*given, slab_error=0.001, **SIZE)
    assert of_file[..., 3].max() > 0.3
    assert np.abs(of_file - of_arrays).max() < 1e-4


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"model": "mip", "orbit": (30, 20)},
        {"slab_error": 0.01, "samples": 4, "crop": (-1, -1, -1, 1, 1, 1)},
        {"clip_plane": (1, 0, 0, 0), "up": "y"},
        {"max_error": "1/64"},
    ],
    ids=lambda options: "-".join(options) or "default",
)
def test_files_are_drawn_as_by_the_command_line(resample, tmp_path, options):
    write_ply(tmp_path / "a.ply", *arrays())
    words = []
    for name, value in {**options, **SIZE}.items():
        joint = "x" if name == "size" else ","
        words += ["--" + name.replace("_", "-"), joint.join(map(str, value)) if isinstance(value, tuple) else str(value)]
    resample("gaussians", tmp_path / "a.ply", *words, "-o", tmp_path / "c.png")
    fr.splats(str(tmp_path / "a.ply"), **SIZE, **options).save(tmp_path / "p.png")
    assert (tmp_path / "p.png").read_bytes() == (tmp_path / "c.png").read_bytes()


def test_conventions():
    """A needle along the second axis after a quarter turn about z, seen from the front: w is the first of a quaternion."""
    half = np.sqrt(0.5)
    camera = {"position": [0, 0, 10], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y": 40}
    needle = fr.splats([[0, 0, 0]], [[half, 0, 0, half]], [[1, 0.05, 0.05]], [0.9], colours=[[255, 0, 0]], camera=camera, size=(65, 65))
    tall = needle[..., 3].max(axis=1) > 0.1
    wide = needle[..., 3].max(axis=0) > 0.1
    assert tall.sum() > 4 * wide.sum()
    # One alone has its own opacity, behind the filter of the pixel.
    ball = fr.splats([[0, 0, 0]], [[1, 0, 0, 0]], [[1, 1, 1]], [0.5], [[[0, 0, 0]]], camera=camera, size=(65, 65))
    assert ball[32, 32, 3] == pytest.approx(0.5, abs=0.01)
    assert ball.to_srgb8()[32, 32, :3] == pytest.approx(128, abs=1), "half of sRGB"
    linear = fr.splats([[0, 0, 0]], [[1, 0, 0, 0]], [[1, 1, 1]], [0.5], [[[0, 0, 0]]], blend="linear", camera=camera, size=(65, 65))
    assert linear[32, 32, 0] / linear[32, 32, 3] == pytest.approx(0.5, abs=0.01)


def test_other_kinds_of_arrays():
    means, quats, scales, opacities, sh = arrays()
    expected = fr.splats(means, quats, scales, opacities, sh, **SIZE)

    class Tensor:
        """As much of a tensor as is needed."""

        def __init__(self, array):
            self.array = array

        def __array__(self, dtype=None, copy=None):
            return np.asarray(self.array, dtype)

    tensors = [Tensor(array) for array in (means, quats, scales, opacities, sh)]
    assert np.array_equal(fr.splats(*tensors, **SIZE), expected)
    turned = [np.asfortranarray(means.astype(float)), 2 * quats, scales.tolist(), opacities[:, None], sh]
    assert np.allclose(fr.splats(*turned, **SIZE), expected, atol=1e-5)
    torch = pytest.importorskip("torch")
    tensors = [torch.tensor(array, requires_grad=True) for array in (means, quats, scales, opacities, sh)]
    assert np.array_equal(fr.splats(*tensors, **SIZE), expected)


def test_far_from_the_origin():
    means, *others = arrays()
    away = np.array([500_000.0, 4_000_000.0, 100.0])
    near = fr.splats(means, *others, **SIZE)
    assert np.abs(fr.splats(means + away, *others, **SIZE) - near).max() < 2e-3


def test_drawn_again_and_in_other_ways():
    scene = fr.Gaussians(*arrays(), **SIZE)
    first = scene.render()
    assert not np.array_equal(scene.render(model="khr"), first)
    assert np.array_equal(scene.render(), first)
    assert len(scene.turntable(3)) == 3
    deep = scene.render(layers="median-depth")
    assert np.isfinite(deep.planes["depth.median"]).any()
    with pytest.raises(TypeError, match="no option 'slab_eror'; did you mean 'slab_error'"):
        scene.render(slab_eror=1)
    assert "gaussians" in scene.render().stats or scene.render().stats["wall_ms"] > 0
    assert {"model", "slab_error"} <= fr.options("gaussians").keys()


def wrong(at, value):
    given = [array[:5].copy() for array in arrays()]
    given[at] = value(given[at]) if callable(value) else value
    return given


def with_nan(array):
    array.reshape(5, -1)[3, 0] = np.nan
    return array


@pytest.mark.parametrize(
    ("says", "call"),
    [
        (r"means: expected the shape \(n, 3\), got \(5, 2\)", lambda: fr.splats(*wrong(0, lambda a: a[:, :2]))),
        (r"means: is empty", lambda: fr.splats(*[array[:0] for array in arrays()])),
        (r"means: row 3 has a number that is not finite", lambda: fr.splats(*wrong(0, with_nan))),
        (r"sh: row 3 has a number that is not finite", lambda: fr.splats(*wrong(4, with_nan))),
        (r"quats: expected the shape \(n, 4\), got \(5, 3\)", lambda: fr.splats(*wrong(1, lambda a: a[:, :3]))),
        (r"quats: row 0 has the length 0", lambda: fr.splats(*wrong(1, lambda a: 0 * a))),
        (r"scales: row 0 has a number below 0.*logarithms", lambda: fr.splats(*wrong(2, lambda a: -a))),
        (r"scales: expected 5 rows, one for each mean, got 4", lambda: fr.splats(*wrong(2, lambda a: a[:4]))),
        (r"opacities: row 0 is not within 0 and 1.*log odds", lambda: fr.splats(*wrong(3, lambda a: a + 3))),
        (r"opacities: expected the shape \(n,\), got \(5, 2\)", lambda: fr.splats(*wrong(3, lambda a: np.stack([a, a], 1)))),
        (r"opacities: is missing", lambda: fr.splats(*wrong(3, lambda a: None))),
        (r"sh: expected the shape \(n, k, 3\) with k = 1, 4, 9 or 16, got \(5, 3, 3\)", lambda: fr.splats(*wrong(4, lambda a: a[:, :3]))),
        (r"sh: expected either sh or colours", lambda: fr.splats(*wrong(4, lambda a: None))),
        (r"colours: expected the shape", lambda: fr.splats(*wrong(4, lambda a: None), colours=np.zeros((5, 4)))),
        (r"blend: expected 'srgb' or 'linear'", lambda: fr.splats(*wrong(0, lambda a: a), blend="gamma")),
        (r"means: is a file", lambda: fr.splats("a.ply", [[1, 0, 0, 0]])),
        (r"slab.error", lambda: fr.splats(*wrong(0, lambda a: a), slab_error=2)),
        (r"crop.*keeps the centre of no Gaussian", lambda: fr.splats(*wrong(0, lambda a: a), crop=(90, 90, 90, 91, 91, 91))),
    ],
)  # fmt: skip
def test_refused(says, call):
    with pytest.raises(ValueError, match=says):
        call()


def test_no_such_file():
    with pytest.raises(FileNotFoundError, match=r"nowhere.ply"):
        fr.splats("nowhere.ply")
