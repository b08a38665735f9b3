"""Scans of arrays: pictures of the command line, other ways to say the same, errors."""

import numpy as np
import pytest

import forward_resample as fr

SIZE = {"size": (60, 48)}


def arrays(seed=1, count=3000):
    """Positions, colours, intensities and classes of a ball that stands on a floor."""
    random = np.random.default_rng(seed)
    ball = random.normal(size=(count, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    floor = np.stack([*random.uniform(-2, 2, size=(2, count)), np.full(count, -1.0)], axis=1)
    positions = np.concatenate([ball, floor]).astype(np.float32)
    colours = random.integers(0, 256, size=(2 * count, 3)).astype(np.uint8)
    intensities = random.integers(0, 4000, size=2 * count).astype(np.float32)
    classes = np.repeat([6, 2], count).astype(np.uint8)
    return positions, colours, intensities, classes


def named(given):
    positions, colours, intensities, classes = given
    return {"positions": positions, "colours": colours, "intensities": intensities, "classes": classes}


def write_ply(path, positions, colours, intensities, classes):
    kind = np.dtype([("at", "<f4", 3), ("colour", "u1", 3), ("intensity", "<f4"), ("class", "u1")])
    rows = np.zeros(len(positions), kind)
    rows["at"], rows["colour"], rows["intensity"], rows["class"] = positions, colours, intensities, classes
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(positions)}"]
    head += [f"property float {name}" for name in "xyz"] + [f"property uchar {name}" for name in ("red", "green", "blue")]
    head += ["property float intensity", "property uchar classification", "end_header", ""]
    path.write_bytes("\n".join(head).encode() + rows.tobytes())


OPTIONS = [
    {},
    {"color_by": "intensity", "orbit": (30, 20)},
    {"color_by": "class", "shade": "lambert", "light": (1, 2, 3)},
    {"crop": (-1, -1, -0.9, 1, 1, 1), "clip_plane": (1, 0, 0, 0)},
    {"points": 1500, "keep_all": True},
    {"max_error": "1/64"},
]


@pytest.mark.parametrize("options", OPTIONS, ids=lambda options: "-".join(options) or "default")
def test_pictures_are_those_of_the_command_line(resample, tmp_path, options):
    given = arrays()
    write_ply(tmp_path / "a.ply", *given)
    words = []
    for name, value in {**options, **SIZE, "up": "z"}.items():
        joint = "x" if name == "size" else ","
        words += ["--" + name.replace("_", "-")]
        words += [] if value is True else [joint.join(map(str, value)) if isinstance(value, tuple) else str(value)]
    resample("points", tmp_path / "a.ply", *words, "-o", tmp_path / "c.png")
    fr.points(tmp_path / "a.ply", **SIZE, up="z", **options).save(tmp_path / "f.png")
    fr.points(**named(given), **SIZE, up="z", **options).save(tmp_path / "p.png")
    assert (tmp_path / "f.png").read_bytes() == (tmp_path / "c.png").read_bytes()
    assert (tmp_path / "p.png").read_bytes() == (tmp_path / "c.png").read_bytes()


def test_other_ways_to_say_the_same():
    positions, colours, intensities, classes = arrays()
    expected = fr.points(positions, colours, **SIZE)
    assert expected[..., 3].max() == 1
    assert np.array_equal(fr.points(positions.astype(np.float64), colours / 255.0, **SIZE), expected)
    assert np.array_equal(fr.points(positions.tolist(), colours, **SIZE), expected)
    back = fr.points(np.asfortranarray(positions), colours, threads=1, **SIZE)
    assert np.array_equal(back, expected)
    by_class = fr.points(positions, classes=classes, color_by="class", **SIZE)
    assert np.array_equal(fr.points(positions, classes=classes[:, None].astype(int), color_by="class", **SIZE), by_class)
    torch = pytest.importorskip("torch")
    assert np.array_equal(fr.points(torch.tensor(positions), torch.tensor(colours), **SIZE), expected)


def test_far_from_the_origin():
    positions, colours, *_ = arrays()
    away = np.array([500_000.0, 4_000_000.0, 100.0])
    near = fr.points(positions, colours, **SIZE)
    assert np.abs(fr.points(positions + away, colours, **SIZE) - near).mean() < 2e-3


def test_drawn_again_and_in_other_ways():
    scene = fr.Points(**named(arrays()), **SIZE)
    first = scene.render()
    assert not np.array_equal(scene.render(color_by="height"), first)
    assert not np.array_equal(scene.render(points=1000), first)
    assert np.array_equal(scene.render(), first)
    assert len(scene.turntable(3)) == 3
    assert np.isfinite(first.depth).any()
    # Unit vectors, in the world: the floor's is that of z.
    normal = scene.render(layers="normal", orbit=(0, 90), crop=(-2, -2, -1.1, 2, 2, -0.9)).planes
    assert normal["normal.Z"].max() == pytest.approx(1, abs=1e-3)
    with pytest.raises(TypeError, match="no option 'color_bi'; did you mean 'color_by'"):
        scene.render(color_bi="class")
    assert {"color_by", "shade", "points", "layers"} <= fr.options("points").keys()


def wrong(**changes):
    given = {name: array[:50].copy() for name, array in named(arrays()).items()}
    for name, change in changes.items():
        given[name] = change(given[name])
    return given


def with_nan(array):
    array = array.astype(np.float64)
    array.reshape(50, -1)[3, 0] = np.nan
    return array


@pytest.mark.parametrize(
    ("says", "call"),
    [
        (r"positions: expected the shape \(n, 3\), got \(50, 2\)", lambda: fr.points(**wrong(positions=lambda a: a[:, :2]))),
        (r"positions: is empty", lambda: fr.points(np.zeros((0, 3)))),
        (r"positions: row 3 has a number that is not finite", lambda: fr.points(**wrong(positions=with_nan))),
        (r"intensities: row 3 has a number that is not finite", lambda: fr.points(**wrong(intensities=with_nan))),
        (r"intensities: expected the shape \(n,\), got \(50, 2\)", lambda: fr.points(**wrong(intensities=lambda a: np.stack([a, a], 1)))),
        (r"classes: row 0 is no whole number from 0 to 255", lambda: fr.points(**wrong(classes=lambda a: a + 0.5))),
        (r"classes: expected 50 rows, one for each position, got 49", lambda: fr.points(**wrong(classes=lambda a: a[1:]))),
        (r"colours: expected the shape \(n, 3\), got \(50, 4\)", lambda: fr.points(**wrong(colours=lambda a: np.zeros((50, 4))))),
        (r"colours: row 0 is not within 0 and 255", lambda: fr.points(**wrong(colours=lambda a: a.astype(int) + 256))),
        (r"colours: row 0 is not within 0 and 1", lambda: fr.points(**wrong(colours=lambda a: a.astype(float) + 2))),
        (r"positions: is a file", lambda: fr.points("a.ply", [[1, 0, 0]])),
        (r"color.by", lambda: fr.points(**wrong(), color_by="taste")),
        (r"color.by class: the file has none", lambda: fr.points(**wrong(classes=lambda a: None), color_by="class")),
        (r"crop.*leaves no point", lambda: fr.points(**wrong(), crop=(90, 90, 90, 91, 91, 91))),
    ],
)  # fmt: skip
def test_refused(says, call):
    with pytest.raises(ValueError, match=says):
        call()


def test_no_such_file():
    with pytest.raises(FileNotFoundError, match=r"nowhere.ply"):
        fr.points("nowhere.ply")
