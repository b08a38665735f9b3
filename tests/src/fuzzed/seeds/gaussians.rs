//! Scenes of a few Gaussians: one, or twelve where they lie in pictures of 4x3 pixels.

use serde_json::{Value, json};

use super::binary::{floats, gzip, shorts, words};
use super::pictures::png_of_rows;
use super::{Seed, packed};

pub(super) const WORDS: [&str; 40] = [
    "element vertex ",
    "element chunk ",
    "element sh ",
    "property float ",
    "property uchar f_rest_",
    "packed_position",
    "packed_rotation",
    "packed_scale",
    "packed_color",
    "f_dc_0",
    "f_rest_0",
    "scale_0",
    "rot_0",
    "opacity",
    "format binary_little_endian 1.0",
    "NGSP",
    "PK\\x03\\x04",
    "PK\\x01\\x02",
    "PK\\x05\\x06",
    "\\n@@meta.json\\n",
    "means",
    "quats",
    "codebook",
    "mins",
    "maxs",
    "bands",
    "sh0",
    "shN",
    "KHR_gaussian_splatting",
    "KHR_gaussian_splatting:ROTATION",
    "KHR_gaussian_splatting:SCALE",
    "KHR_gaussian_splatting:OPACITY",
    "KHR_gaussian_splatting:SH_DEGREE_1_COEF_0",
    "lin_rec709_display",
    "bufferView",
    "byteStride",
    "componentType",
    "normalized",
    "matrix",
    "children",
];

/// The properties of INRIA's code but for the coefficients beyond the constant.
const PROPERTIES: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
    "rot_0", "rot_1", "rot_2", "rot_3",
];

/// Their values, and nine coefficients.
const VALUES: [f32; 23] = [
    1.0, -2.0, 3.0, 0.5, 0.1, -0.5, 0.25, -2.0, -1.0, -3.0, 0.8, 0.0, 0.6, 0.0, 0.1, 0.2, 0.3,
    -0.1, -0.2, -0.3, 0.0, 0.05, 0.25,
];

pub(super) fn files() -> Vec<Seed> {
    let splat = splat();
    let cut = splat[..40].to_vec();
    let scene = sog();
    let scene: Vec<(&str, &[u8])> = scene
        .iter()
        .map(|(name, bytes)| (*name, bytes.as_slice()))
        .collect();
    vec![
        ("ply.ascii", ply("ascii")),
        ("ply.binary", ply("binary_little_endian")),
        ("ply.packed", packed_ply()),
        ("splat", splat),
        ("splat.cut", cut),
        ("spz.1", gzip(&spz(1))),
        ("spz.2", gzip(&spz(2))),
        ("spz.3", gzip(&spz(3))),
        ("spz.4", spz_in_streams()),
        ("sog.folder", packed(&scene)),
        ("sog.zip", zip(&scene)),
        ("gltf", gltf()),
        ("glb", glb()),
    ]
}

fn ply(encoding: &str) -> Vec<u8> {
    let mut file = format!("ply\nformat {encoding} 1.0\nelement vertex 1\n");
    PROPERTIES
        .iter()
        .for_each(|name| file += &format!("property float {name}\n"));
    (0..9).for_each(|number| file += &format!("property float f_rest_{number}\n"));
    file += "end_header\n";
    let mut file = file.into_bytes();
    match encoding {
        "ascii" => file.extend(VALUES.map(|value| format!("{value} ")).concat().bytes()),
        _ => file.extend(floats(&VALUES)),
    }
    file
}

fn packed_ply() -> Vec<u8> {
    let mut file = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n".to_owned();
    for end in ["min", "max"] {
        for name in [
            "x", "y", "z", "scale_x", "scale_y", "scale_z", "r", "g", "b",
        ] {
            file += &format!("property float {end}_{name}\n");
        }
    }
    file += "element vertex 1\n";
    for name in ["position", "rotation", "scale", "color"] {
        file += &format!("property uint packed_{name}\n");
    }
    file += "element sh 1\n";
    (0..9).for_each(|number| file += &format!("property uchar f_rest_{number}\n"));
    file += "end_header\n";
    let ranges = [
        [-2.0; 3], [-5.0; 3], [-1.0; 3], [2.0; 3], [0.0; 3], [1.0; 3],
    ];
    [
        file.as_bytes(),
        &floats(&ranges.concat()),
        &words(&[0x8123_4567, 0xA00_8040, 0x4123_4567, 0x8040_C0FF]),
        &[128; 9],
    ]
    .concat()
}

fn splat() -> Vec<u8> {
    let bytes = [
        floats(&[1.0, 2.0, 3.0, 0.1, 0.2, 0.3]),
        vec![255, 128, 0, 200, 255, 128, 128, 128],
    ];
    bytes.concat().repeat(2)
}

/// Positions, opacity, colour, scales, rotation and coefficients.
fn spz_parts(version: u32) -> [Vec<u8>; 6] {
    [
        match version {
            1 => shorts(&[0x3C00, 0xC000, 0x4200]),
            _ => vec![0, 16, 0, 0, 32, 0, 0, 240, 255],
        },
        vec![200],
        vec![140, 128, 100],
        vec![100, 110, 120],
        match version {
            1 | 2 => vec![127, 200, 127],
            _ => words(&[0xC010_0401]),
        },
        vec![128, 130, 120, 140, 128, 128, 100, 128, 128],
    ]
}

fn spz_head(version: u32) -> Vec<u8> {
    [b"NGSP", words(&[version, 1]).as_slice(), &[1, 12, 0, 0]].concat()
}

fn spz(version: u32) -> Vec<u8> {
    [spz_head(version), spz_parts(version).concat()].concat()
}

