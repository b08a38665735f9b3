"""Volumes beyond memory: pyramids whose bricks are fetched as they are seen."""

import functools
import http.server
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import forward_resample as fr
from forward_resample import distributed

zarr = pytest.importorskip("zarr", minversion="3")
sys.path.insert(0, str(Path(__file__).parent))

import bounds  # noqa: E402
from virtual import Waves  # noqa: E402

SHAPE = (128, 192, 256)
TRANSFER = fr.transfer_function([[0.2, 0, 0.4], [0, 0.6, 0.5], [1, 1, 0.2]], [0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8, 0.9], clim=(0, 255))
VIEW = {"camera": {"position": [330, 260, -260], "target": [128, 96, 64], "up": [0, -1, 0]}, "size": (96, 80)}


@pytest.fixture(scope="module")
def waves():
    return Waves(SHAPE, chunk=32, scale=0.3)


def pyramid(waves, **options):
    group = zarr.open_group(waves, mode="r")
    return fr.Pyramid(group, TRANSFER, opacity_unit=6.0, held_voxels=1 << 15, **options)


def test_the_picture_is_that_of_all_voxels(waves):
    scene = pyramid(waves)
    # As many samples as the exact picture has: the ends of the volume are sharp.
    picture = scene.render(subpixels=8, slab=0.25, **VIEW)
    voxels = waves.voxels(0, [0, 0, 0], SHAPE)
    exact = fr.volsplat(voxels, transfer=TRANSFER, opacity_unit=6.0, subpixels=8, slab=0.25, **VIEW)
    error = np.abs(np.asarray(picture) - np.asarray(exact))
    assert error.max() <= 1.5 / 255 and np.sqrt((error**2).mean()) <= 0.2 / 255, (error.max() * 255, np.sqrt((error**2).mean()) * 255)
    assert np.asarray(exact)[..., 3].max() > 0.9


def test_what_is_cut_off_is_not_fetched(waves):
    scene = pyramid(waves)
    whole = scene.render(**VIEW).stats["bytes_fetched"]
    box = (100, 60, 40, 160, 120, 90)
    voxels = waves.voxels(0, [0, 0, 0], SHAPE)
    for cut in ({"crop": box}, {"crop": "100,60,40,160,120,90"}, {"clip_plane": ["1,0,0,100", "-1,0,0,-160"]}):
        scene = pyramid(waves)
        picture = scene.render(subpixels=8, slab=0.25, **cut, **VIEW)
        assert picture.stats["bytes_fetched"] < 0.9 * whole, cut
        exact = fr.volsplat(voxels, transfer=TRANSFER, opacity_unit=6.0, subpixels=8, slab=0.25, **cut, **VIEW)
        error = np.abs(np.asarray(picture) - np.asarray(exact))
        assert error.max() <= 1.5 / 255 and np.asarray(exact)[..., 3].max() > 0.05, (cut, error.max() * 255)


def test_what_is_hidden_or_transparent_is_not_fetched(waves):
    finest = np.prod(SHAPE) / 32**3
    group = zarr.open_group(waves, mode="r")
    colours = [[1, 0, 0], [0, 1, 0.3]]
    bright = fr.Pyramid(group, (colours, [0, 0, 0, 0, 0, 0.2, 0.9], (68, 168)), opacity_unit=6.0, held_voxels=1 << 15)
    stats = bright.render(**{**VIEW, "size": (192, 160)}).stats
    assert stats["transparent"] > 0
    invisible = fr.Pyramid(group, (colours, [0.0, 0.0], (68, 168)), held_voxels=1 << 15)
    assert invisible.render(**VIEW).stats["chunks_fetched"] == 0
    near = {"camera": {"position": [128, 96, -60], "target": [128, 96, 64], "up": [0, -1, 0]}, "size": (128, 128)}
    opaque = fr.Pyramid(group, (colours, [0.9, 0.9], (68, 168)), held_voxels=1 << 15)
    stats = opaque.render(**near).stats
    assert stats["hidden"] > 0 and 0 < stats["chunks_fetched"] < finest


def test_processes_give_the_same_bytes_and_share_what_they_fetch(waves, tmp_path):
    dask = pytest.importorskip("distributed")
    cache = tmp_path / "cache"
    first = pyramid(waves, cache=cache)
    alone = distributed.render(first, dask_less(), tile=(48, 48), **VIEW)[0]
    fetched = first._store.fetched_bytes
    assert fetched > 0
    again = pyramid(waves, cache=cache)
    with dask.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, dask.Client(cluster) as client:
        together = distributed.render(again, client, tile=(48, 48), **VIEW)[0]
    assert np.array_equal(alone, together)
    assert sum(part["bytes_fetched"] for part in together.stats["parts"]) == 0 and again._store.fetched_bytes == 0


def dask_less():
    """An executor of this process."""

    class Done:
        def __init__(self, value):
            self.value = value

        def result(self):
            return self.value

    class Here:
        def submit(self, call, *arguments):
            return Done(call(*arguments))

    return Here()


