"""A pyramid that nobody wrote: every chunk is computed when it is asked for, so that it may be of any size."""

import json
import math

import numpy as np
from numcodecs import Zstd
from zarr.abc.store import Store
from zarr.core.buffer import cpu

#: Wave lengths along x, y and z in voxels, amplitudes and phases: waves of all lengths, whose means over blocks are known.
WAVES = [
    ((9000.0, 7000.0, 5200.0), 46.0, 0.3),
    ((-3100.0, 4700.0, 2900.0), 30.0, 1.1),
    ((1700.0, 1500.0, -1900.0), 10.0, 2.3),
    ((640.0, -770.0, 690.0), 4.0, 0.7),
    ((210.0, 230.0, 190.0), 2.5, 1.9),
    ((61.0, -57.0, 67.0), 0.8, 2.9),
]


class Waves(Store):
    """An OME-Zarr image of bytes with levels that halve the one before."""

    _is_open = True

    def __init__(self, shape=(4096, 16384, 16384), chunk=64, scale=1.0):
        super().__init__(read_only=True)
        self.shape, self.chunk, self.scale = tuple(shape), chunk, scale
        self.count = max(1, int(math.log2(max(shape) / chunk)) + 1)

    def __eq__(self, other):
        return isinstance(other, Waves) and vars(self) == vars(other)

    def __reduce__(self):
        return Waves, (self.shape, self.chunk, self.scale)

    def __str__(self):
        return f"waves {self.shape} {self.chunk} {self.scale}"

    def level_shape(self, level):
        return [-(-side // 2**level) for side in self.shape]

    def voxels(self, level, first, size):
        """The voxels [z][y][x] of a box of a level: means of the finest ones."""
        step = 2.0**level
        sum_ = np.full(size, 96.0)
        for lengths, amplitude, phase in WAVES:
            factors = []
            for axis, length in enumerate(lengths[::-1]):
                turn = 2 * math.pi / (length * self.scale)
                # The mean of step cosines, evenly spaced around the middle.
                damped = 1.0 if step == 1 else math.sin(turn * step / 2) / (step * math.sin(turn / 2))
                place = (np.arange(size[axis]) + first[axis] + 0.5) * step - 0.5
                factors.append(damped * np.exp(1j * turn * place))
            z, y, x = factors
            part = z[:, None, None] * y[None, :, None] * (amplitude * np.exp(1j * phase) * x)[None, None, :]
            sum_ += part.real
        return np.clip(np.round(sum_), 0, 255).astype(np.uint8)

    def value(self, key):
        if key == "zarr.json":
            scales = [[2.0**level] * 3 for level in range(self.count)]
            datasets = [
                {"path": str(level), "coordinateTransformations": [{"type": "scale", "scale": scale}]} for level, scale in enumerate(scales)
            ]
            axes = [{"name": name, "type": "space"} for name in "zyx"]
            ome = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": datasets}]}
            return json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {"ome": ome}}).encode()
        level, _, rest = key.partition("/")
        if not level.isdigit() or int(level) >= self.count:
            return None
        if rest == "zarr.json":
            return json.dumps(self.metadata(int(level))).encode()
        if not rest.startswith("c/"):
            return None
        place = [int(word) for word in rest[2:].split("/")]
        voxels = self.voxels(int(level), [index * self.chunk for index in place], [self.chunk] * 3)
        return Zstd(level=1).encode(voxels.tobytes())

    def metadata(self, level):
        return {
            "zarr_format": 3,
            "node_type": "array",
            "shape": self.level_shape(level),
            "data_type": "uint8",
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [self.chunk] * 3}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
            "fill_value": 0,
            "codecs": [{"name": "bytes"}, {"name": "zstd", "configuration": {"level": 1, "checksum": False}}],
            "attributes": {},
        }

    async def get(self, key, prototype=None, byte_range=None):
        value = self.value(key)
        return None if value is None else cpu.Buffer.from_bytes(value)

    async def get_partial_values(self, prototype, key_ranges):
        return [await self.get(key, prototype) for key, _ in key_ranges]

    async def exists(self, key):
        return self.value(key) is not None

    supports_writes = supports_deletes = supports_partial_writes = False
    supports_listing = False

    async def set(self, key, value, byte_range=None):
        raise NotImplementedError

    async def delete(self, key):
        raise NotImplementedError

    async def list(self):
        return
        yield

    async def list_prefix(self, prefix):
        return
        yield

    async def list_dir(self, prefix):
        return
        yield


def main(words):
    """`python virtual.py [FINEST_PX [WORKERS]]`: a picture of 1.1 TB, and what it took."""
    import resource
    import tempfile
    import time

    import zarr
    from distributed import Client, LocalCluster

    import forward_resample as fr
    from forward_resample import distributed

    finest, workers = float(words[0]) if words else 1.0, int(words[1]) if len(words) > 1 else 1
    colours, opacities = [[0.2, 0, 0.4], [0, 0.6, 0.5], [1, 1, 0.2]], [0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8, 0.9]
    transfer = fr.transfer_function(colours, opacities, clim=(0, 255))
    with tempfile.TemporaryDirectory() as cache, LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            group = zarr.open_group(Waves(), mode="r")
            volume = fr.Pyramid(group, transfer, opacity_unit=400.0, cache=cache, finest_px=finest, threads=1)
            start = time.time()
            picture = distributed.render(volume, client, tile=(256, 256), size=(1024, 1024), subpixels=2)[0]
            seconds = time.time() - start
            usage = client.run(lambda: resource.getrusage(resource.RUSAGE_SELF)).values()
    parts = picture.stats["parts"]
    total = {name: sum(part[name] for part in parts) for name in parts[0]}
    print(f"finest_px={finest:g}, {workers} workers: {seconds:.0f} s, {sum(one.ru_utime + one.ru_stime for one in usage):.0f} s of CPU time")
    print(f"{max(one.ru_maxrss for one in usage) / 1e6:.2f} GB a worker; {total}")
    picture.save(f"virtual-{finest:g}.png")


if __name__ == "__main__":
    import sys

    main(sys.argv[1:])
