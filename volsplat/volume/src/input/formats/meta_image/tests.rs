//! MetaImage: small files of every type, byte order and packing, written here and read back.

use crate::Error;
use crate::input::test_files::{Folder, check_components, survive_damage, zlib};
use crate::input::{Format, LoadOptions, format_of, load};
use crate::volume::{Volume, Voxels};

/// A header for 2x1x2 voxels; `fields` come before the data.
fn head(kind: &str, fields: &str) -> String {
    format!(
        "ObjectType = Image\nNDims = 3\nDimSize = 2 1 2\nElementType = {kind}\n{fields}ElementDataFile = LOCAL\n"
    )
}

fn loaded(parts: &[&[u8]]) -> Volume {
    Folder::new()
        .load(parts)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Four values of a type, their type's name, and their bytes in either order.
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
        sample!("MET_UCHAR", U8, u8, [0, 1, 200, 255], u8),
        sample!("MET_CHAR", I8, i8, [0, 1, -128, 127], i8),
        sample!("MET_USHORT", U16, u16, [0, 1, 258, 65535], u16),
        sample!("MET_SHORT", I16, i16, [0, -2, 258, -32768], i16),
        sample!("MET_UINT", U32, u32, [0, 1, 0x0102_0304, u32::MAX], u32),
        sample!("MET_INT", I32, i32, [0, -1, 0x0102_0304, i32::MIN], i32),
        sample!("MET_LONG", I32, i32, [0, -1, 0x0102_0304, i32::MIN], i32),
        sample!("MET_ULONG_LONG", F64, f64, [0, 1, 1 << 53, u64::MAX], u64),
        sample!("MET_FLOAT", F32, f32, [0.0, -1.5, 1e-42, 3e38], f32),
        sample!("MET_DOUBLE", F64, f64, [0.0, -1.5, 1e-310, 3e300], f64),
    ]
}

#[test]
fn every_type_order_and_packing_reads_back() {
    for (kind, expected, little, big) in samples() {
        for (order, bytes) in [("False", little), ("True", big)] {
            let order = format!("BinaryDataByteOrderMSB = {order}\n");
            let packed = format!("{order}CompressedData = True\nCompressedDataSize = 3\n");
            for (fields, data) in [(order, bytes.clone()), (packed, zlib(&bytes))] {
                let volume = loaded(&[head(kind, &fields).as_bytes(), &data]);
                assert_eq!(
                    (volume.dims, &volume.voxels),
                    ([2, 1, 2], &expected),
                    "{kind} {fields}"
                );
            }
        }
    }
}

#[test]
fn text_is_read_and_its_length_checked() {
    let fields = "BinaryData = False\n";
    let volume = loaded(&[head("MET_SHORT", fields).as_bytes(), b"1 -2\n3 4\n"]);
    assert_eq!(volume.voxels, Voxels::I16(vec![1, -2, 3, 4]));
    let text = Folder::new().refusal(&[head("MET_SHORT", fields).as_bytes(), b"1 2 3 "]);
    assert!(text.contains("4 values"), "{text}");
}

#[test]
fn rows_of_the_matrix_are_the_axes_of_the_image() {
    let fields = "Offset = 10 20 30\nTransformMatrix = 0 1 0 -1 0 0 0 0 1\nElementSpacing = 2 3 4\nAnatomicalOrientation = RAI\n";
    let volume = loaded(&[head("MET_UCHAR", fields).as_bytes(), &[0; 4]]);
    let map = volume.world_from_index;
    assert_eq!(map.translation.to_array(), [10.0, 20.0, 30.0]);
    assert_eq!(
        map.matrix3.x_axis.to_array(),
        [0.0, 2.0, 0.0],
        "the first row times the first spacing"
    );
    assert_eq!(
        map.matrix3.y_axis.to_array(),
        [-3.0, 0.0, 0.0],
        "the second row times the second spacing"
    );
    assert_eq!(volume.spacing(), [2.0, 3.0, 4.0]);
    assert_eq!(volume.up_hint.map(|up| up.z), Some(1.0), "the head is up");
    assert_eq!(volume.space.as_deref(), Some("left-posterior-superior"));
}

