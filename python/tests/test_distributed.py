"""Pictures in parts, by processes of which one is killed."""

import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest

import forward_resample as fr
from forward_resample import distributed

dask = pytest.importorskip("distributed")

SIZE = {"size": (96, 80)}


@pytest.fixture(scope="module")
def client():
    with dask.LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None) as cluster, dask.Client(cluster) as client:
        yield client


def same(pictures, expected):
    return len(pictures) == len(expected) and all(map(np.array_equal, pictures, expected))


@pytest.mark.parametrize("tile", [None, (96, 16), (50, 48)])
def test_pictures_by_dask(client, blob, tile):
    volume = fr.Volume(blob, **SIZE)
    options = {"turntable": 4, "background": "white", "layers": "first-hit"}
    pictures = distributed.render(volume, client, tile=tile, **options)
    expected = volume.turntable(4, **{name: value for name, value in options.items() if name != "turntable"})
    assert same(pictures, expected)
    assert all(np.array_equal(a.planes[name], b.planes[name]) for a, b in zip(pictures, expected) for name in b.planes)


def test_a_film_of_a_file(client, blob, tmp_path):
    np.save(tmp_path / "a.npy", blob)
    volume = fr.Volume(tmp_path / "a.npy", **SIZE)
    volume.set_transfer("magma")
    assert same(distributed.render(volume, client, turntable=9), volume.turntable(9))


def test_warps_are_split_by_pictures(client):
    K = [[50, 0, 31.5], [0, 50, 23.5], [0, 0, 1]]
    image = fr.DepthImage(np.full((48, 64, 3), 128, np.uint8), np.full((48, 64), 2.0), K)
    poses = np.stack([np.eye(4)] * 3)
    poses[:, 0, 3] = [0.0, 0.1, 0.2]
    assert same(distributed.render(image, client, **image.to(poses)), list(image.pictures(**image.to(poses))))


def test_a_killed_worker_loses_nothing(client, blob):
    volume = fr.Volume(blob, size=(400, 300), slab=0.2, subpixels=4)
    expected = volume.turntable(8)
    before = client.run(os.getpid)
    killed = threading.Timer(1.0, lambda: os.kill(next(iter(before.values())), signal.SIGKILL))
    killed.start()
    pictures = distributed.render(volume, client, tile=(208, 48), turntable=8)
    killed.join()
    assert same(pictures, expected)
    deadline = time.time() + 30
    while set(client.run(os.getpid).values()) == set(before.values()) and time.time() < deadline:
        time.sleep(0.2)
    assert set(client.run(os.getpid).values()) != set(before.values()), "no worker was killed"


def test_errors_of_workers_are_those_of_one_process(client, blob):
    volume = fr.Volume(blob)
    for error, options in ((TypeError, {"slabb": 1}), (ValueError, {"slab": -1}), (ValueError, {"max_time": "1s"})):
        with pytest.raises(error):
            distributed.render(volume, client, **options)
    with pytest.raises(TypeError, match="expected a client"):
        distributed.render(volume, None)


def test_unlike_processors_are_refused(blob):
    class Unlike:
        """An executor whose second worker is of another kind."""

        def submit(self, call, recipe, token, task):
            part = call(recipe, token, task)
            part = part._replace(level="baseline") if any((task.columns[0], task.rows[0])) else part

            class Done:
                def result(self):
                    return part

            return Done()

    with pytest.raises(RuntimeError, match="vector_level='baseline'"):
        distributed.render(fr.Volume(blob, **SIZE), Unlike(), tile=(96, 16))


def test_vector_levels(blob):
    # Automatic views are fitted to what is drawn, and so depend on the level in their last digits too.
    place = {"camera": ((60, 40, 50), (20, 16, 12), (0, 1, 0)), **SIZE}
    automatic = fr.volsplat(blob, **place)
    baseline = fr.volsplat(blob, vector_level="baseline", **place)
    assert np.allclose(automatic, baseline, atol=1e-4)
    triangle = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert np.allclose(fr.texmap(*triangle, **SIZE), fr.texmap(*triangle, vector_level="avx2", **SIZE), atol=1e-4)


def test_scenes_are_sent(blob):
    volume = fr.Volume(blob, spacing=(1, 2, 1), **SIZE)
    volume.set_transfer(window=(0.5, 0.5))
    assert np.array_equal(pickle.loads(pickle.dumps(volume)).render(), volume.render())
