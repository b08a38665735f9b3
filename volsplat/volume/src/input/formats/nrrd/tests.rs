//! NRRD: small files of every encoding, byte order and form, written here and read back.

use std::io::Write;

use crate::input::test_files::{Folder, gzip, survive_damage};
use crate::input::{LoadOptions, load};
use crate::volume::Voxels;

mod detached;
mod geometry;

fn bzip2(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::default());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

fn hex(bytes: &[u8]) -> Vec<u8> {
    let lines: Vec<String> = bytes
        .chunks(5)
        .map(|line| line.iter().map(|b| format!("{b:02X}")).collect())
        .collect();
    lines.join("\n").into_bytes()
}

fn head(kind: &str, endian: &str, encoding: &str) -> String {
    format!(
        "NRRD0004\n# made here\ntype: {kind}\ndimension: 3\nsizes: 2 1 2\nendian: {endian}\nencoding: {encoding}\n\n"
    )
}

/// Four values, their type's name, and their bytes in either order.
fn samples() -> Vec<(&'static str, Voxels, Vec<u8>, Vec<u8>)> {
    macro_rules! sample {
        ($name:expr, $kind:ident, $held:ty, $values:expr, $stored:ty) => {{
            let values: [$stored; 4] = $values;
            let little = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let big = values.iter().flat_map(|v| v.to_be_bytes()).collect();
            (
                $name,
                Voxels::$kind(values.iter().map(|&v| v as $held).collect()),
                little,
                big,
            )
        }};
    }
    vec![
        sample!("unsigned char", U8, u8, [0, 1, 200, 255], u8),
        sample!("signed char", I8, i8, [0, 1, -128, 127], i8),
        sample!("ushort", U16, u16, [0, 1, 258, 65535], u16),
        sample!("short", I16, i16, [0, -2, 258, -32768], i16),
        sample!("unsigned int", U32, u32, [0, 1, 0x0102_0304, u32::MAX], u32),
        sample!("int32_t", I32, i32, [0, -1, 0x0102_0304, i32::MIN], i32),
        sample!(
            "unsigned long long int",
            F64,
            f64,
            [0, 1, 1 << 53, u64::MAX],
            u64
        ),
        sample!("int64", F64, f64, [0, -1, 1 << 53, i64::MIN], i64),
        sample!("float", F32, f32, [0.0, -1.5, 1e-42, 3e38], f32),
        sample!("double", F64, f64, [0.0, -1.5, 1e-310, 3e300], f64),
    ]
}

#[test]
fn a_component_is_taken_wherever_its_axis_lies() {
    let folder = Folder::new();
    // Colours first, times last: 3 components of 2x1x2 voxels either way.
    let cases = [
        ("3 2 1 2", "RGB-color space space space", [1, 4, 7, 10]),
        ("2 1 2 3", "space space space time", [4, 5, 6, 7]),
    ];
    for (sizes, kinds, expected) in cases {
        let fields =
            format!("NRRD0004\ntype: uchar\ndimension: 4\nsizes: {sizes}\nkinds: {kinds}\n");
        let data: Vec<u8> = (0..12).collect();
        let packed = [
            ("raw", data.clone()),
            ("gzip", gzip(&data)),
            ("hex", hex(&data)),
        ];
        for (encoding, data) in packed {
            let head = format!("{fields}encoding: {encoding}\n\n");
            let path = folder.write("c.nrrd", &[head.as_bytes(), &data]);
            let options = LoadOptions {
                component: Some(1),
                ..LoadOptions::default()
            };
            let volume = load(&path, &options).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(
                (volume.dims, volume.voxels),
                ([2, 1, 2], Voxels::U8(expected.to_vec())),
                "{kinds}, {encoding}"
            );
        }
    }
}

#[test]
fn every_type_order_and_binary_encoding_reads_back() {
    let folder = Folder::new();
    for (kind, expected, little, big) in samples() {
        for (endian, bytes) in [("little", little), ("BIG", big)] {
            let packed = [
                ("raw", bytes.clone()),
                ("gzip", gzip(&bytes)),
                ("bz2", bzip2(&bytes)),
                ("hex", hex(&bytes)),
            ];
            for (encoding, data) in packed {
                let volume = folder.load(&[head(kind, endian, encoding).as_bytes(), &data]);
                let volume =
                    volume.unwrap_or_else(|error| panic!("{kind} {endian} {encoding}: {error}"));
                assert_eq!(volume.dims, [2, 1, 2]);
                assert_eq!(volume.voxels, expected, "{kind} {endian} {encoding}");
            }
        }
    }
}

