//! NumPy's `.npy` files: one array of numbers.
//!
//! Takes a path, gives the parts of a volume. An array is indexed `[z][y][x]`, whatever the order in memory: of an array
//! in C order the last axis is fastest, which is how voxels are held here; one in Fortran order is transposed, so that
//! `array[z][y][x]` is voxel (x, y, z) in either. An array of two axes is one slice. `resample_io` reads
//! the header.
//! Limits: booleans (as 0 and 1), integers, single and double precision; no half precision, complex numbers, records.

use std::io::{BufReader, Read};
use std::path::Path;

use resample_io::npy;
use resample_io::npy::{Element, Header, Kind, Order, other_type};

use crate::Error;
use crate::input::decode::Layout;
use crate::input::file::{Fault, unsupported};
use crate::input::{Parts, decode, open_sized};
use crate::volume::{Endian, Lattice, VoxelType, Voxels, map_voxels, voxel_count};

pub(crate) use resample_io::npy::MAGIC;

pub(crate) fn load(path: &Path) -> Result<Parts, Error> {
    let (file, total) = open_sized(path)?;
    read(&mut BufReader::new(file), total).map_err(|fault| fault.at(path))
}

pub(crate) fn read(file: &mut dyn Read, total: u64) -> Result<Parts, Fault> {
    let header = Header::read(file)?;
    let dims = dims(&header.shape)?;
    let layout = layout(header.element, voxel_count(dims)?)?;
    check_length(&header, &layout, total)?;
    let voxels = decode::binary(file, &layout)?;
    let voxels = if header.order == Order::C {
        voxels
    } else {
        transposed(voxels, dims)
    };
    Ok(Parts {
        lattice: Lattice::unnamed(dims, decode::upright([1.0; 3], [0.0; 3])),
        voxels: vec![voxels],
    })
}

fn check_length(header: &Header, layout: &Layout, total: u64) -> Result<(), String> {
    let (needed, held) = (layout.bytes()?, total.saturating_sub(header.bytes));
    if needed == held {
        return Ok(());
    }
    let (shape, name) = (&header.shape, layout.voxel_type.name());
    Err(format!(
        "an array of shape {shape:?} of {name} needs {needed} bytes behind the header, there are {held}"
    ))
}

fn layout(element: Element, count: usize) -> Result<Layout, Fault> {
    let voxel_type = match (element.kind, element.bytes) {
        (Kind::Unsigned, 1) => VoxelType::U8,
        (Kind::Unsigned, 2) => VoxelType::U16,
        (Kind::Unsigned, 4) => VoxelType::U32,
        (Kind::Unsigned, 8) => VoxelType::U64,
        (Kind::Signed, 1) => VoxelType::I8,
        (Kind::Signed, 2) => VoxelType::I16,
        (Kind::Signed, 4) => VoxelType::I32,
        (Kind::Signed, 8) => VoxelType::I64,
        (Kind::Float, 4) => VoxelType::F32,
        (Kind::Float, 8) => VoxelType::F64,
        _ => return Err(unsupported(other_type(&element.to_string()))),
    };
    let endian = match element.endian {
        npy::Endian::Little => Endian::Little,
        npy::Endian::Big => Endian::Big,
    };
    Ok(Layout {
        voxel_type,
        endian,
        count,
    })
}

/// x, y and z sizes of an array `[z][y][x]`. Of more than three axes, those of size 1 go, the first ones first.
fn dims(shape: &[usize]) -> Result<[usize; 3], Fault> {
    let mut axes = shape.to_vec();
    while axes.len() > 3 {
        let Some(place) = axes.iter().position(|&size| size == 1) else {
            return Err(unsupported(format!(
                "an array of shape {shape:?}: a volume has three axes, so save one volume of it, such as array[0]"
            )));
        };
        axes.remove(place);
    }
    let mut dims = [1; 3];
    dims.iter_mut()
        .zip(axes.iter().rev())
        .for_each(|(dim, &size)| *dim = size);
    Ok(dims)
}

/// From the first axis fastest to the last axis fastest.
fn transposed(voxels: Voxels, dims: [usize; 3]) -> Voxels {
    map_voxels!(voxels, values => transposed_values(&values, dims))
}

fn transposed_values<T: Copy>(values: &[T], [x_size, y_size, z_size]: [usize; 3]) -> Vec<T> {
    let mut result = Vec::with_capacity(values.len());
    for z in 0..z_size {
        for y in 0..y_size {
            result.extend((0..x_size).map(|x| values[(x * y_size + y) * z_size + z]));
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use crate::Error;
    use crate::input::test_files::{Folder, survive_damage};
    use crate::input::{Format, LoadOptions, format_of};
    use crate::volume::{Volume, Voxels};

    /// The header, padded so that the array begins at a multiple of 64 bytes.
    fn head(version: u8, descr: &str, order: &str, shape: &str) -> Vec<u8> {
        let mut text =
            format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}");
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
                for (version, mark, data) in [(1, '<', &little), (2, '>', &big), (3, '<', &little)]
                {
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
}
