//! NRRD: small files of every encoding, byte order and form, attached and detached, written here and read back.

use std::io::Write;

use glam::{DMat3, DVec3};

use crate::Error;
use crate::input::test_files::{Folder, check_components, gzip, survive_damage};
use crate::input::{LoadOptions, load};
use crate::volume::{Volume, Voxels};

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
            check_components(&path, &LoadOptions::default(), 3);
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

fn volume(sizes: &str, fields: &str) -> Result<Volume, Error> {
    let dimension = sizes.split(' ').count();
    let count: usize = sizes
        .split(' ')
        .map(|size| size.parse::<usize>().expect("a number"))
        .product();
    let head = format!(
        "NRRD0005\ntype: uint8\ndimension: {dimension}\nsizes: {sizes}\nencoding: raw\n{fields}\n"
    );
    Folder::new().load(&[head.as_bytes(), &vec![0; count]])
}

#[test]
fn directions_and_origin_make_the_affine_map() {
    let fields = "space: left-posterior-superior\nspace directions: (0,2,0) ( -3, 0, 0.5 ) (0,0,4)\nspace origin: (1,2,3)\n";
    let volume = volume("2 3 4", fields).expect("valid");
    let columns = DMat3::from_cols(
        DVec3::new(0.0, 2.0, 0.0),
        DVec3::new(-3.0, 0.0, 0.5),
        DVec3::new(0.0, 0.0, 4.0),
    );
    assert_eq!(
        volume.world_from_index.matrix3, columns,
        "sheared directions are kept as they are"
    );
    assert_eq!(
        volume.world_from_index.translation,
        DVec3::new(1.0, 2.0, 3.0)
    );
    assert_eq!(volume.up_hint, Some(DVec3::Z));
    assert_eq!(volume.space.as_deref(), Some("left-posterior-superior"));
}

#[test]
fn spacings_stand_in_for_directions_and_nan_means_one() {
    let volume = volume("2 3 4", "spacings: 0.5 nan 2\n").expect("valid");
    assert_eq!(volume.spacing(), [0.5, 1.0, 2.0]);
    assert_eq!(volume.up_hint, None);
}

#[test]
fn anatomical_spaces_point_up_along_z() {
    for (space, up) in [
        ("RAS", Some(DVec3::Z)),
        ("left-anterior-superior", Some(DVec3::Z)),
        ("right-anterior-superior-time", Some(DVec3::Z)),
        ("scanner-xyz", None),
        ("3D-right-handed", None),
    ] {
        assert_eq!(
            volume("1 1 1", &format!("space: {space}\n"))
                .expect("valid")
                .up_hint,
            up,
            "{space}"
        );
    }
}

#[test]
fn pictures_and_lines_get_axes_of_size_one() {
    let flat = volume("4 3", "spacings: 2 0.5\n").expect("valid");
    assert_eq!((flat.dims, flat.spacing()), ([4, 3, 1], [2.0, 0.5, 0.5]));
    let turned = volume(
        "4 3",
        "space dimension: 3\nspace directions: (0,0,1) (0,1,0)\n",
    )
    .expect("valid");
    assert_eq!(
        turned.world_from_index.matrix3.z_axis,
        DVec3::new(-1.0, 0.0, 0.0)
    );
    let line = volume("4", "").expect("valid");
    assert_eq!((line.dims, line.spacing()), ([4, 1, 1], [1.0, 1.0, 1.0]));
}

