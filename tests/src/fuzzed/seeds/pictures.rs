//! Pictures and depths of 4x3 pixels.

use super::Seed;
use super::binary::{doubles, floats, shorts, words, zlib};

pub(super) const WORDS: [&str; 27] = [
    "channels",
    "chlist",
    "compression",
    "dataWindow",
    "displayWindow",
    "box2i",
    "lineOrder",
    "pixelAspectRatio",
    "tiles",
    "tiledesc",
    "chunkCount",
    "type",
    "scanlineimage",
    "deepscanline",
    "IHDR",
    "PLTE",
    "tRNS",
    "IDAT",
    "gAMA",
    "iCCP",
    "Pf\\x0a",
    "PF\\x0a",
    "#?RADIANCE\\x0a",
    "FORMAT=32-bit_rle_rgbe",
    "-Y 3 +X 4",
    "\\x93NUMPY\\x01\\x00",
    "<f4",
];

pub(super) fn colours() -> Vec<Seed> {
    vec![
        ("png.rgb", png(2, 8, 3)),
        ("png.alpha", png(6, 16, 8)),
        ("png.grey", png(0, 8, 1)),
        ("jpeg", jpeg()),
        ("exr", exr(&["B", "G", "R"], 0)),
        ("exr.zips", exr(&["A", "B", "G", "R"], 2)),
        ("exr.zip", exr(&["B", "G", "R"], 3)),
        ("exr.layer", exr(&["layer.B", "layer.G", "layer.R"], 1)),
        ("tiff", tiff(&[4, 3], 8)),
        (
            "hdr",
            [
                b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 4\n".to_vec(),
                vec![128; 48],
            ]
            .concat(),
        ),
    ]
}

pub(super) fn depths() -> Vec<Seed> {
    vec![
        ("png", png(0, 16, 2)),
        ("exr", exr(&["Z"], 3)),
        ("exr.rle", exr(&["Z"], 1)),
        ("exr.piz", exr(&["Z"], 4)),
        (
            "pfm",
            [b"Pf\n4 3\n-1.0\n".to_vec(), floats(&[2.5; 12])].concat(),
        ),
        ("npy.f4", npy("<f4", "(3, 4)", &floats(&[1.5; 12]))),
        (
            "npy.fortran",
            ordered_npy("<f4", "True", "(3, 4)", &floats(&[1.5; 12])),
        ),
        ("npy.u2", npy("<u2", "(3, 4)", &shorts(&[900; 12]))),
        ("npy.f8", npy("<f8", "(3, 4)", &doubles(&[1.5; 12]))),
        ("tiff.16", tiff(&[4, 3], 16)),
        ("tiff.32", tiff(&[4, 3], 32)),
    ]
}

/// An array whose last axis is fastest.
pub(super) fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    ordered_npy(kind, "False", shape, data)
}