#[test]
fn text_reads_each_type_and_separator() {
    let folder = Folder::new();
    let cases: [(&str, &str, Voxels); 4] = [
        ("uchar", "0 1,200\n255\n", Voxels::U8(vec![0, 1, 200, 255])),
        (
            "short",
            "\n 0\t-2 258 -32768",
            Voxels::I16(vec![0, -2, 258, -32768]),
        ),
        (
            "float",
            "0 -1.5 1e-42 3e38",
            Voxels::F32(vec![0.0, -1.5, 1e-42, 3e38]),
        ),
        (
            "uint64",
            "0 1 2 9007199254740992",
            Voxels::F64(vec![0.0, 1.0, 2.0, 9007199254740992.0]),
        ),
    ];
    for (kind, data, expected) in cases {
        for name in ["ascii", "text", "txt"] {
            let volume = folder.load(&[head(kind, "little", name).as_bytes(), data.as_bytes()]);
            assert_eq!(volume.expect("valid").voxels, expected, "{kind}");
        }
    }
    let text = folder.refusal(&[head("uchar", "little", "text").as_bytes(), b"0 1 300 2"]);
    assert!(
        text.contains("value 2 of the data is '300'") && text.contains("u8"),
        "{text}"
    );
    let text = folder.refusal(&[head("uchar", "little", "text").as_bytes(), b"100 200 30"]);
    assert!(text.contains("4 values are needed, 3 are there"), "{text}");
    let text = folder.refusal(&[head("uchar", "little", "text").as_bytes(), b"1 2 3 4 5 6"]);
    assert!(text.contains("4 values are needed, 6 are there"), "{text}");
}

#[test]
fn heads_of_all_versions_and_line_ends_are_read() {
    let folder = Folder::new();
    for version in 1..=5 {
        let head = format!(
            "NRRD000{version}\r\nType:uint8\r\nDIMENSION: 1\r\nsizes: 3\r\nencoding: RAW\r\nkey:=value: with colon\r\n\r\n"
        );
        let volume = folder.load(&[head.as_bytes(), &[1, 2, 3]]).expect("valid");
        assert_eq!(
            (volume.dims, volume.voxels),
            ([3, 1, 1], Voxels::U8(vec![1, 2, 3])),
            "version {version}"
        );
    }
    assert!(
        folder
            .refusal(&[b"NRRD0006\n\n"])
            .contains("version 'NRRD0006'")
    );
}

#[test]
fn gzip_of_several_members_is_one_stream() {
    let data = [gzip(&[1, 2]), gzip(&[3, 4])].concat();
    let volume = Folder::new()
        .load(&[head("uchar", "little", "gzip").as_bytes(), &data])
        .expect("valid");
    assert_eq!(volume.voxels, Voxels::U8(vec![1, 2, 3, 4]));
}

#[test]
fn too_little_and_too_much_data_is_refused_with_numbers() {
    let folder = Folder::new();
    let cases: [(&str, Vec<u8>, &str); 7] = [
        (
            "raw",
            vec![0; 7],
            "need 8 bytes after skipping 0, there are 7",
        ),
        (
            "raw",
            vec![0; 9],
            "need 8 bytes after skipping 0, there are 9",
        ),
        ("gzip", gzip(&[0; 6]), "8 bytes are needed, 6 are there"),
        ("gzip", gzip(&[0; 11]), "8 bytes are needed, 11 are there"),
        ("bzip2", bzip2(&[0; 6]), "8 bytes are needed, 6 are there"),
        (
            "hex",
            b"0001 02".to_vec(),
            "needs 16 bytes of hex text, but the 7 bytes there",
        ),
        ("hex", b"00010203040506070".to_vec(), "half a byte"),
    ];
    for (encoding, data, expected) in cases {
        let text = folder.refusal(&[head("ushort", "little", encoding).as_bytes(), &data]);
        assert!(text.contains(expected), "{encoding}: {text}");
    }
    let text = folder.refusal(&[head("uchar", "little", "hex").as_bytes(), b"00 01 0x 02"]);
    assert!(text.contains("not a hexadecimal digit"), "{text}");
}

