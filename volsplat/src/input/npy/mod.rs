//! NumPy's `.npy` files: one array of numbers.
//!
//! Takes a path, gives the parts of a volume. An array is indexed `[z][y][x]`, whatever the order in memory: of an array
//! in C order the last axis is fastest, which is how voxels are held here; one in Fortran order is transposed, so that
//! `array[z][y][x]` is voxel (x, y, z) in either. An array of two axes is one slice. The source is NumPy's description
//! of the format, versions 1 to 3. The header is a Python literal of three entries, read here by hand: a general
//! reader of literals can be led into deep recursion by a forged one.
//! Limits: booleans (as 0 and 1), integers, single and double precision; no half precision, complex numbers, records.

use std::io::{BufReader, Read};
use std::path::Path;

use crate::Error;
use crate::input::decode::Layout;
use crate::input::fault::{Fault, excerpt, unsupported};
use crate::input::{Parts, axes, cannot_read, decode, open};
use crate::volume::{Endian, VoxelType, Voxels, voxel_count};

/// The first bytes of every file; two bytes of version follow.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// Longest header that is read: NumPy itself refuses more than 10 000 characters.
const MAX_HEADER_BYTES: usize = 10_000;

/// Order of the array in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    /// The last axis is fastest.
    C,
    /// The first axis is fastest.
    Fortran,
}

/// What the header says.
struct Header {
    voxel_type: VoxelType,
    endian: Endian,
    order: Order,
    shape: Vec<usize>,
    /// Bytes before the array.
    bytes: u64,
}

pub(super) fn load(path: &Path) -> Result<Parts, Error> {
    let file = open(path)?;
    let total = file
        .metadata()
        .map_err(|source| cannot_read(path, source))?
        .len();
    read(&mut BufReader::new(file), total).map_err(|fault| fault.at(path))
}

fn read(file: &mut dyn Read, total: u64) -> Result<Parts, Fault> {
    let header = read_header(file)?;
    let dims = dims(&header.shape)?;
    let layout = Layout {
        voxel_type: header.voxel_type,
        endian: header.endian,
        count: voxel_count(dims)?,
    };
    check_length(&header, &layout, total)?;
    let voxels = decode::binary(file, &layout)?;
    let voxels = if header.order == Order::C {
        voxels
    } else {
        transposed(voxels, dims)
    };
    let world_from_index = axes::upright([1.0; 3], [0.0; 3]);
    Ok(Parts {
        dims,
        voxels,
        world_from_index,
        up_hint: None,
        space: None,
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

fn read_header(file: &mut dyn Read) -> Result<Header, Fault> {
    let mut take = |count: usize| -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let got = (&mut *file)
            .take(count as u64)
            .read_to_end(&mut bytes)
            .map_err(|error| decode::broken(&error))?;
        if got == count {
            Ok(bytes)
        } else {
            Err("the header is cut off".to_owned())
        }
    };
    let version = take(MAGIC.len() + 2)?[MAGIC.len()];
    let length_bytes = match version {
        1 => 2,
        2 | 3 => 4,
        other => {
            return Err(unsupported(format!(
                "version {other} of the format: 1 to 3 are read"
            )));
        }
    };
    let length = take(length_bytes)?
        .iter()
        .rev()
        .fold(0, |length, &byte| (length << 8) | usize::from(byte));
    if length > MAX_HEADER_BYTES {
        return Err(Fault::Invalid(format!(
            "a header of {length} bytes: expected at most {MAX_HEADER_BYTES}"
        )));
    }
    let text = String::from_utf8_lossy(&take(length)?).into_owned();
    let (voxel_type, endian) = element(entry(&text, "descr")?)?;
    Ok(Header {
        voxel_type,
        endian,
        order: order(entry(&text, "fortran_order")?)?,
        shape: shape(entry(&text, "shape")?)?,
        bytes: (MAGIC.len() + 2 + length_bytes + length) as u64,
    })
}

/// What stands behind the colon of a key, up to the end of the header.
fn entry<'a>(text: &'a str, key: &str) -> Result<&'a str, String> {
    let behind = text
        .split_once(&format!("'{key}'"))
        .and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
    behind
        .map(str::trim_start)
        .ok_or_else(|| format!("the header '{}' has no entry '{key}'", excerpt(text)))
}

fn element(text: &str) -> Result<(VoxelType, Endian), Fault> {
    let Some((code, _)) = text
        .strip_prefix('\'')
        .and_then(|rest| rest.split_once('\''))
    else {
        return Err(unsupported(
            "an array of records: save one field of it".to_owned(),
        ));
    };
    let endian = if code.starts_with('>') {
        Endian::Big
    } else {
        Endian::Little
    };
    let voxel_type = match code.trim_start_matches(['<', '>', '|', '=']) {
        "b1" | "u1" => VoxelType::U8,
        "i1" => VoxelType::I8,
        "u2" => VoxelType::U16,
        "i2" => VoxelType::I16,
        "u4" => VoxelType::U32,
        "i4" => VoxelType::I32,
        "u8" => VoxelType::U64,
        "i8" => VoxelType::I64,
        "f4" => VoxelType::F32,
        "f8" => VoxelType::F64,
        _ => {
            let code = excerpt(code);
            return Err(unsupported(format!(
                "elements of type '{code}': save the array as integers, float32 or float64 (array.astype)"
            )));
        }
    };
    Ok((voxel_type, endian))
}

fn order(text: &str) -> Result<Order, String> {
    match text {
        _ if text.starts_with("False") => Ok(Order::C),
        _ if text.starts_with("True") => Ok(Order::Fortran),
        _ => Err(format!(
            "'fortran_order' is '{}': expected True or False",
            excerpt(text)
        )),
    }
}

fn shape(text: &str) -> Result<Vec<usize>, String> {
    let fault = || {
        format!(
            "'shape' is '{}': expected whole numbers such as (3, 4, 5)",
            excerpt(text)
        )
    };
    let (inside, _) = text
        .strip_prefix('(')
        .and_then(|rest| rest.split_once(')'))
        .ok_or_else(fault)?;
    let words = inside
        .split(',')
        .map(str::trim)
        .filter(|word| !word.is_empty());
    // Python 2 wrote long integers with an L.
    words
        .map(|word| word.trim_end_matches('L').parse().map_err(|_| fault()))
        .collect()
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
    match voxels {
        Voxels::U8(values) => Voxels::U8(transposed_values(&values, dims)),
        Voxels::I8(values) => Voxels::I8(transposed_values(&values, dims)),
        Voxels::U16(values) => Voxels::U16(transposed_values(&values, dims)),
        Voxels::I16(values) => Voxels::I16(transposed_values(&values, dims)),
        Voxels::U32(values) => Voxels::U32(transposed_values(&values, dims)),
        Voxels::I32(values) => Voxels::I32(transposed_values(&values, dims)),
        Voxels::F32(values) => Voxels::F32(transposed_values(&values, dims)),
        Voxels::F64(values) => Voxels::F64(transposed_values(&values, dims)),
    }
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
mod tests;
