"""A turntable by the workers of Dask: the same bytes, in order."""

import numpy as np
from dask.distributed import Client, LocalCluster

import forward_resample as fr
from forward_resample import distributed

if __name__ == "__main__":
    z, y, x = np.mgrid[-1:1:64j, -1:1:64j, -1:1:64j]
    volume = fr.Volume(np.exp(-9 * (x**2 + y**4 + z**2)).astype(np.float32), size=(160, 120))
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        pictures = distributed.render(volume, client, turntable=8)
    assert all(map(np.array_equal, pictures, volume.turntable(8)))
    fr.write_film("on_dask.apng", pictures)