#[test]
fn truncated_packed_streams_are_refused() {
    let folder = Folder::new();
    let noise: Vec<u8> = (0..4000u32)
        .map(|v| (v.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let head = |encoding| {
        format!("NRRD0004\ntype: uchar\ndimension: 1\nsizes: 4000\nencoding: {encoding}\n\n")
    };
    for (encoding, packed) in [("gzip", gzip(&noise)), ("bzip2", bzip2(&noise))] {
        for kept in [packed.len() / 2, packed.len() - 4, 1] {
            let text = folder.refusal(&[head(encoding).as_bytes(), &packed[..kept]]);
            assert!(
                (text.contains("the data") || text.contains("cut off"))
                    && text.contains("test.dat"),
                "{encoding} {kept}: {text}"
            );
        }
    }
}

#[test]
fn forged_sizes_cost_no_memory() {
    let folder = Folder::new();
    for encoding in ["raw", "gzip", "bzip2", "text", "hex"] {
        let head = format!(
            "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 100000 100000 100000\nencoding: {encoding}\n\n"
        );
        let data = match encoding {
            "gzip" => gzip(&[1; 100]),
            "bzip2" => bzip2(&[1; 100]),
            _ => b"1 2 3".to_vec(),
        };
        let text = folder.refusal(&[head.as_bytes(), &data]);
        let needed = match encoding {
            "hex" => "2000000000000000 bytes",
            "text" => "1999999999999999 bytes",
            "bzip2" => "1000000.0 GB",
            _ => "1000000000000000 bytes",
        };
        assert!(text.contains(needed), "{encoding}: {text}");
    }
    let overflow =
        "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 9223372036854775807 4\nencoding: raw\n\n";
    assert!(
        folder
            .refusal(&[overflow.as_bytes()])
            .contains("more values than")
    );
}

#[test]
fn faulty_heads_name_the_field() {
    let folder = Folder::new();
    let cases = [
        ("dimension: 1\nsizes: 1\nencoding: raw\n", "no field 'type'"),
        (
            "type: u12\ndimension: 1\nsizes: 1\nencoding: raw\n",
            "field 'type': unknown voxel type 'u12'",
        ),
        (
            "type: block\nblock size: 3\ndimension: 1\nsizes: 1\nencoding: raw\n",
            "type block",
        ),
        (
            "type: uchar\nsizes: 1\nencoding: raw\n",
            "no field 'dimension'",
        ),
        (
            "type: uchar\ndimension: 17\nsizes: 1\nencoding: raw\n",
            "expected 1 to 16",
        ),
        (
            "type: uchar\ndimension: 2\nsizes: 1\nencoding: raw\n",
            "'sizes' has 1 entries, but 'dimension' is 2",
        ),
        (
            "type: uchar\ndimension: 2\nsizes: 1 0\nencoding: raw\n",
            "at least 1",
        ),
        (
            "type: uchar\ndimension: 2\nsizes: 1 -4\nencoding: raw\n",
            "'sizes' holds '-4'",
        ),
        (
            "type: uchar\ndimension: 1\nsizes: 1\n",
            "no field 'encoding'",
        ),
        (
            "type: uchar\ndimension: 1\nsizes: 1\nencoding: zip\n",
            "'encoding' is 'zip'",
        ),
        (
            "type: ushort\ndimension: 1\nsizes: 1\nencoding: raw\n",
            "no field 'endian', which type u16 needs",
        ),
        (
            "type: uchar\ndimension: 1\nsizes: 1\nencoding: raw\nbyte skip: -2\n",
            "'byteskip' is -2",
        ),
        (
            "type: uchar\ndimension: 1\nsizes: 1\nencoding: gz\nbyte skip: -1\n",
            "byte skip: -1",
        ),
        ("type: uchar\ntype: uchar\n", "'type' is given twice"),
        ("no colon here\n", "expected 'field: value'"),
    ];
    for (fields, expected) in cases {
        let text = folder.refusal(&[b"NRRD0004\n", fields.as_bytes(), b"\n\0"]);
        assert!(text.contains(expected), "{fields}: {text}");
    }
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    let data: Vec<u8> = (0..8).collect();
    survive_damage(
        &[head("short", "big", "raw").as_bytes(), &data].concat(),
        &LoadOptions::default(),
        1000,
    );
    survive_damage(
        &[head("short", "big", "gzip").into_bytes(), gzip(&data)].concat(),
        &LoadOptions::default(),
        2000,
    );
}
