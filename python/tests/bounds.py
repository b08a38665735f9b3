"""Pyramids against the pictures of all their voxels: `python bounds.py [SIDE [MAX_ERROR]]` prints a table for `finest_px`.

Each scene is a cube of bytes with its levels, seen at about 2.7 voxels a pixel. A cell has the largest error of a pixel in 1/255 against
the picture of all voxels from the same samples, the bytes fetched, and CPU time. How far those samples are from 8x8 in each pixel and
quarter slabs is a column of its own: it is no matter of levels.
"""

import functools
import sys
import time

import numpy as np
import zarr

import forward_resample as fr

#: Voxels of the whole cube per pixel of the picture.
VOXELS_PX = 2.7

CLEAR_BELOW = [0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8, 0.9]


def grid(side):
    return np.meshgrid(*[np.arange(side, dtype=np.float32)] * 3, indexing="ij", sparse=True)


def waves(side, lengths, amplitude):
    z, y, x = (2 * np.pi * axis for axis in grid(side))
    field = np.full((side,) * 3, 110.0, np.float32)
    for number, length in enumerate(lengths):
        a, b, c = length * np.array([1.0, 0.83, 1.21][number % 3 :] + [1.0, 0.83, 1.21][: number % 3])
        field += amplitude / len(lengths) * np.cos(x / a + number) * np.cos(y / b + 2.0 * number) * np.cos(z / c - number)
    return field


def distance(side, centre, radius):
    z, y, x = grid(side)
    near = np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2)
    return near - radius


def smooth(side):
    return waves(side, [side / 2, side / 3.3, side / 5.1], 110.0), CLEAR_BELOW, 6.0


def fine_waves(side):
    return waves(side, [6.0], 110.0), CLEAR_BELOW, 6.0


def shells(side):
    """Shells of two voxels, one within another."""
    field = np.zeros((side,) * 3, np.float32)
    for part in (0.15, 0.28, 0.42):
        field += 220 * np.exp(-((distance(side, (side * 0.48,) * 3, side * part) / 1.2) ** 2))
    return field, [0, 0.05, 0.2, 0.5, 0.7], 4.0