#[test]
fn aliases_and_defaults_are_known() {
    let fields = "Position = 1 2 3\nRotation = 1 0 0 0 1 0 0 0 -1\nElementSize = 5 6 7\nAnatomicalOrientation = ???\n";
    let volume = loaded(&[head("MET_UCHAR", fields).as_bytes(), &[0; 4]]);
    assert_eq!(
        volume.world_from_index.translation.to_array(),
        [1.0, 2.0, 3.0]
    );
    assert_eq!(volume.world_from_index.matrix3.z_axis.z, -7.0);
    assert_eq!(
        (volume.up_hint, volume.space),
        (None, None),
        "??? says nothing"
    );
    let volume = loaded(&[head("MET_UCHAR", "").as_bytes(), &[0; 4]]);
    assert_eq!(volume.spacing(), [1.0; 3]);
}

#[test]
fn two_axes_are_a_volume_of_one_slice_and_a_fourth_must_be_1() {
    let flat = "NDims = 2\nDimSize = 2 2\nElementSpacing = 2 3\nElementType = MET_UCHAR\nElementDataFile = Local\r\n";
    let volume = loaded(&[flat.as_bytes(), &[1, 2, 3, 4]]);
    assert_eq!(
        (volume.dims, volume.spacing()),
        ([2, 2, 1], [2.0, 3.0, 2.0])
    );
    let four = |last| {
        format!(
            "NDims = 4\nDimSize = 2 1 2 {last}\nElementSpacing = 1 1 1 9\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
        )
    };
    assert_eq!(loaded(&[four(1).as_bytes(), &[1, 2, 3, 4]]).dims, [2, 1, 2]);
    let text = Folder::new().refusal(&[four(2).as_bytes(), &[0; 8]]);
    assert!(text.contains("cut out one volume first"), "{text}");
}

#[test]
fn a_channel_is_chosen_or_asked_for() {
    let folder = Folder::new();
    let head = head("MET_UCHAR", "ElementNumberOfChannels = 3\n");
    let parts: [&[u8]; 2] = [head.as_bytes(), &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]];
    let text = folder.refusal(&parts);
    assert!(
        text.contains("3 components") && text.contains("component=N"),
        "{text}"
    );
    let path = folder.write("rgb.mha", &parts);
    check_components(&path, &LoadOptions::default(), 3);
    let green = load(
        &path,
        &LoadOptions {
            component: Some(1),
            ..LoadOptions::default()
        },
    )
    .expect("chosen");
    assert_eq!(green.voxels, Voxels::U8(vec![2, 5, 8, 11]));
    let beyond = load(
        &path,
        &LoadOptions {
            component: Some(3),
            ..LoadOptions::default()
        },
    );
    assert!(matches!(beyond, Err(Error::Option(_))), "{beyond:?}");
}

#[test]
fn detached_data_is_one_file_a_list_or_a_series() {
    let folder = Folder::new();
    folder.write("one.raw", &[b"xyz", &[1, 2, 3, 4]]);
    folder.write("s 1.raw", &[&[1, 2]]);
    folder.write("s 2.raw", &[&[3, 4]]);
    let base = "NDims = 3\nDimSize = 2 1 2\nElementType = MET_UCHAR\n";
    for data in [
        "HeaderSize = 3\nElementDataFile = one.raw\n",
        "HeaderSize = -1\nElementDataFile = one.raw\n",
        "ElementDataFile = LIST\ns 1.raw\ns 2.raw\n",
        "ElementDataFile = LIST 2D\ns 1.raw\ns 2.raw\n",
        "ElementDataFile = s %d.raw 1 2 1\n",
    ] {
        let path = folder.write("test.mhd", &[base.as_bytes(), data.as_bytes()]);
        assert_eq!(format_of(&path).expect("readable"), Some(Format::MetaImage));
        let volume =
            load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{data}: {error}"));
        assert_eq!(volume.voxels, Voxels::U8(vec![1, 2, 3, 4]), "{data}");
    }
}

