"""Other threads go on while a picture is drawn, and Ctrl-C ends the wait for it."""

import os
import signal
import threading
import time

import numpy as np

import forward_resample as fr
from conftest import python

#: A picture that takes long: every sample of noise, many sub-pixels.
SLOW = """
import signal, sys, numpy as np, forward_resample as fr
# A shell that starts tests in the background has children ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
noise = np.random.default_rng(1).integers(0, 255, (64, 64, 64)).astype(np.uint8)
volume = fr.Volume(noise, size=(2500, 2500), slab=0.5, subpixels=4, min_transmittance=0, opacity_scale=0.01)
print("ready", flush=True)
"""


def test_other_threads_go_on(blob):
    volume = fr.Volume(blob, size=(1000, 1000), slab=0.2, subpixels=4)
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.wait(0.002):
            ticks.append(time.perf_counter())

    clock = threading.Thread(target=tick)
    clock.start()
    start = time.perf_counter()
    volume.render()
    end = time.perf_counter()
    stop.set()
    clock.join()
    during = [tick for tick in ticks if start < tick < end]
    assert end - start > 0.1, "the picture is too quick to show anything"
    # With the lock held there would be none.
    assert len(during) > 10 * (end - start), (len(during), end - start)


def test_scenes_are_drawn_by_several_threads(blob):
    volume = fr.Volume(blob, size=(64, 48))
    expected = {azimuth: volume.render(orbit=(azimuth, 20)) for azimuth in (0, 50, 100)}
    wrong = []

    def draw(azimuth, own):
        for _ in range(5):
            picture = own.render(orbit=(azimuth, 20))
            if not np.array_equal(picture, expected[azimuth]):
                wrong.append(azimuth)

    threads = [threading.Thread(target=draw, args=(azimuth, fr.Volume(blob, size=(64, 48), threads=1))) for azimuth in expected]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def interrupted(code):
    """Seconds from Ctrl-C to the end of a process, and what it printed."""
    process = python(SLOW + code)
    assert process.stdout.readline().strip() == "ready"
    time.sleep(1.0)
    start = time.perf_counter()
    os.kill(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    return time.perf_counter() - start, out + err


def test_ctrl_c_ends_a_picture():
    seconds, text = interrupted("volume.render()")
    assert "KeyboardInterrupt" in text, text
    assert seconds < 5.0, seconds


def test_a_scene_is_good_after_ctrl_c():
    code = """
import time
try:
    volume.render()
except KeyboardInterrupt:
    start = time.perf_counter()
    picture = volume.render(size=(40, 30), slab=1, subpixels=1)
    print(picture.shape, bool((picture[..., 3] > 0).any()))
"""
    _, text = interrupted(code)
    assert "(30, 40, 4) True" in text, text


def test_ctrl_c_ends_a_film(tmp_path):
    seconds, text = interrupted(f"volume.write({str(tmp_path / 'a.apng')!r}, turntable=100)")
    assert "KeyboardInterrupt" in text, text
    assert list(tmp_path.glob("*.apng")) == []


def test_progress(blob):
    shares = []
    fr.Volume(blob).turntable(4, size=(200, 200), progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0


def test_a_bar_of_tqdm(blob, capsys):
    fr.volsplat(blob, size=(20, 20), progress=True)
    assert "100%" in capsys.readouterr().err