/// An array whose first axis is fastest where `fortran` is "True".
pub(super) fn ordered_npy(kind: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut head = format!("{{'descr': '{kind}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
    while !(10 + head.len() + 1).is_multiple_of(64) {
        head.push(' ');
    }
    head.push('\n');
    [
        b"\x93NUMPY\x01\x00",
        &(head.len() as u16).to_le_bytes()[..],
        head.as_bytes(),
        data,
    ]
    .concat()
}

/// A PNG of this kind of colour, bits a channel and bytes a pixel.
fn png(kind: u8, bits: u8, pixel: usize) -> Vec<u8> {
    let rows: Vec<u8> = (0..3)
        .flat_map(|y| std::iter::once(0).chain(vec![40 * y; 4 * pixel]))
        .collect();
    png_of_rows(kind, bits, &rows)
}

/// A PNG of 4x3 pixels; each row begins with the number of its filter.
pub(super) fn png_of_rows(kind: u8, bits: u8, rows: &[u8]) -> Vec<u8> {
    let head = [0, 0, 0, 4, 0, 0, 0, 3, bits, kind, 0, 0, 0];
    let chunks = [
        (b"IHDR", head.to_vec()),
        (b"IDAT", zlib(rows)),
        (b"IEND", Vec::new()),
    ];
    let chunk = |(name, data): &(&[u8; 4], Vec<u8>)| {
        let mut sum = flate2::Crc::new();
        sum.update(*name);
        sum.update(data);
        [
            &(data.len() as u32).to_be_bytes()[..],
            *name,
            data,
            &sum.sum().to_be_bytes(),
        ]
        .concat()
    };
    let signature = b"\x89PNG\r\n\x1a\n".to_vec();
    std::iter::once(signature)
        .chain(chunks.iter().map(chunk))
        .collect::<Vec<_>>()
        .concat()
}

/// A grey JPEG of 4x3 pixels, all of them the same.
pub(super) fn jpeg() -> Vec<u8> {
    let mut file = vec![0xFF, 0xD8, 0xFF, 0xDB, 0, 67, 0];
    file.extend([1; 64]);
    file.extend([0xFF, 0xC0, 0, 11, 8, 0, 3, 0, 4, 1, 1, 0x11, 0]);
    // One code in each table: the difference 0, and the end of the block.
    for table in [0x00, 0x10] {
        file.extend([0xFF, 0xC4, 0, 20, table, 1]);
        file.extend([0; 15]);
        file.push(0);
    }
    file.extend([0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 63, 0, 0x3F, 0xFF, 0xD9]);
    file
}

/// An EXR of scan lines in 32 bits; the kinds of compression are numbered as in the file.
fn exr(channels: &[&str], compression: u8) -> Vec<u8> {
    let attribute = |name: &str, kind: &str, value: &[u8]| {
        [
            name.as_bytes(),
            b"\0",
            kind.as_bytes(),
            b"\0",
            &(value.len() as u32).to_le_bytes(),
            value,
        ]
        .concat()
    };
    let list: Vec<u8> = channels
        .iter()
        .flat_map(|name| [name.as_bytes(), b"\0", &words(&[2, 0, 1, 1])].concat())
        .chain([0])
        .collect();
    let window = words(&[0, 0, 3, 2]);
    let mut file = [
        &words(&[20_000_630, 2])[..],
        &attribute("channels", "chlist", &list),
        &attribute("compression", "compression", &[compression]),
        &attribute("dataWindow", "box2i", &window),
        &attribute("displayWindow", "box2i", &window),
        &attribute("lineOrder", "lineOrder", &[0]),
        &attribute("pixelAspectRatio", "float", &floats(&[1.0])),
        &attribute("screenWindowCenter", "v2f", &floats(&[0.0, 0.0])),
        &attribute("screenWindowWidth", "float", &floats(&[1.0])),
        &[0],
    ]
    .concat();
    // A block that packing would make no smaller is kept as it is: so are all of these.
    let lines = match compression {
        3 => 16,
        4 => 32,
        _ => 1,
    };
    let blocks = 3usize.div_ceil(lines);
    let mut at = file.len() + 8 * blocks;
    let mut data = Vec::new();
    for block in 0..blocks {
        let rows = lines.min(3 - block * lines);
        let pixels = floats(&vec![0.75; 4 * channels.len() * rows]);
        file.extend((at as u64).to_le_bytes());
        let chunk = [
            &words(&[(block * lines) as u32, pixels.len() as u32])[..],
            &pixels,
        ]
        .concat();
        at += chunk.len();
        data.extend(chunk);
    }
    file.extend(data);
    file
}

/// A grey TIFF of this many columns and rows.
fn tiff(size: &[u32; 2], bits: u32) -> Vec<u8> {
    let bytes = size[0] * size[1] * bits / 8;
    let format = if bits == 32 { 3 } else { 1 };
    let entries = [
        [256, 4, size[0]],
        [257, 4, size[1]],
        [258, 3, bits],
        [259, 3, 1],
        [262, 3, 1],
        [273, 4, 8],
        [277, 3, 1],
        [278, 4, size[1]],
        [279, 4, bytes],
        [339, 3, format],
    ];
    let mut file = [
        b"II*\0".to_vec(),
        words(&[8 + bytes]),
        vec![60; bytes as usize],
    ]
    .concat();
    file.extend(directory(&entries, 0));
    file
}

fn directory(entries: &[[u32; 3]], next: u32) -> Vec<u8> {
    let mut bytes = (entries.len() as u16).to_le_bytes().to_vec();
    for &[tag, kind, value] in entries {
        bytes.extend(shorts(&[tag as u16, kind as u16]));
        bytes.extend(words(&[1, value]));
    }
    bytes.extend(next.to_le_bytes());
    bytes
}

/// A TIFF of two pages of 4x3 pixels, as stacks of slices are.
pub(super) fn tiff_pages() -> Vec<u8> {
    let page = |data: u32| {
        [
            [256, 4, 4],
            [257, 4, 3],
            [258, 3, 8],
            [259, 3, 1],
            [262, 3, 1],
            [273, 4, data],
            [277, 3, 1],
            [278, 4, 3],
            [279, 4, 12],
        ]
    };
    let length = directory(&page(0), 0).len() as u32;
    let first = 8 + 24;
    let second = first + length;
    [
        b"II*\0".to_vec(),
        words(&[first]),
        (0..24).collect(),
        directory(&page(8), second),
        directory(&page(20), 0),
    ]
    .concat()
}
