"""Pictures by processes of MPI, where it is installed."""

import os
import shutil
import subprocess
import sys

import pytest

pytest.importorskip("mpi4py")

CODE = """
import numpy as np
import forward_resample as fr
from forward_resample import distributed
from mpi4py.futures import MPIPoolExecutor

if __name__ == "__main__":
    volume = fr.Volume(np.arange(4096, dtype=np.uint16).reshape(16, 16, 16), size=(64, 48))
    with MPIPoolExecutor() as executor:
        pictures = distributed.render(volume, executor, tile=(32, 32), turntable=3)
    assert all(map(np.array_equal, pictures, volume.turntable(3)))
    print("the same pictures")
"""


@pytest.mark.skipif(shutil.which("mpirun") is None, reason="there is no mpirun")
def test_pictures_by_mpi(tmp_path):
    (tmp_path / "draw.py").write_text(CODE)
    # One process gives the tasks, two draw.
    words = ["mpirun", "--oversubscribe", "-n", "3", sys.executable, "-m", "mpi4py.futures", "draw.py"]
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120, env={**os.environ, **allowed})
    assert "the same pictures" in done.stdout, done.stderr
