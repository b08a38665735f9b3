"""A turntable by the workers of Ray: the same bytes, in order."""

import numpy as np
import ray

import forward_resample as fr
from forward_resample import distributed

if __name__ == "__main__":
    z, y, x = np.mgrid[-1:1:64j, -1:1:64j, -1:1:64j]
    volume = fr.Volume(np.exp(-9 * (x**2 + y**4 + z**2)).astype(np.float32), size=(160, 120))
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    pictures = distributed.render(volume, ray, turntable=8)
    assert all(map(np.array_equal, pictures, volume.turntable(8)))
    fr.write_film("on_ray.apng", pictures)
    ray.shutdown()
