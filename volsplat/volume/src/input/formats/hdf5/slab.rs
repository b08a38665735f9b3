//! A part of an array as voxels: one element of some axes, and all or the first elements of the others.

use hdf5_reader::FilterRegistry;
use netcdf_reader::{NcFile, NcReadable, NcSliceInfo, NcSliceInfoElem, NcType};
use resample_io::Gate;

use crate::input::file::{Fault, unsupported};
use crate::input::formats::zarr::codecs::{Packing, unpacked_chunk};
use crate::volume::Voxels;

/// The elements of an axis that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    /// One.
    Only(usize),
    /// So many, from the first on.
    First(usize),
}

/// Numbers of filters in the registry of the HDF Group.
const LZF: u16 = 32000;
const BLOSC: u16 = 32001;
const ZSTD: u16 = 32015;

/// The filters of the format, and those that h5py and Python's `hdf5plugin` add most often.
pub(crate) fn filters(most_bytes: usize) -> FilterRegistry {
    let mut all = FilterRegistry::new();
    let failed = |what: String| hdf5_reader::error::Error::DecompressionError(what);
    all.register(
        LZF,
        Box::new(move |_, packed, _| unpack_lzf(packed, most_bytes).map_err(failed)),
    );
    for (number, packing) in [(BLOSC, Packing::Blosc), (ZSTD, Packing::Zstd)] {
        let unpack = move |packed: &[u8]| unpacked_chunk(packing, packed, most_bytes);
        all.register(
            number,
            Box::new(move |_, packed, _| unpack(packed).map_err(failed)),
        );
    }
    all
}

/// LZF: a byte below 32 is followed by so many literal bytes and one more; others copy 3 to 264 bytes from up to 8192 back.
fn unpack_lzf(packed: &[u8], most_bytes: usize) -> Result<Vec<u8>, String> {
    let cut = || "an LZF block is cut off".to_owned();
    let mut unpacked = Vec::new();
    let mut rest = packed.iter().copied().map(usize::from);
    while let Some(control) = rest.next() {
        if control < 32 {
            for _ in 0..=control {
                unpacked.push(rest.next().ok_or_else(cut)? as u8);
            }
        } else {
            let mut length = 2 + (control >> 5);
            if length == 9 {
                length += rest.next().ok_or_else(cut)?;
            }
            let back = 1 + ((control & 31) << 8) + rest.next().ok_or_else(cut)?;
            let from = unpacked.len().checked_sub(back);
            let from = from.ok_or("an LZF block copies from before its start")?;
            for place in from..from + length {
                unpacked.push(unpacked[place]);
            }
        }
        if unpacked.len() > most_bytes {
            return Err(format!(
                "an LZF block unpacks to more than {most_bytes} bytes"
            ));
        }
    }
    Ok(unpacked)
}