def spots(side):
    """A bright spot of some three voxels in each 60000."""
    field = np.zeros((side,) * 3, np.float32)
    rng = np.random.default_rng(7)
    z, y, x = np.mgrid[-4:5, -4:5, -4:5]
    spot = 240 * np.exp(-(x**2 + y**2 + z**2) / 3.0)
    for a, b, c in rng.integers(5, side - 5, (side**3 // 60000, 3)):
        field[a - 4 : a + 5, b - 4 : b + 5, c - 4 : c + 5] += spot
    return field, [0, 0, 0.1, 0.4, 0.8], 2.0


def boxes(side):
    """Boxes with hard edges, and noise within them."""
    rng = np.random.default_rng(8)
    field = np.zeros((side,) * 3, np.float32)
    for _ in range(30):
        low = rng.integers(0, side - side // 8, 3)
        box = tuple(slice(first, first + size) for first, size in zip(low, rng.integers(3, side // 4, 3)))
        field[box] = rng.uniform(60, 220)
    field[field > 0] += rng.normal(0, 25, int((field > 0).sum())).astype(np.float32)
    return field, [0, 0, 0.1, 0.2, 0.6], 8.0


def hidden(side):
    """Waves of 6 voxels behind a wall."""
    field = waves(side, [6.0], 110.0)
    wall = np.minimum(np.abs(grid(side)[0] - side * 0.2), 20) < 12
    field[np.broadcast_to(wall, field.shape)] = 250
    return field, [0, 0, 0, 0.05, 0.1, 0.2, 0.4, 0.6, 1.0], 3.0


def fibres(side):
    """Straight fibres of some three voxels, in every direction."""
    field = np.zeros((side,) * 3, np.float32)
    rng = np.random.default_rng(21)
    ends = rng.uniform(4, side - 4, (side // 4, 2, 3))
    for first, last in ends:
        for place in np.linspace(first, last, 2 * side):
            low = np.floor(place).astype(int) - 1
            box = np.mgrid[tuple(slice(a, a + 4) for a in low)]
            near = 230 * np.exp(-(sum((axis - a) ** 2 for axis, a in zip(box, place))) / 1.5)
            cells = tuple(slice(a, a + 4) for a in low)
            field[cells] = np.maximum(field[cells], near)
    return field, [0, 0, 0.2, 0.5, 0.8], 3.0


def gyroid(side):
    """Sheets of a gyroid of 40 voxels, drawn as a narrow peak."""
    z, y, x = (2 * np.pi * axis / 40 for axis in grid(side))
    field = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return 128 + 80 * field, [0] * 8 + [0.6] + [0] * 8, 3.0


def texture(side):
    """Noise of all lengths, as tissue has it."""
    rng = np.random.default_rng(22)
    spectrum = np.fft.rfftn(rng.normal(0, 1, (side,) * 3).astype(np.float32))
    z, y = (np.fft.fftfreq(side)[(slice(None),) + (None,) * more] for more in (2, 1))
    length = np.sqrt(z**2 + y**2 + np.fft.rfftfreq(side) ** 2) + 1.0 / side
    field = np.fft.irfftn(spectrum / length**1.7, s=(side,) * 3, axes=(0, 1, 2))
    return (110 + 45 * field / field.std()).astype(np.float32), [0, 0, 0, 0.05, 0.2, 0.4, 0.5, 0.7, 0.9], 12.0


def glass(side):
    """A hard-edged checkerboard of 12 voxels behind a clear wall."""
    z, y, x = grid(side)
    field = 90.0 + 100.0 * ((x // 12 + y // 12 + z // 12) % 2)
    field[: side // 3] = 30
    return field.astype(np.float32), [0, 0.01, 0.1, 0.1, 0.5], 6.0


#: The scenes that the rule was chosen by, and those that were made after it was.
CHOSEN_BY = [smooth, fine_waves, shells, spots, boxes, hidden]
MADE_AFTER = [fibres, gyroid, texture, glass]
SCENES = {scene.__name__: scene for scene in CHOSEN_BY + MADE_AFTER}


@functools.cache
def made(name, side):
    """The voxels of a scene, its group of Zarr, and how it is looked at."""
    field, opacities, unit = SCENES[name](side)
    voxels = np.clip(np.round(field), 0, 255).astype(np.uint8)
    transfer = fr.transfer_function([[0.2, 0, 0.4], [0, 0.6, 0.5], [1, 1, 0.2]], opacities, clim=(0, 255))
    group = zarr.create_group(zarr.storage.MemoryStore())
    level, datasets, field = voxels, [], voxels.astype(np.float32)
    for number in range(max(1, int(np.log2(side / 48)) + 1)):
        array = group.create_array(str(number), shape=level.shape, chunks=(32,) * 3, dtype="u1")
        array[:] = level
        datasets.append({"path": str(number), "coordinateTransformations": [{"type": "scale", "scale": [2.0**number] * 3}]})
        half = field.shape[0] // 2
        field = field.reshape(half, 2, half, 2, half, 2).mean((1, 3, 5))
        level = np.clip(np.round(field), 0, 255).astype(np.uint8)
    axes = [{"name": name, "type": "space"} for name in "zyx"]
    group.attrs["ome"] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": datasets}]}
    camera = {"position": [side * 1.3, side * 1.1, -side * 2.6], "target": [side / 2] * 3, "up": [0, -1, 0], "fov_y": 21}
    size = (round(side * 1.25 / VOXELS_PX),) * 2
    return voxels, group, {"transfer": transfer, "opacity_unit": unit, "camera": camera, "size": size}


@functools.cache
def whole(name, side, subpixels=4, **sampling):
    """The picture of all voxels."""
    voxels, _, look = made(name, side)
    return np.asarray(fr.volsplat(voxels, subpixels=subpixels, **look, **sampling))


def by_levels(name, side, held_voxels=1 << 17, **options):
    """The picture of the pyramid, its bytes fetched and its CPU seconds."""
    _, group, look = made(name, side)
    view = {key: look[key] for key in ("camera", "size")}
    start = time.process_time()
    pyramid = fr.Pyramid(group, look["transfer"], opacity_unit=look["opacity_unit"], held_voxels=held_voxels, **options)
    picture = pyramid.render(**view)
    parts = picture.stats.get("parts", [picture.stats])
    return np.asarray(picture), sum(part["bytes_fetched"] for part in parts), time.process_time() - start


def worst(picture, other):
    """The largest difference of two pictures in 1/255."""
    return 255 * float(np.abs(picture - other).max())


def table(side, choices, **options):
    print("| scene | samples alone | " + " | ".join(f"{finest:g} px" for finest in choices) + " |")
    print("|---" * (2 + len(choices)) + "|")
    for name in SCENES:
        same = whole(name, side)
        cells = [f"{worst(same, whole(name, side, subpixels=8, slab=0.25)):.2f}"]
        for finest in choices:
            picture, fetched, seconds = by_levels(name, side, finest_px=finest, **options)
            cells.append(f"{worst(picture, same):.2f}, {fetched / 1e6:.2f} MB, {seconds:.1f} s")
        print(f"| {name.replace('_', ' ')} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    side = int(words[0]) if words else 384
    table(side, [2.0, 1.0, 0.5, 0.25], max_error=words[1] if len(words) > 1 else "1/255")