#[test]
fn axes_of_size_one_are_dropped_and_longer_ones_refused() {
    let colour = volume(
        "1 4 3 2",
        "kinds: vector domain domain domain\nspace directions: none (1,0,0) (0,2,0) (0,0,3)\n",
    );
    let colour = colour.expect("one component is a scalar");
    assert_eq!(
        (colour.dims, colour.spacing()),
        ([4, 3, 2], [1.0, 2.0, 3.0])
    );
    assert_eq!(volume("4 3 2 1", "").expect("one time").dims, [4, 3, 2]);
    let cases = [
        (
            "3 4 2",
            "kinds: RGB-color domain domain\n",
            "a voxel has 3 components",
        ),
        (
            "4 3 2 5",
            "kinds: space space space time\n",
            "a voxel has 5 components",
        ),
        (
            "6 4 3 2",
            "space directions: none (1,0,0) (0,1,0) (0,0,1)\n",
            "a voxel has 6 components",
        ),
        (
            "3 4 2 5",
            "kinds: RGB-color space space time\n",
            "axis 3 of size 5 is time, and another axis",
        ),
        ("4 3 2 5", "", "4 axes are longer than 1"),
    ];
    for (sizes, fields, expected) in cases {
        let error = volume(sizes, fields).expect_err("not a scalar volume");
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn faulty_geometry_is_refused() {
    let cases = [
        (
            "space directions: (1,0,0) (0,1,0)\n",
            "'space directions' has 2 entries",
        ),
        (
            "space directions: (1,0,0) (0,1,0) (0,0,1\n",
            "expected vectors such as",
        ),
        (
            "space directions: (1,0,0) (0,1,0) (0,x,1)\n",
            "expected vectors such as",
        ),
        ("space directions: (1,0,0) (0,1,0) (0,1,0)\n", "one plane"),
        (
            "space directions: (1,0,0) (0,1,0) (0,0,nan)\n",
            "not finite",
        ),
        (
            "space directions: (1,0,0) (0,1,0) (0,0,1,2)\n",
            "vector of 4 components",
        ),
        (
            "space directions: (1,0,0) (0,1,0) (5)\n",
            "vector of 1 components",
        ),
        ("space origin: (1,0,0) (0,1,0)\n", "expected one vector"),
        ("spacings: 1 0 1\n", "axis 1 of the volume has length 0"),
        ("spacings: 1 two 1\n", "'spacings' holds 'two'"),
    ];
    for (fields, expected) in cases {
        let text = volume("1 1 1", fields).expect_err("faulty").to_string();
        assert!(text.contains(expected), "{fields}: {text}");
    }
}

const HEAD: &str = "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 2 1 2\n";

fn voxels(folder: &Folder, fields: &str) -> Voxels {
    let path = folder.write("test.nhdr", &[HEAD.as_bytes(), fields.as_bytes()]);
    load(&path, &LoadOptions::default())
        .unwrap_or_else(|error| panic!("{fields}: {error}"))
        .voxels
}

fn refusal(folder: &Folder, fields: &str) -> Error {
    let path = folder.write("test.nhdr", &[HEAD.as_bytes(), fields.as_bytes()]);
    load(&path, &LoadOptions::default()).expect_err("this header must be refused")
}

#[test]
fn one_file_relative_or_absolute() {
    let folder = Folder::new();
    let data = folder.write("my data.raw", &[&[1, 2, 3, 4]]);
    let expected = Voxels::U8(vec![1, 2, 3, 4]);
    assert_eq!(
        voxels(&folder, "encoding: raw\ndata file: my data.raw\n"),
        expected
    );
    assert_eq!(
        voxels(&folder, "encoding: raw\ndatafile: ./my data.raw\n\nignored"),
        expected
    );
    assert_eq!(
        voxels(
            &folder,
            &format!("encoding: raw\ndata file: {}", data.display())
        ),
        expected
    );
}

#[test]
fn lines_and_bytes_are_skipped_before_or_behind_the_packing() {
    let folder = Folder::new();
    let expected = Voxels::U8(vec![1, 2, 3, 4]);
    folder.write("skip.raw", &[b"one\ntwo\nxy", &[1, 2, 3, 4]]);
    assert_eq!(
        voxels(
            &folder,
            "encoding: raw\nline skip: 2\nbyte skip: 2\ndata file: skip.raw\n"
        ),
        expected
    );
    assert_eq!(
        voxels(
            &folder,
            "encoding: raw\nbyteskip: -1\ndata file: skip.raw\n"
        ),
        expected
    );
    folder.write("skip.gz", &[b"one\n", &gzip(&[9, 9, 1, 2, 3, 4])]);
    assert_eq!(
        voxels(
            &folder,
            "encoding: gzip\nlineskip: 1\nbyte skip: 2\ndata file: skip.gz\n"
        ),
        expected,
        "lines are skipped before unpacking, bytes after it"
    );
    folder.write("skip.bz2", &[&bzip2(&[9, 9, 1, 2, 3, 4])]);
    assert_eq!(
        voxels(
            &folder,
            "encoding: bzip2\nbyte skip: 2\ndata file: skip.bz2\n"
        ),
        expected
    );
    folder.write("skip.txt", &[b"a title\n1 2 3 4\n"]);
    assert_eq!(
        voxels(
            &folder,
            "encoding: text\nline skip: 1\ndata file: skip.txt\n"
        ),
        expected
    );
    let text = refusal(
        &folder,
        "encoding: raw\nline skip: 9\ndata file: skip.txt\n",
    )
    .to_string();
    assert!(text.contains("there are only 2 lines"), "{text}");
    let text = refusal(
        &folder,
        "encoding: bzip2\nbyte skip: 99\ndata file: skip.bz2\n",
    )
    .to_string();
    assert!(text.contains("unpacked data has 6 bytes"), "{text}");
}

#[test]
fn lists_and_series_are_joined_in_order() {
    let folder = Folder::new();
    folder.write("a.raw", &[&[1, 2]]);
    folder.write("b 2.raw", &[&[3, 4]]);
    let expected = Voxels::U8(vec![1, 2, 3, 4]);
    assert_eq!(
        voxels(&folder, "encoding: raw\ndata file: LIST\na.raw\nb 2.raw\n"),
        expected
    );
    assert_eq!(
        voxels(
            &folder,
            "encoding: raw\ndata file: LIST 3\r\na.raw\r\nb 2.raw\r\n"
        ),
        expected
    );
    folder.write("s 010.gz", &[&gzip(&[1, 2])]);
    folder.write("s 008.gz", &[&gzip(&[3, 4])]);
    assert_eq!(
        voxels(&folder, "encoding: gzip\ndata file: s %03d.gz 10 8 -2\n"),
        expected
    );
    assert_eq!(
        voxels(&folder, "encoding: gzip\ndata file: s %03d.gz 10 8 -2 2\n"),
        expected
    );
    folder.write("n9.raw", &[&[1, 2]]);
    folder.write("n10.raw", &[&[3, 4]]);
    assert_eq!(
        voxels(&folder, "encoding: raw\ndata file: n%d.raw 9 10 1 1\n"),
        expected
    );
}

#[test]
fn faulty_data_files_are_refused_by_name() {
    let folder = Folder::new();
    folder.write("a.raw", &[&[1, 2]]);
    let error = refusal(&folder, "encoding: raw\ndata file: absent.raw\n");
    assert!(
        matches!(&error, Error::Read { path, .. } if path.ends_with("absent.raw")),
        "{error}"
    );
    let cases = [
        (
            "encoding: raw\ndata file: a.raw\n",
            "a.raw: 4 values of u8 need 4 bytes after skipping 0, there are 2",
        ),
        (
            "encoding: raw\ndata file: LIST\na.raw\n",
            "names 1 files of dimension 2",
        ),
        (
            "encoding: raw\ndata file: LIST 4\na.raw\n",
            "must be 1 to 3",
        ),
        ("encoding: raw\ndata file: x%03d 1 9 1\n", "names 9 files"),
        (
            "encoding: raw\ndata file: x%03d 1 2000000000 1\n",
            "at most 100000",
        ),
        ("encoding: raw\ndata file: x%03d 1 9 0\n", "never reaches"),
        ("encoding: raw\ndata file: x%03d 9 1 2\n", "never reaches"),
        (
            "encoding: raw\ndata file: x%s 1 2 1\n",
            "expected one such as %03d",
        ),
        (
            "encoding: raw\ndata file: x%0999999999d 1 2 1\n",
            "expected one such as %03d",
        ),
        ("encoding: raw\ndata file:\n", "expected a file name"),
    ];
    for (fields, expected) in cases {
        let text = refusal(&folder, fields).to_string();
        assert!(text.contains(expected), "{fields}: {text}");
    }
}