/// Version 4: a table of streams, and the streams as frames of Zstandard that hold bytes as they are.
fn spz_in_streams() -> Vec<u8> {
    let mut head = spz_head(4);
    head[15] = 6;
    head.extend(words(&[32, 0, 0, 0]));
    let (mut table, mut streams) = (Vec::new(), Vec::new());
    for part in spz_parts(4) {
        let length = u8::try_from(part.len()).expect("a small file");
        let frame = [0x28, 0xB5, 0x2F, 0xFD, 0x20, length, length << 3 | 1, 0, 0];
        let frame = [&frame[..], &part].concat();
        for number in [frame.len() as u64, part.len() as u64] {
            table.extend(number.to_le_bytes());
        }
        streams.extend(frame);
    }
    [head, table, streams].concat()
}

/// A scene in pictures: version 2, with one entry in its palette.
fn sog() -> Vec<(&'static str, Vec<u8>)> {
    let codebook: Vec<f32> = (0..256).map(|byte| byte as f32 / 64.0 - 3.0).collect();
    let meta = json!({
        "version": 2, "count": 12,
        "means": { "mins": [-1, -1, -1], "maxs": [1, 1, 1], "files": ["low.png", "high.png"] },
        "scales": { "codebook": codebook, "files": ["scales.png"] },
        "quats": { "files": ["quats.png"] },
        "sh0": { "codebook": codebook, "files": ["sh0.png"] },
    });
    let picture = |pixel: [u8; 4]| {
        let row = [&[0u8][..], &pixel.repeat(4)].concat();
        png_of_rows(6, 8, &row.repeat(3))
    };
    vec![
        ("meta.json", meta.to_string().into_bytes()),
        ("low.png", picture([10, 200, 30, 255])),
        ("high.png", picture([100, 20, 130, 255])),
        ("scales.png", picture([50, 60, 70, 255])),
        ("quats.png", picture([128, 140, 100, 253])),
        ("sh0.png", picture([200, 190, 180, 255])),
    ]
}

/// An archive whose members are stored as they are.
fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut zip, mut list) = (Vec::new(), Vec::new());
    for &(name, bytes) in files {
        let mut sum = flate2::Crc::new();
        sum.update(bytes);
        let length = u32::try_from(bytes.len()).expect("a small file");
        let mut facts = shorts(&[20, 0, 0, 0, 0]);
        facts.extend(words(&[sum.sum(), length, length]));
        facts.extend(shorts(&[
            u16::try_from(name.len()).expect("a small file"),
            0,
        ]));
        list.extend([&b"PK\x01\x02\x14\0"[..], &facts, &[0; 10]].concat());
        list.extend(words(&[u32::try_from(zip.len()).expect("a small file")]));
        list.extend(name.bytes());
        zip.extend([b"PK\x03\x04", facts.as_slice(), name.as_bytes(), bytes].concat());
    }
    let count = u16::try_from(files.len()).expect("a small file");
    let mut end = b"PK\x05\x06".to_vec();
    end.extend(shorts(&[0, 0, count, count]));
    end.extend(words(&[
        u32::try_from(list.len()).expect("a small file"),
        u32::try_from(zip.len()).expect("a small file"),
    ]));
    end.extend([0, 0]);
    [zip, list, end].concat()
}

/// The document, and the bytes of its buffer: position, rotation, scale, opacity and constant.
fn document() -> (Value, Vec<u8>) {
    let numbers = [
        1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8, 0.1, 0.2, 0.3, 0.5, 0.1, 0.2, 0.3,
    ];
    let attributes = [
        ("POSITION", "VEC3", 0),
        ("KHR_gaussian_splatting:ROTATION", "VEC4", 12),
        ("KHR_gaussian_splatting:SCALE", "VEC3", 28),
        ("KHR_gaussian_splatting:OPACITY", "SCALAR", 40),
        ("KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", "VEC3", 44),
    ];
    let accessors = attributes.map(|(_, shape, at)| {
        json!({ "bufferView": 0, "byteOffset": at, "componentType": 5126, "count": 1, "type": shape })
    });
    let numbered = attributes.iter().enumerate();
    let named: serde_json::Map<_, _> = numbered
        .map(|(number, (name, ..))| ((*name).to_owned(), json!(number)))
        .collect();
    let extension = json!({ "kernel": "ellipse", "colorSpace": "srgb_rec709_display" });
    let json = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_gaussian_splatting"],
        "buffers": [{ "byteLength": 4 * numbers.len() }],
        "bufferViews": [{ "buffer": 0, "byteLength": 4 * numbers.len() }],
        "accessors": accessors,
        "meshes": [{ "primitives": [{
            "mode": 0, "attributes": named, "extensions": { "KHR_gaussian_splatting": extension },
        }] }],
        "nodes": [{ "mesh": 0, "rotation": [0.0, 0.6, 0.0, 0.8], "scale": [1, 2, 3], "translation": [1, 0, 0] }],
        "scenes": [{ "nodes": [0] }],
    });
    (json, floats(&numbers))
}

fn gltf() -> Vec<u8> {
    let (mut json, data) = document();
    let mut uri = "data:application/octet-stream,".to_owned();
    data.iter().for_each(|byte| uri += &format!("%{byte:02x}"));
    json["buffers"][0]["uri"] = json!(uri);
    json.to_string().into_bytes()
}

fn glb() -> Vec<u8> {
    let (json, data) = document();
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 28 + json.len() + data.len();
    [
        b"glTF",
        words(&[
            2,
            u32::try_from(length).expect("a small file"),
            u32::try_from(json.len()).expect("a small file"),
        ])
        .as_slice(),
        b"JSON",
        &json,
        &words(&[u32::try_from(data.len()).expect("a small file")]),
        b"BIN\0",
        &data,
    ]
    .concat()
}
