"""The live viewer, served by this process."""

import json
import urllib.request

import numpy as np
import pytest
from websockets.sync.client import connect

import forward_resample as fr

RAMP = np.arange(4096, dtype=np.uint16).reshape(16, 16, 16)


def first_word(page):
    """What the page is told first."""
    with connect(page.address.replace("http", "ws") + "socket", origin=page.address.rsplit("/", 2)[0]) as socket:
        return json.loads(socket.recv(timeout=20))


def test_a_volume_is_shown():
    page = fr.view(fr.Volume(RAMP, preset="mr-head"), orbit=(30, 20))
    with urllib.request.urlopen(page.address, timeout=10) as answer:
        assert "<html" in answer.read().decode()
    scene = first_word(page)
    assert scene["type"] == "scene" and scene["application"] == "volsplat" and scene["volume"], scene.keys()
    assert f'src="{page.address}"' in page._repr_html_()
    page.close()


def test_meshes_and_depth_images_are_shown():
    triangle = fr.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    K = [[50, 0, 31.5], [0, 50, 23.5], [0, 0, 1]]
    wall = fr.DepthImage(np.full((48, 64, 3), 128, np.uint8), np.full((48, 64), 2.0), K)
    for scene, name in ((triangle, "texmap"), (wall, "warp3d")):
        page = fr.view(scene)
        assert first_word(page)["application"] == name
        page.close()


def test_looks_that_were_typed_keep_no_preset_from_being_drawn():
    page = fr.view(fr.Volume(RAMP, shade="phong"))
    with connect(page.address.replace("http", "ws") + "socket", origin=page.address.rsplit("/", 2)[0]) as socket:
        scene = json.loads(socket.recv(timeout=20))
        camera = {key: scene["start"][key] for key in ("position", "target", "up", "fov_y")}
        for preset in scene["volume"]["presets"]:
            ask = {"type": "thumbnail", "preset": preset["name"], "camera": camera, "size": [64, 64]}
            socket.send(json.dumps(ask))
            assert isinstance(socket.recv(timeout=20), bytes), preset["name"]
    page.close()


def test_proxies_and_errors():
    page = fr.view(RAMP, through="/user/me/proxy/{port}/")
    port = page.address.split(":")[2].split("/")[0]
    assert page.source.startswith(f"/user/me/proxy/{port}/") and page.source.count("//") == 0
    page.close()
    with pytest.raises(ValueError, match="preset"):
        fr.view(RAMP, preset="nothing")
    with pytest.raises(TypeError, match="no option"):
        fr.view(RAMP, presett="ct-bone")
