"""Pictures in parts by Ray, of whose workers one is killed."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import forward_resample as fr
from forward_resample import distributed

ray = pytest.importorskip("ray")


@pytest.fixture(scope="module", autouse=True)
def workers():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def pids():
    """The processes of both workers: each is busy while the other is asked."""

    @ray.remote
    def own():
        time.sleep(1.0)
        return os.getpid()

    return set(ray.get([own.remote(), own.remote()]))


def test_a_killed_worker_loses_nothing(blob):
    volume = fr.Volume(blob, size=(400, 300), slab=0.2, subpixels=4)
    expected = volume.turntable(6)
    before = pids()
    killed = threading.Timer(0.5, lambda: os.kill(next(iter(before)), signal.SIGKILL))
    killed.start()
    pictures = distributed.render(volume, ray, tile=(400, 48), turntable=6)
    killed.join()
    assert len(pictures) == 6 and all(map(np.array_equal, pictures, expected))
    assert pids() != before, "no worker was killed"
