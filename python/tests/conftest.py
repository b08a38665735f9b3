"""Scenes that several tests draw, and the command line that they are compared with."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def resample():
    """Runs the command line, which RESAMPLE names; else that of this checkout."""
    named = os.environ.get("RESAMPLE")
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    built = [target / profile / "resample" for profile in ("release", "debug")]
    found = [Path(named)] if named else [path for path in built if path.exists()]
    if not found:
        pytest.fail("no command line to compare with: build it (cargo build --release), or name it by RESAMPLE")

    def run(*words):
        done = subprocess.run([found[0], *map(str, words)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done

    return run


@pytest.fixture(scope="session")
def blob():
    """A soft shape without symmetry, float32 [z][y][x]."""
    z, y, x = np.mgrid[-1:1:24j, -1:1:32j, -1:1:40j]
    near = np.exp(-6 * ((x - 0.2) ** 2 + (y + 0.1) ** 2 + z**2))
    far = 0.7 * np.exp(-12 * ((x + 0.5) ** 2 + (y - 0.3) ** 2 + (z - 0.2) ** 2))
    return (near + far).astype(np.float32)


def read_png(path):
    """The codes of an 8-bit PNG, as Pillow reads them."""
    from PIL import Image

    return np.asarray(Image.open(path).convert("RGBA"))


def python(code, **options):
    """Runs Python in a process of its own."""
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
