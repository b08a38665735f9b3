#!/usr/bin/env python3
"""Writes the generated inputs of the digest suite into a folder: volumes, meshes, depth images, cameras, colours.

Takes the name of the folder. Needs nothing but Python's own library. All noise comes from a hash of whole numbers, so
every run on one machine writes the same bytes.
"""

import base64
import json
import math
import os
import struct
import sys
import zlib
from array import array

FOLDER = sys.argv[1]


def write(name, data):
    path = os.path.join(FOLDER, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(data if isinstance(data, bytes) else data.encode())


def write_json(name, value):
    write(name, json.dumps(value))


def noise(*numbers):
    """A number from 0 to 1 that depends on whole numbers alone."""
    h = 2166136261
    for n in numbers:
        h = ((h ^ (n & 0xFFFF)) * 16777619) & 0xFFFFFFFF
        h ^= h >> 13
    h = (h * 2246822519) & 0xFFFFFFFF
    return ((h ^ (h >> 15)) & 0xFFFF) / 65535.0


def packed(kind, values):
    """Bytes of numbers, little-endian: one of array's letters."""
    if kind in "bBhHiI":
        values = [int(v) for v in values]
    numbers = array(kind, values)
    if sys.byteorder == "big":
        numbers.byteswap()
    return numbers.tobytes()


def npy(name, kind, shape, values):
    descr = {"B": "|u1", "h": "<i2", "H": "<u2", "f": "<f4", "d": "<f8"}[kind]
    header = "{'descr': '%s', 'fortran_order': False, 'shape': %s, }" % (descr, tuple(shape))
    header += " " * (-(len(header) + 11) % 64) + "\n"
    write(name, b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + packed(kind, values))


def png(name, size, channels, bits, values):
    """A PNG of 1, 3 or 4 channels, 8 or 16 bits, rows from the top."""
    width, height = size
    row = width * channels
    form = ">%d%s" % (row, "B" if bits == 8 else "H")
    lines = b"".join(b"\0" + struct.pack(form, *values[y * row : (y + 1) * row]) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, bits, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")
    write(name, data)
    return data


def tiff(name, pages, size, bits, samples, sample_format, data_of):
    """A little-endian TIFF, one strip a page."""
    width, height = size
    out = bytearray(b"II*\0\0\0\0\0")
    place = 4
    for page in range(pages):
        data = data_of(page)
        data_at = len(out)
        out += data + b"\0" * (len(data) % 2)
        bits_at = len(out)
        out += struct.pack("<%dH" % samples, *([bits] * samples)) + b"\0" * 2
        out += b"\0" * (len(out) % 2)
        tags = [
            (256, 4, 1, width), (257, 4, 1, height),
            (258, 3, samples, bits if samples == 1 else bits_at), (259, 3, 1, 1),
            (262, 3, 1, 1 if samples == 1 else 2), (273, 4, 1, data_at), (277, 3, 1, samples),
            (278, 4, 1, height), (279, 4, 1, len(data)), (339, 3, 1, sample_format),
        ]
        struct.pack_into("<I", out, place, len(out))
        out += struct.pack("<H", len(tags))
        for tag, kind, count, value in tags:
            if tag == 339 and samples > 1:
                kind, count, value = 3, 1, sample_format
            out += struct.pack("<HHII", tag, kind, count, value)
        place = len(out)
        out += b"\0\0\0\0"
    write(name, bytes(out))


# ---- Volumes -------------------------------------------------------------------------------------------------------

DIMS = (48, 44, 40)
BUMPS = [((16, 14, 12), 6.5, 210), ((31, 28, 26), 8.0, 170), ((20, 32, 30), 4.0, 255), ((36, 12, 20), 3.0, 240)]


def blob_values():
    """Soft bumps with a little noise, 0 to about 255, x fastest."""
    rows = []
    for centre, radius, height in BUMPS:
        axes = [[math.exp(-((i - c) ** 2) / (2 * radius**2)) for i in range(n)] for c, n in zip(centre, DIMS)]
        rows.append((height, axes))
    out = []
    for z in range(DIMS[2]):
        for y in range(DIMS[1]):
            parts = [(h * a[1][y] * a[2][z], a[0]) for h, a in rows]
            for x in range(DIMS[0]):
                value = sum(part * axis[x] for part, axis in parts)
                out.append(min(255.0, value + 6 * noise(x, y, z)))
    return out


def nrrd(name, kind, dims, data, lines=()):
    head = ["NRRD0004", "type: " + kind, "dimension: %d" % len(dims), "sizes: " + " ".join(map(str, dims)),
            "encoding: raw", "endian: little", *lines]
    write(name, "\n".join(head).encode() + b"\n\n" + data)


def volumes():
    blob = blob_values()
    x, y, z = DIMS
    nrrd("blob.nrrd", "uint8", DIMS, packed("B", blob), ["spacings: 1 1.2 0.9"])
    nrrd("blob_u16.nrrd", "uint16", DIMS, packed("H", [v * 200 for v in blob]), ["spacings: 1 1 1"])
    npy("blob_f32.npy", "f", (z, y, x), blob)
    npy("blob_f64.npy", "d", (z, y, x), blob)
    holes = [math.nan if noise(i, 7) < 0.01 else v for i, v in enumerate(blob)]
    npy("blob_nan.npy", "f", (z, y, x), holes)
    swapped = b"".join(struct.pack(">h", int(v * 8 - 1000)) for v in blob)
    write("blob_i16be.raw", b"\x55" * 16 + swapped)
    write("blob_u8.raw", packed("B", blob))
    write("oblique.mha", b"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
          b"TransformMatrix = 0.8 0.6 0 -0.48 0.64 0.6 0.36 -0.48 0.8\nOffset = 5 -3 12\nElementSpacing = 1 1.5 0.75\n"
          + ("DimSize = %d %d %d\n" % DIMS).encode() + b"ElementType = MET_FLOAT\nElementDataFile = LOCAL\n"
          + packed("f", blob))
    # Three components, the first axis of the file.
    second = [0.6 * v if i % x < 24 else 0.1 * v for i, v in enumerate(blob)]
    third = [255 - v if v > 40 else 0 for v in blob]
    inter = [c for triple in zip(blob, second, third) for c in triple]
    nrrd("three.nrrd", "uint8", (3, *DIMS), packed("B", inter), ["kinds: vector domain domain domain"])
    # Labels in blocks, 0 outside.
    labels = []
    for k in range(z):
        for j in range(y):
            for i in range(x):
                value = blob[(k * y + j) * x + i]
                labels.append(0 if value < 50 else 1 + (i // 16) + 3 * (k // 20))
    nrrd("labels.nrrd", "uint8", DIMS, packed("B", labels), ["spacings: 1 1.2 0.9"])
    mask = [1 if (i % x - 22) ** 2 + (i // x % y - 24) ** 2 + (i // (x * y) - 22) ** 2 < 260 else 0
            for i in range(x * y * z)]
    nrrd("mask.nrrd", "uint8", DIMS, packed("B", mask), ["spacings: 1 1.2 0.9"])
    # A box of opaque cells, and noise: sharp edges, and values that no neighbour has.
    n = 40
    cells = [0 if min(i, j, k, n - 1 - i, n - 1 - j, n - 1 - k) < 4 else (60, 200)[(i // 8 + j // 8 + k // 8) % 2]
             for k in range(n) for j in range(n) for i in range(n)]
    nrrd("checker.nrrd", "uint8", (n, n, n), packed("B", cells), ["spacings: 1 1 1"])
    # Large cells of one value each, for merged blocks.
    n = 72
    cells = [0 if min(i, j, k, n - 1 - i, n - 1 - j, n - 1 - k) < 4 else (90, 150, 230)[(i // 32 + j // 32 + k // 32) % 3]
             for k in range(n) for j in range(n) for i in range(n)]
    nrrd("cells.nrrd", "uint8", (n, n, n), packed("B", cells), ["spacings: 1 1 1"])
    n = 24
    dots = [int(65535 * noise(i, j, k)) for k in range(n) for j in range(n) for i in range(n)]
    npy("noise_u16.npy", "H", (n, n, n), dots)
    npy("slice.npy", "f", (1, y, x), blob[20 * x * y : 21 * x * y])
    npy("constant.npy", "B", (8, 8, 8), [9] * 512)
    tiff("stack.tif", z, (x, y), 16, 1, 1, lambda p: packed("H", [v * 100 for v in blob[p * x * y : (p + 1) * x * y]]))
    # A longer one, for reading brick by brick.
    n = 112
    wide = [max(0, 255 - 6 * abs(math.isqrt((i - 56) ** 2 + (j - 50) ** 2 + (k - 60) ** 2) - 34))
            if (i * 7 + j * 5 + k * 3) % 64 else 30 for k in range(n) for j in range(n) for i in range(n)]
    write("wide_u8.raw", packed("B", wide))
    nrrd("wide.nrrd", "uint8", (n, n, n), packed("B", wide), ["spacings: 1 1 1.3"])
    write("wide.mha", b"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
          b"ElementSpacing = 1 1 1\nDimSize = 112 112 112\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
          + packed("B", wide))


def transfers():
    def paraview(name, colours, opacities):
        points = [n for value, opacity in opacities for n in (value, opacity, 0.5, 0.0)]
        entry = {"Name": name, "ColorSpace": "RGB", "RGBPoints": [n for row in colours for n in row]}
        if opacities:
            entry["Points"] = points
        write_json(name + ".json", [entry])

    paraview("tf", [(0, 0.05, 0.1, 0.4), (90, 0.1, 0.7, 0.3), (170, 0.9, 0.6, 0.1), (255, 1, 0.9, 0.8)],
             [(0, 0), (30, 0), (80, 0.05), (150, 0.3), (255, 0.9)])
    paraview("tf_sharp", [(0, 0.2, 0.2, 0.9), (119, 0.2, 0.2, 0.9), (120, 0.9, 0.3, 0.1), (255, 0.9, 0.9, 0.2)],
             [(0, 0), (59, 0), (60, 0.25), (70, 0.25), (71, 0), (119, 0), (120, 0.95), (255, 0.95)])
    paraview("tf_thin", [(0, 0.3, 0.4, 0.9), (255, 1, 0.8, 0.4)], [(0, 0), (40, 0.002), (255, 0.03)])
    paraview("tf_unit", [(0, 0, 0, 0.3), (0.5, 0.8, 0.2, 0.2), (1, 1, 1, 0.7)], [(0, 0), (0.3, 0), (1, 0.5)])
    paraview("tf_colours", [(0, 0, 0, 0.3), (128, 0.8, 0.2, 0.2), (255, 1, 1, 0.7)], [])
    paraview("tf_solid", [(0, 0.2, 0.5, 0.9), (255, 0.9, 0.5, 0.2)], [(0, 0), (40, 0), (60, 1), (255, 1)])
    paraview("tf_noise", [(0, 0.1, 0.3, 0.8), (65535, 0.9, 0.8, 0.1)], [(0, 0), (30000, 0), (65535, 0.6)])
    paraview("tf_ct", [(-1000, 0.1, 0.2, 0.4), (200, 0.8, 0.4, 0.3), (1500, 1, 1, 0.9)],
             [(-1000, 0), (-300, 0), (100, 0.05), (1500, 0.8)])
    write("labels.csv", "label,r,g,b,opacity,name\n1,255,0,0,1,red\n2,0,255,0,0.5\n3,20,60,255,0.2\n5,250,240,10,0.9\n")
    write_json("labels.json", {"1": "#ff8800", "2": {"colour": "#00ff80", "opacity": 0.4}, "4": "#ffffff", "6": "#4060ff"})
    write("labels.txt", '# ITK-SnAP Label Description File\n    0     0    0    0        0  0  0    "Clear Label"\n'
          '    1   255    0    0        1  1  1    "a"\n    3     0  255    0      0.5  1  1    "b"\n'
          '    4    40   90  255        1  1  1    "c"\n    5     0    0  255        1  0  1    "hidden"\n')


def look_at(position, target, up=(0, 1, 0), **more):
    return {"position": list(position), "target": list(target), "up": list(up), **more}


def volume_cameras():
    middle = (24, 26, 18)
    write_json("cam_far.json", look_at((24, 26, -700), middle, fov_y=12))
    write_json("cam_very_far.json", look_at((900, 700, -2500), middle, fov_y=8))
    write_json("cam_inside.json", look_at((38, 36, 14), (20, 22, 15), fov_y=80, near=0.05))
    write_json("cam_skim.json", look_at((24, 30, -1.5), (26, 24, 30), fov_y=75))
    write_json("cam_voxel.json", look_at((24.0, 24.0, 18.0), (24.0, 24.0, 30.0), fov_y=60))
    write_json("cam_ortho.json", look_at((-60, 60, -60), middle, projection="orthographic", height=70))
    write_json("cam_ortho_axis.json", look_at((24, 26, -60), middle, projection="orthographic", height=60))
    write_json("cam_list.json", [look_at((90, 60, -40), middle, fov_y=30), look_at((-60, 0, 60), middle, fov_y=50)])
    write_json("cam_back.json", look_at((24, 26, -60), (24, 26, -100), fov_y=40))
    write_json("cam_calibrated.json", {"width": 96, "height": 72, "fx": 120, "fy": 118, "cx": 50, "cy": 33,
               "R": [1, 0, 0, 0, 0.8, -0.6, 0, 0.6, 0.8], "t": [-24, -8, 90], "pixel_centre": "integer"})
    write_json("cam_wide.json", look_at((56, 50, -20), (56, 50, 60), fov_y=70))
    key = [look_at((80, 50, -70), middle, fov_y=30), look_at((-50, 40, -60), middle, fov_y=40),
           look_at((-20, 90, 60), middle, fov_y=30)]
    write_json("path.json", {"keys": [{"time": t, "camera": c} for t, c in zip((0, 0.5, 1.5), key)]})
    write_json("path_looks.json", {"keys": [
        {"time": 0, "camera": key[0], "transfer": "tf.json", "crop": [0, 0, 0, 50, 55, 40], "clip_planes": [[1, 0, 0, 2]]},
        {"time": 1, "camera": key[1], "transfer": "tf_sharp.json", "crop": [0, 0, 0, 30, 55, 30], "clip_planes": [[1, 1, 0, 30]]},
    ]})
    write_json("path_voxels.json", {"keys": [
        {"time": 0, "camera": key[0], "preset": "mr-head", "crop_voxels": [0, 0, 0, 47, 43, 39]},
        {"time": 1, "camera": key[2], "preset": "mr-head", "crop_voxels": [10, 0, 0, 30, 43, 39]}]})


# ---- Meshes --------------------------------------------------------------------------------------------------------


def textures():
    def board(n, alpha):
        out = []
        for y in range(n):
            for x in range(n):
                light = (x // 8 + y // 8) % 2
                base = [230, 220, 60] if light else [40, 60, 160]
                pixel = [max(0, min(255, int(c + 40 * (noise(x, y, 3) - 0.5)))) for c in base]
                if alpha:
                    ring = (x - n // 2) ** 2 + (y - n // 2) ** 2
                    pixel.append(0 if ring < n * n // 25 else 128 if ring < n * n // 9 else 255)
                out += pixel
        return out

    # The ground's texels are smaller than pixels, those of the box larger.
    png("board.png", (256, 256), 3, 8, board(256, False))
    return (png("quad.png", (64, 64), 3, 8, board(64, False)), png("alpha.png", (192, 192), 4, 8, board(192, True)),
            png("odd.png", (37, 21), 3, 8, [int(255 * noise(i, 11)) for i in range(37 * 21 * 3)]))


def obj():
    """A hilly ground seen at a slant, and a box on it."""
    lines = ["mtllib ground.mtl", "usemtl ground"]
    n = 12
    for j in range(n + 1):
        for i in range(n + 1):
            lines.append("v %.4f %.4f %.4f" % (i - 6, 0.35 * math.sin(i * 0.9) * math.cos(j * 0.7), 6 - j))
            lines.append("vt %.4f %.4f" % (i / 3, j / 3))
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i + 1
            quad = (a, a + 1, a + n + 2, a + n + 1)
            lines.append("f " + " ".join("%d/%d" % (v, v) for v in quad))
    lines.append("usemtl box")
    first, uv = (n + 1) ** 2 + 1, (n + 1) ** 2 + 1
    lines += ["v %g %g %g" % (x, y, z) for x in (-1.5, 1.5) for y in (0.5, 3) for z in (-1.5, 1.5)]
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    for face in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
        lines.append("f " + " ".join("%d/%d" % (first + v, uv + k) for k, v in enumerate(face)))
    write("ground.obj", "\n".join(lines) + "\n")
    write("ground.mtl", "newmtl ground\nKd 1 1 1\nmap_Kd board.png\n\nnewmtl box\nKd 0.9 0.5 0.4\nmap_Kd odd.png\n")
    bare = [line for line in lines if not line.startswith(("mtllib", "usemtl"))]
    write("bare.obj", "\n".join(bare) + "\n")


def gltf(pictures):
    """Three quads one behind another, with every alpha mode, in two scenes with two cameras."""
    position = [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]
    uv = [0, 2, 2, 2, 2, 0, 0, 0]
    colours = [1, 1, 1, 1, 1, 0.4, 0.4, 1, 0.4, 1, 0.4, 0.5, 0.4, 0.4, 1, 1]
    index = [0, 1, 2, 0, 2, 3]
    data = packed("f", position + uv + colours) + packed("H", index)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()

    def image(data):
        return {"uri": "data:image/png;base64," + base64.b64encode(data).decode()}

    def mesh(material, coloured=False):
        attributes = {"POSITION": 0, "TEXCOORD_0": 1}
        if coloured:
            attributes["COLOR_0"] = 2
        return {"primitives": [{"attributes": attributes, "indices": 3, "material": material}]}

    def material(texture, more=None, unlit=False):
        out = {"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}, "metallicFactor": 0}, **(more or {})}
        if unlit:
            out["extensions"] = {"KHR_materials_unlit": {}}
        return out

    turn = [0, 0.3826834, 0, 0.9238795]
    shifted = material(0, {"emissiveFactor": [0.1, 0.0, 0.2]})
    shifted["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = {
        "KHR_texture_transform": {"offset": [0.2, 0.1], "rotation": 0.5, "scale": [1.5, 0.7]}}
    write_json("quads.gltf", {
        "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_materials_unlit", "KHR_texture_transform"],
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2, 5, 6]}, {"name": "other", "nodes": [3, 4, 5]}],
        "nodes": [
            {"mesh": 0, "translation": [0, 0, -1.5], "scale": [1.6, 1.6, 1]}, {"mesh": 1, "rotation": turn},
            {"mesh": 2, "translation": [0.3, 0.2, 0.9]}, {"mesh": 3, "rotation": turn},
            {"mesh": 4, "translation": [1.2, 0, -0.6]},
            {"camera": 0, "translation": [0, 0, 6]}, {"camera": 1, "translation": [1.0, 0.5, 6]}],
        "cameras": [
            {"name": "wide", "type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}},
            {"name": "flat", "type": "orthographic",
             "orthographic": {"xmag": 2.5, "ymag": 2, "znear": 0.1, "zfar": 100}}],
        "meshes": [mesh(0), mesh(1), mesh(2, True), mesh(3), mesh(4)],
        "materials": [
            material(0), material(1, {"alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": True}),
            material(1, {"alphaMode": "BLEND"}), {**shifted, "doubleSided": True}, material(2, unlit=True)],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 1}, {"source": 2, "sampler": 2}],
        "images": [image(p) for p in pictures],
        "samplers": [{"wrapS": 10497, "wrapT": 33648}, {"wrapS": 33071, "wrapT": 10497},
                     {"magFilter": 9728, "minFilter": 9728, "wrapS": 33648, "wrapT": 33071}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC4"},
            {"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
            {"buffer": 0, "byteOffset": 80, "byteLength": 64}, {"buffer": 0, "byteOffset": 144, "byteLength": 12}],
        "buffers": [{"byteLength": len(data), "uri": uri}]})


def mesh_cameras():
    write_json("cam_ground.json", look_at((1, 4, 12), (0, 0.5, 0), fov_y=40))
    write_json("cam_ground_low.json", look_at((0, 0.9, 7), (0, 0.5, 0), fov_y=70))
    write_json("cam_ground_far.json", look_at((30, 50, 120), (0, 0, 0), fov_y=10))
    write_json("cam_ground_near.json", look_at((2, 3.4, 2), (0, 3, 0), fov_y=30))
    write_json("path_ground.json", {"keys": [
        {"time": 0, "camera": look_at((1, 4, 12), (0, 0.5, 0), fov_y=40)},
        {"time": 1, "camera": look_at((8, 6, 8), (0, 1, 0), fov_y=30)}]})
    # The references of the warps, drawn from the ground.
    write_json("cam_refs.json", [look_at((1, 4, 12), (0, 0.8, 0), fov_y=40), look_at((4.5, 4.2, 11), (0, 0.8, 0), fov_y=40),
                                 look_at((-2.5, 5, 11), (0, 0.8, 0), fov_y=40), look_at((2.6, 4.1, 11.6), (0, 0.8, 0), fov_y=40)])


# ---- Depth images --------------------------------------------------------------------------------------------------

WIDTH, HEIGHT, FOCAL = 96, 72, 84.0
CX, CY = 47.5, 35.5


def depth_scene():
    """A slanted wall, a ball and a pole before it: camera z and display colours, pixel centres at whole numbers."""
    z, rgb = [], []
    for y in range(HEIGHT):
        for x in range(WIDTH):
            u, v = (x - CX) / FOCAL, (y - CY) / FOCAL
            depth = 4.0 / (1 - 0.35 * u - 0.1 * v)
            px, py = u * depth, v * depth
            light = (math.floor(px * 4) + math.floor(py * 4)) % 2
            colour = [200, 190, 170] if light else [90, 100, 120]
            # |t (u, v, 1) - c|^2 = r^2
            cx, cy, cz, r = -0.25, 0.1, 2.4, 0.5
            a, b, c = u * u + v * v + 1, cx * u + cy * v + cz, cx * cx + cy * cy + cz * cz - r * r
            root = b * b - a * c
            if root > 0 and (b - math.sqrt(root)) / a < depth:
                depth = (b - math.sqrt(root)) / a
                stripe = math.floor((v * depth) * 12) % 2
                colour = [220, 80, 50] if stripe else [250, 200, 60]
            if 0.22 < u < 0.26:
                depth, colour = 1.9, [40, 180, 70]
            z.append(depth)
            rgb += [max(0, min(255, int(c + 24 * (noise(x, y, k) - 0.5)))) for k, c in enumerate(colour)]
    return z, rgb


def pfm(name, values, endian="<"):
    rows = [values[y * WIDTH : (y + 1) * WIDTH] for y in reversed(range(HEIGHT))]
    data = b"".join(struct.pack(endian + "%df" % WIDTH, *row) for row in rows)
    scale = "-1.0" if endian == "<" else "1.0"
    write(name, ("Pf\n%d %d\n%s\n" % (WIDTH, HEIGHT, scale)).encode() + data)


def depths():
    z, rgb = depth_scene()
    size = (WIDTH, HEIGHT)
    png("view.png", size, 3, 8, rgb)
    png("view16.png", size, 3, 16, [v * 257 - 60 if v > 3 else v * 257 for v in rgb])
    tiff("view.tif", 1, size, 8, 3, 1, lambda _: bytes(rgb))
    alpha = [c for i in range(WIDTH * HEIGHT) for c in (*rgb[3 * i : 3 * i + 3], 255 if i % 17 else 90)]
    png("view_alpha.png", size, 4, 8, alpha)
    pfm("z.pfm", z)
    pfm("z_be.pfm", z, ">")
    npy("z.npy", "f", (HEIGHT, WIDTH), z)
    npy("z_f64.npy", "d", (HEIGHT, WIDTH), z)
    png("z_mm.png", size, 1, 16, [round(v * 1000) for v in z])
    png("z_cm8.png", size, 1, 8, [min(255, round(v * 40)) for v in z])
    tiff("z_f32.tif", 1, size, 32, 1, 3, lambda _: packed("f", z))
    tiff("z_u16.tif", 1, size, 16, 1, 1, lambda _: packed("H", [round(v * 1000) for v in z]))
    rays = [math.sqrt(((i % WIDTH - CX) / FOCAL) ** 2 + ((i // WIDTH - CY) / FOCAL) ** 2 + 1) for i in range(len(z))]
    npy("ray.npy", "f", (HEIGHT, WIDTH), [d * r for d, r in zip(z, rays)])
    pfm("disparity.pfm", [FOCAL * 0.4 / d - 1.5 for d in z])
    npy("inverse.npy", "f", (HEIGHT, WIDTH), [1 / d for d in z])
    near, far = 1.0, 12.0
    png("mpeg.png", size, 1, 8, [round(255 * (1 / d - 1 / far) / (1 / near - 1 / far)) for d in z])
    npy("opengl.npy", "f", (HEIGHT, WIDTH), [(far - near * far / d) / (far - near) for d in z])
    pfm("z_holes.pfm", [math.inf if noise(i, 5) < 0.05 else -99.0 if noise(i, 6) < 0.03 else d for i, d in enumerate(z)])
    # An older, noisier camera of the same scene: depth in coarse steps.
    npy("z_steps.npy", "f", (HEIGHT, WIDTH), [1 / (round(60 / d) / 60) for d in z])


def turned(yaw, pitch):
    """World-to-camera rotation, by rows."""
    cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    return [[cy, 0, -sy], [sp * sy, cp, sp * cy], [cp * sy, -sp, cp * cy]]


def quaternion(m):
    """w x y z of a rotation by rows, small angles."""
    w = 0.5 * math.sqrt(1 + m[0][0] + m[1][1] + m[2][2])
    return [w, (m[2][1] - m[1][2]) / (4 * w), (m[0][2] - m[2][0]) / (4 * w), (m[1][0] - m[0][1]) / (4 * w)]


def warp_cameras():
    identity = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    eye = [0.35, -0.12, 0.15]
    turn = turned(-0.12, 0.05)
    poses = [(identity, [0, 0, 0]), (turn, eye)]

    def own(rows, eye, focal=FOCAL, size=(WIDTH, HEIGHT), centre=(CX, CY)):
        t = [-sum(r * e for r, e in zip(row, eye)) for row in rows]
        return {"width": size[0], "height": size[1], "fx": focal, "fy": focal, "cx": centre[0], "cy": centre[1],
                "R": [n for row in rows for n in row], "t": t, "pixel_centre": "integer"}

    write_json("cams.json", [own(*poses[0]), own(*poses[1])])
    write_json("to_big.json", own(turn, eye, 3 * FOCAL, (160, 128), (79.5, 63.5)))
    write_json("to_small.json", own(turn, eye, FOCAL / 4, (40, 32), (19.5, 15.5)))
    write_json("to_rolled.json", own([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], [0.1, 0, -0.5]))
    write_json("to_behind.json", own([[-1, 0, 0], [0, 1, 0], [0, 0, -1]], [0.1, 0, 9]))
    write_json("to_forward.json", own(identity, [-0.2, 0.1, 1.6]))
    write_json("to_ortho.json", look_at((0.5, -0.4, -3), (0, 0, 4), (0, -1, 0), projection="orthographic", height=4))
    write_json("nested.json", {"ref": {"W": WIDTH, "H": HEIGHT, "fx": FOCAL, "fy": FOCAL, "cx": CX, "cy": CY,
               "R": [n for row in identity for n in row], "t": [0, 0, 0]},
               "targets": [{"W": WIDTH, "H": HEIGHT, "fx": FOCAL, "fy": FOCAL, "cx": CX, "cy": CY,
                            "R": own(*poses[1])["R"], "t": own(*poses[1])["t"]}]})
    write("calib.txt", "cam0=[84 0 47.5; 0 84 35.5; 0 0 1]\ncam1=[84 0 49; 0 84 35.5; 0 0 1]\ndoffs=1.5\nbaseline=0.4\n"
          "width=96\nheight=72\nndisp=40\n")
    log, tum, images, frames, mpeg = [], [], [], [], []
    for number, (rows, eye) in enumerate(poses):
        # Camera to world: the transpose, and the eye.
        inverse = [[rows[j][i] for j in range(3)] for i in range(3)]
        log.append("%d %d %d" % (number, number, number + 1))
        log += ["%.9f %.9f %.9f %.9f" % (*inverse[i], eye[i]) for i in range(3)] + ["0 0 0 1"]
        w, x, y, z = quaternion(inverse)
        tum.append("%d.5 %.9f %.9f %.9f %.9f %.9f %.9f %.9f" % (number, *eye, x, y, z, w))
        w, x, y, z = quaternion(rows)
        t = own(rows, eye)["t"]
        images.append("%d %.9f %.9f %.9f %.9f %.9f %.9f %.9f 1 view%d.png\n" % (number + 1, w, x, y, z, *t, number))
        matrix = [[inverse[i][0], -inverse[i][1], -inverse[i][2], eye[i]] for i in range(3)] + [[0, 0, 0, 1]]
        frames.append({"file_path": "images/%d" % number, "transform_matrix": matrix})
        # OMAF's axes: its x is our z, its y our -x, its z our -y.
        axes = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]

        def product(a, b):
            return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]

        m = product(product(axes, inverse), [[axes[j][i] for j in range(3)] for i in range(3)])
        angles = [math.atan2(m[1][0], m[0][0]), math.asin(-m[2][0]), math.atan2(m[2][1], m[2][2])]
        mpeg.append({"Name": "v%d" % number, "Projection": "Perspective", "Position": [eye[2], -eye[0], -eye[1]],
                     "Rotation": [math.degrees(a) for a in angles], "Resolution": [WIDTH, HEIGHT],
                     "Focal": [FOCAL, FOCAL], "Principle_point": [CX + 0.5, CY + 0.5]})
    write("trajectory.log", "\n".join(log) + "\n")
    write("tum.txt", "\n".join(tum) + "\n")
    write("colmap/images.txt", "\n".join(images) + "\n")
    write("colmap/cameras.txt", "1 PINHOLE %d %d %g %g %g %g\n" % (WIDTH, HEIGHT, FOCAL, FOCAL, CX + 0.5, CY + 0.5))
    write_json("transforms.json", {"fl_x": FOCAL, "fl_y": FOCAL, "cx": CX + 0.5, "cy": CY + 0.5, "w": WIDTH,
                                   "h": HEIGHT, "frames": frames})
    write_json("mpeg.json", {"Version": "2.0", "cameras": mpeg})
    write_json("path_warp.json", {"keys": [{"time": 0, "camera": own(*poses[0])}, {"time": 1, "camera": own(*poses[1])}]})


os.makedirs(FOLDER, exist_ok=True)
volumes()
transfers()
volume_cameras()
obj_pictures = textures()
obj()
gltf(obj_pictures)
mesh_cameras()
depths()
warp_cameras()
