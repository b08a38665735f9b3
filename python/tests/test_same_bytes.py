"""Pictures of arrays are those of the command line, byte for byte."""

import json

import numpy as np
import pytest
from conftest import read_png

import forward_resample as fr


def same(python_path, command_path):
    """Whether two files hold the same bytes, without printing them."""
    return python_path.read_bytes() == command_path.read_bytes()


VOLUME_OPTIONS = [
    {},
    {"orbit": (100, -20, 0.8), "background": "white"},
    {"window": (0.5, 0.6), "shade": "phong", "size": (123, 77)},
    {"order": "every-sample"},
    {"blend": "maximum", "colormap": "magma", "projection": "orthographic"},
    {"iso": 0.4, "clip_plane": "1,0,0,0.5"},
    {"max_error": "1/255"},
    {"background": (10, 20, 30), "bits": 16},
]


def words(options):
    for name, value in options.items():
        yield "--" + name.replace("_", "-")
        if value is not True:
            joint = "x" if name == "size" else ","
            yield joint.join(map(str, value)) if isinstance(value, tuple) else str(value)


@pytest.mark.parametrize("options", VOLUME_OPTIONS, ids=lambda options: "-".join(options) or "default")
def test_volume(blob, resample, tmp_path, options):
    np.save(tmp_path / "a.npy", blob)
    place = {"spacing": (1.0, 0.5, 2.0), "origin": (-3.0, 4.0, 5.0)}
    resample("volsplat", tmp_path / "a.npy", *words({**place, **options}), "-o", tmp_path / "c.png")
    picture = fr.volsplat(blob, **place, **options)
    picture.save(tmp_path / "p.png", bits=options.get("bits"))
    assert same(tmp_path / "p.png", tmp_path / "c.png")


def test_a_curve_is_a_list_of_pairs_or_a_word(blob):
    pairs = fr.volsplat(blob, gradient_opacity=[(0, 0.1), (0.2, 1)], size=(60, 40))
    word = fr.volsplat(blob, gradient_opacity="0:0.1,0.2:1", size=(60, 40))
    ramp = fr.volsplat(blob, gradient_opacity=(0, 0.2), size=(60, 40))
    assert np.array_equal(pairs, word) and not np.array_equal(pairs, ramp)


def test_volume_file_and_array_agree(blob, tmp_path):
    np.save(tmp_path / "a.npy", blob)
    of_file = fr.Volume(tmp_path / "a.npy").render(size=(60, 40))
    of_array = fr.Volume(blob).render(size=(60, 40))
    assert np.array_equal(of_file, of_array)


def test_planes_of_an_exr(blob, resample, tmp_path):
    np.save(tmp_path / "a.npy", blob)
    resample("volsplat", tmp_path / "a.npy", "--layers", "first-hit,normal", "--size", "60x40", "-o", tmp_path / "c.exr")
    picture = fr.volsplat(blob, layers=("first-hit", "normal"), size=(60, 40))
    assert picture.planes
    picture.save(tmp_path / "p.exr")
    assert same(tmp_path / "p.exr", tmp_path / "c.exr")


def test_bands_show_the_pixels_of_the_whole(blob, resample, tmp_path):
    # More pixels than the first band has.
    np.save(tmp_path / "a.npy", blob)
    resample("volsplat", tmp_path / "a.npy", "--size", "1200x1111", "-o", tmp_path / "c.png")
    shares = []
    volume = fr.Volume(blob)
    picture = volume.render(size=(1200, 1111), progress=shares.append)
    assert "bands" in picture.stats
    picture.save(tmp_path / "p.png")
    assert same(tmp_path / "p.png", tmp_path / "c.png")
    assert shares == sorted(shares)


def test_turntable(blob, resample, tmp_path):
    np.save(tmp_path / "a.npy", blob)
    resample("volsplat", tmp_path / "a.npy", "--turntable", 4, "--size", "40x30", "-o", tmp_path / "c%d.png")
    for number, picture in enumerate(fr.Volume(blob).turntable(4, size=(40, 30))):
        # Numbered files also say what drew them.
        assert np.array_equal(picture.to_srgb8(), read_png(tmp_path / f"c{number}.png"))
    fr.Volume(tmp_path / "a.npy").write(tmp_path / "w%d.png", turntable=4, size=(40, 30))
    fr.Volume(blob).write(tmp_path / "m%d.png", turntable=4, size=(40, 30))
    for number in range(4):
        assert same(tmp_path / f"w{number}.png", tmp_path / f"c{number}.png")
        assert np.array_equal(read_png(tmp_path / f"m{number}.png"), read_png(tmp_path / f"c{number}.png"))


