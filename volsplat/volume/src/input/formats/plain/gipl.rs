//! GIPL of Guy's Hospital, `.gipl`, `.gipl.gz`: a header of 256 bytes in big endian, then the voxels, x fastest.
//!
//! Source: the format as the Image Processing Library of Guy's, King's and St Thomas' describes it. Millimetres.
//! Limits: no bits, no complex numbers; of several volumes the first.

use std::io::Read;
use std::path::Path;

use resample_io::Gate;

use crate::Error;
use crate::input::decode;
use crate::input::decode::Layout;
use crate::input::decode::stored::Stream;
use crate::input::file::{Fault, Parts, unsupported};
use crate::volume::{Endian, Lattice, VoxelType, voxel_count};

const HEADER_BYTES: usize = 256;

/// The two marks of the format, and their place.
const MARKS: [u32; 2] = [0xefff_e9b0, 0x2ae3_89b8];
const MARK_AT: usize = 252;

fn short(bytes: &[u8], at: usize) -> u16 {
    u16::from_be_bytes([bytes[at], bytes[at + 1]])
}

fn word(bytes: &[u8], at: usize) -> [u8; 4] {
    [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]
}

/// Returns true if an unpacked file that begins with `head` is of this format.
pub(crate) fn begins(head: &[u8]) -> bool {
    head.len() >= HEADER_BYTES && MARKS.contains(&u32::from_be_bytes(word(head, MARK_AT)))
}

/// Reads the volume.
pub(crate) fn load(path: &Path, gate: &Gate) -> Result<Parts, Error> {
    let mut stream = Stream::open(path)?;
    read(&mut stream, gate).map_err(|fault| fault.at(path))
}

fn read(stream: &mut Stream, gate: &Gate) -> Result<Parts, Fault> {
    let header = stream.header(HEADER_BYTES)?;
    let size = |axis: usize| usize::from(short(&header, 2 * axis)).max(1);
    let dims = [0, 1, 2].map(size);
    let voxel_type = match short(&header, 8) {
        7 => VoxelType::I8,
        8 => VoxelType::U8,
        15 => VoxelType::I16,
        16 => VoxelType::U16,
        31 => VoxelType::U32,
        32 => VoxelType::I32,
        64 => VoxelType::F32,
        65 => VoxelType::F64,
        other => {
            return Err(unsupported(format!(
                "its type (byte 8) is {other}: expected integers or real numbers, such as 15 for 16 bits"
            )));
        }
    };
    let spacing = [0, 1, 2].map(|axis| {
        let spacing = f64::from(f32::from_be_bytes(word(&header, 10 + 4 * axis)));
        if spacing > 0.0 && spacing.is_finite() {
            spacing
        } else {
            1.0
        }
    });
    let origin = [0, 1, 2].map(|axis| {
        let bytes: [u8; 8] = std::array::from_fn(|i| header[204 + 8 * axis + i]);
        let place = f64::from_be_bytes(bytes);
        if place.is_finite() { place } else { 0.0 }
    });
    let layout = Layout {
        voxel_type,
        endian: Endian::Big,
        count: voxel_count(dims)?,
    };
    let voxels = layout.bytes()?;
    let all = voxels.saturating_add(HEADER_BYTES as u64);
    if stream.is_packed {
        decode::check_expansion(all, stream.held)?;
        decode::check_deflated(all, stream.held, gate)?;
    } else if all > stream.held {
        let ([x, y, z], held) = (dims, stream.held);
        return Err(Fault::Invalid(format!(
            "the header promises {x}x{y}x{z} voxels of {}, which are {all} bytes with it, but {held} are there: \
             the file is cut off or its sizes are wrong",
            voxel_type.name()
        )));
    }
    Ok(Parts {
        lattice: Lattice {
            unit: Some("mm".to_owned()),
            ..Lattice::unnamed(dims, decode::upright(spacing, origin))
        },
        voxels: vec![decode::binary(
            &mut (&mut stream.bytes).take(voxels),
            &layout,
        )?],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::test_files::{Folder, gzip, survive_damage};
    use crate::input::{Format, LoadOptions, format_of, load};
    use crate::volume::Voxels;

    fn file() -> Vec<u8> {
        let mut bytes = vec![0; HEADER_BYTES];
        let mut put = |at: usize, part: &[u8]| bytes[at..at + part.len()].copy_from_slice(part);
        for (axis, size) in [3u16, 2, 1].into_iter().enumerate() {
            put(2 * axis, &size.to_be_bytes());
            put(10 + 4 * axis, &(0.5 + axis as f32).to_be_bytes());
            put(204 + 8 * axis, &(10.0 * axis as f64).to_be_bytes());
        }
        put(8, &15u16.to_be_bytes());
        put(MARK_AT, &MARKS[0].to_be_bytes());
        bytes.extend(
            [-1i16, 2, 300, 4, 5, 6]
                .iter()
                .flat_map(|v| v.to_be_bytes()),
        );
        bytes
    }

    #[test]
    fn sizes_places_and_numbers_are_those_of_the_file() {
        let folder = Folder::new();
        for bytes in [file(), gzip(&file())] {
            let path = folder.write("a.gipl", &[&bytes]);
            assert_eq!(format_of(&path).expect("readable"), Some(Format::Gipl));
            let volume = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(volume.voxels, Voxels::I16(vec![-1, 2, 300, 4, 5, 6]));
            assert_eq!(
                (volume.dims, volume.spacing()),
                ([3, 2, 1], [0.5, 1.5, 2.5])
            );
            assert_eq!(
                volume.world_from_index.translation.to_array(),
                [0.0, 10.0, 20.0]
            );
        }
        let cut = &file()[..HEADER_BYTES + 11];
        assert!(folder.refusal(&[cut]).contains("cut off"));
        survive_damage(&file(), &LoadOptions::default(), 200);
    }
}
