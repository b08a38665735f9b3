//! NumPy arrays: small files of every type and order, written here as NumPy writes them and read back.

use crate::Error;
use crate::input::test_files::{Folder, survive_damage};
use crate::input::{Format, LoadOptions, format_of};
use crate::volume::{Volume, Voxels};

/// The header, padded so that the array begins at a multiple of 64 bytes.
fn head(version: u8, descr: &str, order: &str, shape: &str) -> Vec<u8> {
    let mut text = format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}");
    let before = if version == 1 { 10 } else { 12 };
    while !(before + text.len() + 1).is_multiple_of(64) {
        text.push(' ');
    }
    text.push('\n');
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    bytes.extend(&(text.len() as u32).to_le_bytes()[..if version == 1 { 2 } else { 4 }]);
    bytes.extend(text.as_bytes());
    bytes
}

fn loaded(head: &[u8], data: &[u8]) -> Volume {
    Folder::new()
        .load(&[head, data])
        .unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(head: &[u8], data: &[u8]) -> String {
    Folder::new().refusal(&[head, data])
}

#[test]
fn the_last_axis_is_x_in_either_order() {
    let shape = "(2, 3, 4)";
    let values: Vec<u8> = (0..24).collect();
    let volume = loaded(&head(1, "'|u1'", "False", shape), &values);
    assert_eq!(
        (volume.dims, volume.voxels),
        ([4, 3, 2], Voxels::U8(values.clone()))
    );
    // The same array with its first axis fastest: element [z][y][x] stands at z + 2 (y + 3 x).
    let fortran: Vec<u8> = (0..24)
        .map(|i| values[(i % 2 * 3 + i / 2 % 3) * 4 + i / 6])
        .collect();
    assert_ne!(fortran, values, "the orders differ");
    let volume = loaded(&head(1, "'|u1'", "True", shape), &fortran);
    assert_eq!(
        (volume.dims, volume.voxels),
        ([4, 3, 2], Voxels::U8(values))
    );
}

#[test]
fn every_type_and_byte_order_reads_back() {
    macro_rules! check {
        ($code:expr, $kind:ident, $held:ty, $values:expr, $stored:ty) => {{
            let values: [$stored; 2] = $values;
            let expected = Voxels::$kind(values.iter().map(|&v| v as $held).collect());
            let little: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let big: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
            for (version, mark, data) in [(1, '<', &little), (2, '>', &big), (3, '<', &little)] {
                let head = head(version, &format!("'{mark}{}'", $code), "False", "(2,)");
                assert_eq!(loaded(&head, data).voxels, expected, "{mark}{}", $code);
            }
        }};
    }
    check!("u1", U8, u8, [1, 255], u8);
    check!("i1", I8, i8, [1, -128], i8);
    check!("u2", U16, u16, [258, 65535], u16);
    check!("i2", I16, i16, [258, -32768], i16);
    check!("u4", U32, u32, [0x0102_0304, u32::MAX], u32);
    check!("i4", I32, i32, [0x0102_0304, i32::MIN], i32);
    check!("u8", F64, f64, [1 << 53, u64::MAX], u64);
    check!("i8", F64, f64, [1 << 53, i64::MIN], i64);
    check!("f4", F32, f32, [1e-42, -3e38], f32);
    check!("f8", F64, f64, [1e-310, -3e300], f64);
    assert_eq!(
        loaded(&head(1, "'|b1'", "False", "(2,)"), &[0, 1]).voxels,
        Voxels::U8(vec![0, 1]),
        "bool"
    );
}

#[test]
fn fewer_axes_are_padded_and_axes_of_size_1_dropped() {
    let dims = |shape: &str| loaded(&head(1, "'|u1'", "False", shape), &[0; 6]).dims;
    assert_eq!(dims("(6,)"), [6, 1, 1]);
    assert_eq!(dims("(2, 3)"), [3, 2, 1]);
    assert_eq!(dims("(1, 1, 2L, 3)"), [3, 2, 1]);
    assert_eq!(
        loaded(&head(1, "'|u1'", "False", "()"), &[7]).dims,
        [1, 1, 1]
    );
    let text = refusal(&head(1, "'|u1'", "False", "(2, 2, 2, 3)"), &[0; 24]);
    assert!(
        text.contains("[2, 2, 2, 3]") && text.contains("array[0]"),
        "{text}"
    );
}

#[test]
fn what_is_no_scalar_is_refused_with_advice() {
    for descr in [
        "'<f2'",
        "'<c8'",
        "'<U3'",
        "'|O'",
        "'<M8[ns]'",
        "[('a', '<f4')]",
    ] {
        let error = Folder::new()
            .load(&[&head(1, descr, "False", "(1,)"), &[0; 8]])
            .expect_err("no scalar");
        assert!(
            matches!(error, Error::Unsupported { .. }) && error.to_string().contains("save"),
            "{error}"
        );
    }
}

#[test]
fn forged_headers_are_refused_before_memory_is_taken() {
    let small = |shape| head(1, "'<f4'", "False", shape);
    assert!(
        refusal(&small("(2, 2)"), &[0; 15])
            .contains("needs 16 bytes behind the header, there are 15")
    );
    assert!(refusal(&small("(2, 2)"), &[0; 17]).contains("there are 17"));
    assert!(
        refusal(&small("(100000, 100000, 100000)"), &[0; 9]).contains("4000000000000000 bytes")
    );
    assert!(refusal(&small("(9223372036854775807, 3)"), &[0; 9]).contains("more voxels than"));
    assert!(refusal(&small("(-1, 3)"), &[0; 9]).contains("'shape' is '(-1"));
    assert!(refusal(&small("(0, 3)"), &[]).contains("at least 1"));
    assert!(refusal(b"\x93NUMPY\x02\x00\xff\xff\xff\xff{", &[]).contains("at most 10000"));
    assert!(refusal(b"\x93NUMPY\x04\x00", &[]).contains("version 4"));
    assert!(refusal(b"\x93NUMPY\x01\x00\xff\x00{", &[]).contains("cut off"));
    assert!(refusal(&head(1, "'|u1'", "Maybe", "(1,)"), &[0]).contains("True or False"));
}

#[test]
fn the_format_is_told_by_content() {
    let folder = Folder::new();
    let path = folder.write("array", &[&head(1, "'|u1'", "False", "(1,)"), &[0]]);
    assert_eq!(format_of(&path).expect("readable"), Some(Format::Npy));
    assert!(
        folder
            .refusal(&[b"PK\x03\x04", &[0; 9]])
            .contains("unpack it"),
        ".npz is named"
    );
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    let data: Vec<u8> = (0..48).collect();
    let file = [head(1, "'<i2'", "True", "(2, 3, 4)"), data].concat();
    survive_damage(&file, &LoadOptions::default(), 2000);
}