def test_films(blob, resample, tmp_path):
    np.save(tmp_path / "a.npy", blob)
    resample("volsplat", tmp_path / "a.npy", "--turntable", 3, "--size", "40x30", "-o", tmp_path / "c.apng")
    volume = fr.Volume(blob)
    volume.write(tmp_path / "w.apng", turntable=3, size=(40, 30))
    fr.write_film(tmp_path / "f.apng", volume.turntable(3, size=(40, 30)))
    assert same(tmp_path / "w.apng", tmp_path / "c.apng")
    assert same(tmp_path / "f.apng", tmp_path / "c.apng")


def test_a_volume_that_changes_is_drawn_as_if_it_were_new(blob):
    volume = fr.Volume(blob, size=(60, 40))
    volume.render()
    steps = [
        {"orbit": (90, 0)},
        {"shade": "phong"},
        {"transfer": "plasma"},
        {"transfer": "plasma", "shade": "phong", "background": "black"},
        {"max_error": "1/64"},
        {"layers": "first-hit"},
        {},
    ]
    for step in steps:
        assert np.array_equal(volume.render(**step), fr.volsplat(blob, size=(60, 40), **step)), step
    volume.set_transfer(window=(0.5, 0.2))
    assert np.array_equal(volume.render(), fr.volsplat(blob, size=(60, 40), window=(0.5, 0.2)))


def test_cameras_as_dicts(blob, resample, tmp_path):
    np.save(tmp_path / "a.npy", blob)
    camera = {"position": [60.0, 40.0, 50.0], "target": [20, 16, 12], "up": [0, 1, 0], "fov_y": 35}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    common = ("--size", "50x40", "-o", tmp_path / "c.png")
    resample("volsplat", tmp_path / "a.npy", "--camera", tmp_path / "camera.json", *common)
    for form in (camera, tmp_path / "camera.json", str(tmp_path / "camera.json")):
        fr.volsplat(blob, camera=form, size=(50, 40)).save(tmp_path / "p.png")
        assert same(tmp_path / "p.png", tmp_path / "c.png")
    # JSON stands in place of a file's name on the command line too.
    resample("volsplat", tmp_path / "a.npy", "--camera", json.dumps(camera), *common)
    assert same(tmp_path / "p.png", tmp_path / "c.png")
    pyvista = (camera["position"], camera["target"], camera["up"])
    assert np.array_equal(
        fr.volsplat(blob, camera=pyvista, size=(50, 40), fov=35), fr.volsplat(blob, camera=camera, size=(50, 40))
    )


def mesh():
    """A bent sheet with a checker texture: vertices, faces, uv, texture."""
    v, u = np.mgrid[0:1:9j, 0:1:9j]
    vertices = np.stack([u, v, 0.3 * np.sin(3 * u)], axis=-1).reshape(-1, 3)
    corner = np.arange(72).reshape(8, 9)[:, :8].reshape(-1, 1)
    faces = np.concatenate([corner + [0, 1, 10], corner + [0, 10, 9]])
    texture = np.kron(np.indices((8, 8)).sum(axis=0) % 2, np.ones((8, 8)))[..., None] * [255, 200, 40]
    return vertices, faces, np.stack([u, v], axis=-1).reshape(-1, 2), texture.astype(np.uint8)


def write_ply(path, vertices, faces, uv=None, colours=None):
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"property double {axis}" for axis in "st"] if uv is not None else []
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")] if colours is not None else []
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    for number, vertex in enumerate(vertices):
        row = list(map(repr, map(float, vertex)))
        row += list(map(repr, map(float, uv[number]))) if uv is not None else []
        row += list(map(str, colours[number])) if colours is not None else []
        lines.append(" ".join(row))
    lines += [" ".join(map(str, [3, *face])) for face in faces]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("options", [{}, {"orbit": (40, 30)}, {"method": "backward-ewa"}, {"max_error": "1/255"}])
def test_mesh(resample, tmp_path, options):
    from PIL import Image

    vertices, faces, uv, texture = mesh()
    write_ply(tmp_path / "a.ply", vertices, faces, uv)
    Image.fromarray(texture).save(tmp_path / "t.png")
    common = ("--texture", tmp_path / "t.png", "--size", "90x70", "-o", tmp_path / "c.png")
    resample("texmap", tmp_path / "a.ply", *words(options), *common)
    for given in (texture, tmp_path / "t.png", Image.open(tmp_path / "t.png")):
        fr.texmap(vertices, faces, uv, given, size=(90, 70), **options).save(tmp_path / "p.png")
        assert same(tmp_path / "p.png", tmp_path / "c.png")