#[test]
fn too_little_and_too_much_data_is_refused_with_numbers() {
    let folder = Folder::new();
    let packed = "CompressedData = True\n";
    let huge = "ObjectType = Image\nNDims = 3\nDimSize = 100000 100000 100000\nCompressedData = True\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let cases: [(String, Vec<u8>, &str); 6] = [
        (
            head("MET_UCHAR", ""),
            vec![0; 3],
            "needs 4 bytes of data, there are 3",
        ),
        (
            head("MET_UCHAR", ""),
            vec![0; 5],
            "needs 4 bytes of data, there are 5",
        ),
        (
            head("MET_UCHAR", packed),
            zlib(&[0; 3]),
            "4 bytes are needed, 3 are there",
        ),
        (
            head("MET_UCHAR", packed),
            zlib(&[0; 5]),
            "4 bytes are needed, 5 are there",
        ),
        (huge.to_owned(), zlib(&[0; 100]), "at most"),
        (
            huge.replace("100000 1", "9223372036854775807 1"),
            zlib(&[0; 9]),
            "more voxels than",
        ),
    ];
    for (head, data, expected) in cases {
        let text = folder.refusal(&[head.as_bytes(), &data]);
        assert!(
            text.contains(expected) && text.contains("test.dat"),
            "{head}: {text}"
        );
    }
}

#[test]
fn faulty_headers_name_the_key() {
    let folder = Folder::new();
    let cases = [
        ("DimSize = 2 1\n", "expected 3 numbers"),
        ("DimSize = 2 1 x\n", "DimSize holds 'x'"),
        ("DimSize = 2 0 1\n", "at least 1"),
        ("", "no DimSize"),
        ("DimSize = 1 1 1\n", "no ElementType"),
        (
            "DimSize = 1 1 1\nElementType = MET_STRING\n",
            "ElementType is 'MET_STRING'",
        ),
        (
            "DimSize = 1 1 1\nElementType = MET_UCHAR\nElementSpacing = 1 0 1\n",
            "finite and above 0",
        ),
        (
            "DimSize = 1 1 1\nElementType = MET_UCHAR\nHeaderSize = -2\n",
            "at least -1",
        ),
        (
            "DimSize = 1 1 1\nElementType = MET_UCHAR\nCompressedData = maybe\n",
            "expected True or False",
        ),
        (
            "DimSize = 1 1 1\nElementType = MET_UCHAR\nElementNumberOfChannels = 0\n",
            "expected 1 to 65536",
        ),
        ("DimSize = 1 1 1\nDimSize = 1 1 1\n", "given twice"),
        ("no equals sign\n", "expected 'Key = Value'"),
        ("ObjectType = Tube\nDimSize = 1 1 1\n", "expected Image"),
    ];
    for (fields, expected) in cases {
        let text = folder.refusal(&[
            b"NDims = 3\n",
            fields.as_bytes(),
            b"ElementDataFile = LOCAL\n\0",
        ]);
        assert!(text.contains(expected), "{fields}: {text}");
    }
    assert!(
        folder
            .refusal(&[b"NDims = 3\nDimSize = 1 1 1\n"])
            .contains("no ElementDataFile")
    );
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    let fields = "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 1 2 3\nElementSpacing = 1 1 2\n";
    let data: Vec<u8> = (0..8).collect();
    survive_damage(
        &[head("MET_SHORT", fields).as_bytes(), &data].concat(),
        &LoadOptions::default(),
        1000,
    );
    let packed = [
        head("MET_SHORT", "CompressedData = True\n").into_bytes(),
        zlib(&data),
    ]
    .concat();
    survive_damage(&packed, &LoadOptions::default(), 1000);
}

#[test]
fn text_too_short_for_its_values_is_refused_before_it_is_read() {
    // Four values take a digit and a separator each, but the last: seven bytes.
    let head = head("MET_UCHAR", "BinaryData = False\n");
    assert_eq!(
        loaded(&[head.as_bytes(), b"1 2 3 4"]).voxels,
        Voxels::U8(vec![1, 2, 3, 4])
    );
    for text in [&b"1 2 3 "[..], b"1 2", b""] {
        let error = Folder::new()
            .load(&[head.as_bytes(), text])
            .expect_err("too short");
        let expected = format!("4 values cannot stand in {} bytes", text.len());
        assert!(error.to_string().contains(&expected), "{error}");
    }
}