def test_a_pyramid_far_away(waves, tmp_path):
    pytest.importorskip("aiohttp")
    pytest.importorskip("fsspec")

    class Served(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            value = waves.value(self.path.strip("/").removeprefix("image/"))
            self.send_response(404 if value is None else 200)
            self.send_header("Content-Length", str(len(value or b"")))
            self.end_headers()
            self.wfile.write(value or b"")

        do_HEAD = do_GET
        log_message = functools.partialmethod(lambda self, *words: None)

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Served)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        url = f"http://127.0.0.1:{server.server_address[1]}/image"
        far = fr.Pyramid(url, TRANSFER, opacity_unit=6.0, held_voxels=1 << 15, cache=tmp_path)
        assert np.array_equal(far.render(**VIEW), pyramid(waves).render(**VIEW))
    finally:
        server.shutdown()
        server.server_close()


def test_a_pyramid_in_a_bucket(tmp_path, monkeypatch):
    pytest.importorskip("s3fs", reason="no s3fs")
    server = pytest.importorskip("moto.server", reason="no moto with its server")
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(name, "none")
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    _, group, look = bounds.made("boxes", 96)
    view = {"camera": look["camera"], "size": (48, 48)}
    served = server.ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    served.start()
    try:
        host, port = served.get_host_and_port()
        monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        import s3fs

        s3fs.S3FileSystem().mkdir("bucket")
        pictures = []
        for place in (str(tmp_path / "image.zarr"), "s3://bucket/image.zarr"):
            copy = zarr.open_group(place, mode="w")
            copy.attrs.update(group.attrs.asdict())
            for name, array in group.arrays():
                copy.create_array(name, data=array[:], chunks=array.chunks)
            stored = fr.Pyramid(place, look["transfer"], opacity_unit=look["opacity_unit"], held_voxels=1 << 14)
            pictures.append(stored.render(**view))
            assert pictures[-1].stats["bytes_fetched"] > 0
        assert np.array_equal(*pictures) and np.asarray(pictures[0]).max() > 0.1
    finally:
        served.stop()


@pytest.mark.parametrize("scene", bounds.SCENES)
def test_errors_stay_under_the_bound(scene):
    for max_error, most in (("1/255", 1.0), ("4/255", 4.0)):
        picture, fetched, _ = bounds.by_levels(scene, 96, held_voxels=1 << 14, max_error=max_error)
        error = bounds.worst(picture, bounds.whole(scene, 96))
        assert error <= most and fetched > 0, (max_error, error)


def test_levels_below_a_size_are_left_alone():
    errors, bytes_fetched = [], []
    for finest in (0.25, 2.0):
        picture, fetched, _ = bounds.by_levels("fine_waves", 96, held_voxels=1 << 14, finest_px=finest)
        errors.append(bounds.worst(picture, bounds.whole("fine_waves", 96)))
        bytes_fetched.append(fetched)
    assert errors[0] <= 1.0 and errors[1] > 10.0 and bytes_fetched[1] < bytes_fetched[0], (errors, bytes_fetched)


@pytest.mark.parametrize(
    "light", [{"shade": "phong"}, {"gradient_opacity": (0, 40)}, {"projection": "orthographic"}, {"projection": "orthographic", "shade": "phong"}]
)
def test_light_and_parallel_rays_cross_bricks_as_they_cross_the_whole(waves, light):
    options = dict(light)
    camera = {**VIEW["camera"], "projection": options.pop("projection", "perspective")}
    if camera["projection"] == "orthographic":
        camera["height"] = 260
    view = {"camera": camera, "size": (48, 40)}
    picture = pyramid(waves, **options).render(**view)
    voxels = waves.voxels(0, [0, 0, 0], SHAPE)
    exact = fr.volsplat(voxels, transfer=TRANSFER, opacity_unit=6.0, subpixels=4, **view, **options)
    # Gradients of a brick reach a voxel beyond it, so that what differs from the whole is its level, which 1/255 bounds.
    assert bounds.worst(picture, np.asarray(exact)) <= 1.0
    if options:
        plain = fr.volsplat(voxels, transfer=TRANSFER, opacity_unit=6.0, subpixels=4, **view)
        assert bounds.worst(plain, np.asarray(exact)) > 10.0


def test_what_a_pyramid_has_not_is_refused(waves):
    for words in ({"blend": "maximum"}, {"iso": 3.0}, {"layers": "first-hit"}, {"occlusion": True}, {"shadows": True}):
        with pytest.raises(ValueError, match="brick by brick"):
            pyramid(waves, **words)
    with pytest.raises(ValueError, match="transfer"):
        fr.Pyramid(zarr.open_group(waves, mode="r"), "viridis")
    assert len(list(pyramid(waves).pictures(turntable=2, size=(16, 16)))) == 2