/// Reads a part of an array of a file that holds so many bytes. `is_unsigned` takes signed integers for unsigned ones, as some conventions of NetCDF do.
pub(crate) fn read(
    file: &NcFile,
    (path, of, is_unsigned): (&str, &NcType, bool),
    taken: &[Taken],
    (gate, held): (&Gate, u64),
) -> Result<Voxels, Fault> {
    let count = taken.iter().try_fold(1u64, |count, taken| match taken {
        Taken::Only(_) => Some(count),
        Taken::First(size) => count.checked_mul(*size as u64),
    });
    let bytes = count.and_then(|count| count.checked_mul(of.size().ok()? as u64));
    // Chunks are unpacked beside the voxels.
    gate.ask_unpacked(
        bytes.unwrap_or(u64::MAX).saturating_mul(2),
        held,
        "the voxels",
    )?;
    let part = (file, path, taken);
    Ok(match (of, is_unsigned) {
        (NcType::Byte, true) => Voxels::U8(cast(elements(part)?, |v: i8| v as u8)),
        (NcType::Short, true) => Voxels::U16(cast(elements(part)?, |v: i16| v as u16)),
        (NcType::Int, true) => Voxels::U32(cast(elements(part)?, |v: i32| v as u32)),
        (NcType::Byte, false) => Voxels::I8(elements(part)?),
        (NcType::UByte, _) => Voxels::U8(elements(part)?),
        (NcType::Short, false) => Voxels::I16(elements(part)?),
        (NcType::UShort, _) => Voxels::U16(elements(part)?),
        (NcType::Int, false) => Voxels::I32(elements(part)?),
        (NcType::UInt, _) => Voxels::U32(elements(part)?),
        (NcType::Int64, _) => Voxels::F64(cast(elements(part)?, |v: i64| v as f64)),
        (NcType::UInt64, _) => Voxels::F64(cast(elements(part)?, |v: u64| v as f64)),
        (NcType::Float, _) => Voxels::F32(elements(part)?),
        (NcType::Double, _) => Voxels::F64(elements(part)?),
        (NcType::Enum { base, .. }, _) if base.size().is_ok_and(|size| size == 1) => {
            Voxels::U8(whole(part)?)
        }
        _ => {
            return Err(unsupported(format!(
                "the array {path} does not hold integers or real numbers of 32 or 64 bits"
            )));
        }
    })
}

/// Elements of one byte, booleans among them, which are read as a whole.
fn whole((file, path, taken): (&NcFile, &str, &[Taken])) -> Result<Vec<u8>, Fault> {
    let read = file.read_variable_native_bytes(path);
    let all = read.map_err(|error| format!("the array {path} cannot be read: {error}"))?;
    if all.len() == count(taken) {
        return Ok(all);
    }
    Err(unsupported(format!(
        "the array {path} holds names of numbers (an enumeration) on more than three axes: save one volume of it"
    )))
}

fn cast<S, T>(values: Vec<S>, to: impl Fn(S) -> T) -> Vec<T> {
    values.into_iter().map(to).collect()
}

fn elements<T: NcReadable>(
    (file, path, taken): (&NcFile, &str, &[Taken]),
) -> Result<Vec<T>, Fault> {
    let selections = taken.iter().map(|taken| match *taken {
        Taken::Only(index) => NcSliceInfoElem::Index(index as u64),
        Taken::First(size) => NcSliceInfoElem::Slice {
            start: 0,
            end: size as u64,
            step: 1,
        },
    });
    let part = NcSliceInfo {
        selections: selections.collect(),
    };
    let read = file.read_variable_slice::<T>(path, &part);
    let array = read.map_err(|error| format!("the array {path} cannot be read: {error}"))?;
    let expected = count(taken);
    let (values, start) = array.into_raw_vec_and_offset();
    if values.len() != expected || start.is_some_and(|start| start != 0) {
        return Err(Fault::Invalid(format!(
            "the array {path} gave {} elements: expected {expected}",
            values.len()
        )));
    }
    Ok(values)
}

fn count(taken: &[Taken]) -> usize {
    let sizes = taken.iter().map(|taken| match taken {
        Taken::Only(_) => 1,
        Taken::First(size) => *size,
    });
    sizes.product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lzf_copies_what_came_before() {
        // Three letters, then five bytes from three back, which overlap themselves.
        let packed = [2, b'a', b'b', b'c', 3 << 5, 2];
        assert_eq!(unpack_lzf(&packed, 100).expect("whole"), b"abcabcab");
        // A long copy: 9 and 20 more.
        let long = [0, b'x', 7 << 5, 20, 0];
        assert_eq!(unpack_lzf(&long, 100).expect("whole"), [b'x'; 30]);
        for bad in [&packed[..3], &packed[..5], &[32, 9][..]] {
            unpack_lzf(bad, 100).expect_err("cut off, or before the start");
        }
        assert!(unpack_lzf(&long, 20).is_err(), "larger than allowed");
    }
}