def test_mesh_with_colours(resample, tmp_path):
    vertices, faces, _, _ = mesh()
    colours = (np.arange(3 * len(vertices)).reshape(-1, 3) * 37 % 256).astype(np.uint8)
    # A scan far away, as in a survey.
    vertices = vertices + [500_000.0, 4_000_000.0, 100.0]
    write_ply(tmp_path / "a.ply", vertices, faces, colours=colours)
    resample("texmap", tmp_path / "a.ply", "--size", "90x70", "-o", tmp_path / "c.png")
    fr.texmap(vertices, faces, colours=colours, size=(90, 70)).save(tmp_path / "p.png")
    assert same(tmp_path / "p.png", tmp_path / "c.png")
    fr.Mesh(tmp_path / "a.ply").render(size=(90, 70)).save(tmp_path / "f.png")
    assert same(tmp_path / "f.png", tmp_path / "c.png")


def depth_image():
    """A picture, its depth in millimetres, the camera's matrix, and two poses."""
    y, x = np.mgrid[0:48, 0:64]
    colour = np.stack([x * 4, y * 5, (x + y) % 2 * 255], axis=-1).astype(np.uint8)
    depth = np.where((x - 30) ** 2 + (y - 20) ** 2 < 150, 1000, 2000 + 5 * x).astype(np.uint16)
    depth[:3, :3] = 0
    K = np.array([[60.0, 0, 31.5], [0, 60, 23.5], [0, 0, 1]])
    turn = np.deg2rad(5)
    pose_from = np.eye(4)
    pose_to = np.array(
        [[np.cos(turn), 0, np.sin(turn), -0.1], [0, 1, 0, 0.02], [-np.sin(turn), 0, np.cos(turn), 0.1], [0, 0, 0, 1]]
    )
    return colour, depth, K, pose_from, pose_to


def camera_file(K, pose):
    return {
        "width": 64, "height": 48, "fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2],
        "pixel_centre": "integer", "R": pose[:3, :3].reshape(-1).tolist(), "t": pose[:3, 3].tolist(),
    }  # fmt: skip


@pytest.mark.parametrize("options", [{}, {"fill": "background"}, {"method": "splats"}, {"stereo": 0.06}])
def test_warp(resample, tmp_path, options):
    from PIL import Image

    colour, depth, K, pose_from, pose_to = depth_image()
    Image.fromarray(colour).save(tmp_path / "a.png")
    np.save(tmp_path / "d.npy", depth)
    for name, pose in (("from", pose_from), ("to", pose_to)):
        (tmp_path / f"{name}.json").write_text(json.dumps(camera_file(K, pose)))
    resample(
        "warp3d", tmp_path / "a.png", tmp_path / "d.npy", "--depth-scale", "0.001", *words(options),
        "--from", tmp_path / "from.json", "--to", tmp_path / "to.json", "-o", tmp_path / "c.png",
    )  # fmt: skip
    picture = fr.warp(colour, depth, K, pose_from, pose_to, depth_scale=0.001, **options)
    picture.save(tmp_path / "p.png")
    assert same(tmp_path / "p.png", tmp_path / "c.png")
    inverse = (np.linalg.inv(pose_from), np.linalg.inv(pose_to))
    other = fr.warp(colour, depth, K, *inverse, pose_is="world_from_camera", depth_scale=0.001, **options)
    assert np.allclose(other, picture, atol=1e-3)


def test_warp_with_references(resample, tmp_path):
    from PIL import Image

    colour, depth, K, first, second = depth_image()
    Image.fromarray(colour).save(tmp_path / "a.png")
    np.save(tmp_path / "d.npy", depth)
    for name, pose in (("first", first), ("second", second)):
        (tmp_path / f"{name}.json").write_text(json.dumps(camera_file(K, pose)))
    between = first.copy()
    between[0, 3] = -0.05
    (tmp_path / "to.json").write_text(json.dumps(camera_file(K, between)))
    resample(
        "warp3d", tmp_path / "a.png", tmp_path / "d.npy", "--from", tmp_path / "first.json", "--to", tmp_path / "to.json",
        "--reference", tmp_path / "a.png", tmp_path / "d.npy", tmp_path / "second.json",
        "--depth-scale", "0.001", "-o", tmp_path / "c.png",
    )  # fmt: skip
    image = fr.DepthImage(colour, depth, K, first, references=[(colour, depth, K, second)], depth_scale=0.001)
    image.view(between).save(tmp_path / "p.png")
    assert same(tmp_path / "p.png", tmp_path / "c.png")
    several = list(image.pictures(**image.to(np.stack([between, second]))))
    assert len(several) == 2
    assert np.array_equal(several[0], image.view(between))
