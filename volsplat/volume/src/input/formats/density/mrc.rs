//! Maps of electron microscopes and of crystals, MRC and CCP4: `.mrc`, `.map`, `.ccp4`, plain or packed by gzip.
//!
//! Takes a path, gives the parts of a volume. A header of 1024 bytes has fixed places, in the byte order that a stamp names: sizes, type, the
//! cell and its divisions, the cell's axis along each axis of the file, and the place of the first voxel. An extended header follows, and
//! then the voxels, the first axis fastest.
//! Source: the MRC2014 format (Cheng et al., J. Struct. Biol. 192, 2015). World units are those of the cell, angstroms.
//! Limits: integers of 8 and 16 bits and floats of 32; no complex transforms, half floats or stacks of separate pictures as such.

use std::io::Read;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use resample_io::Gate;

use crate::Error;
use crate::input::decode;
use crate::input::decode::Layout;
use crate::input::decode::stored::Stream;
use crate::input::file::{Fault, Parts, unsupported};
use crate::volume::{Endian, Lattice, VoxelType, voxel_count};

/// Bytes before the extended header.
const HEADER_BYTES: usize = 1024;

/// The mark, and its place.
const MARK: (usize, &[u8]) = (208, b"MAP ");

/// The facts of the header.
struct Header {
    dims: [usize; 3],
    voxel_type: VoxelType,
    endian: Endian,
    /// Bytes of the extended header.
    extended: u64,
    world_from_index: DAffine3,
}

/// Returns true if an unpacked file that begins with `head` is of this format.
pub(crate) fn begins(head: &[u8]) -> bool {
    let (at, mark) = MARK;
    head.get(at..).is_some_and(|rest| rest.starts_with(mark))
}

/// Reads the volume.
pub(crate) fn load(path: &Path, gate: &Gate) -> Result<Parts, Error> {
    let mut stream = Stream::open(path)?;
    read(&mut stream, gate).map_err(|fault| fault.at(path))
}

fn read(stream: &mut Stream, gate: &Gate) -> Result<Parts, Fault> {
    let bytes = stream.header(HEADER_BYTES)?;
    let header = header(&bytes)?;
    let layout = Layout {
        voxel_type: header.voxel_type,
        endian: header.endian,
        count: voxel_count(header.dims)?,
    };
    let voxels = layout.bytes()?;
    let all = voxels
        .saturating_add(header.extended)
        .saturating_add(HEADER_BYTES as u64);
    if stream.is_packed {
        decode::check_expansion(all, stream.held)?;
        decode::check_deflated(all, stream.held, gate)?;
    } else if all > stream.held {
        let ([x, y, z], held) = (header.dims, stream.held);
        return Err(Fault::Invalid(format!(
            "the header promises {x}x{y}x{z} voxels of {}, which are {all} bytes with the headers, but {held} are there: \
             the file is cut off or its sizes are wrong",
            layout.voxel_type.name()
        )));
    }
    stream.pass(header.extended)?;
    Ok(Parts {
        lattice: Lattice {
            unit: Some("Å".to_owned()),
            ..Lattice::unnamed(header.dims, header.world_from_index)
        },
        voxels: vec![decode::binary(
            &mut (&mut stream.bytes).take(voxels),
            &layout,
        )?],
    })
}

/// The numbers of a header, four bytes each.
struct Words<'a> {
    bytes: &'a [u8],
    endian: Endian,
}

impl Words<'_> {
    fn bytes_at(&self, at: usize) -> [u8; 4] {
        let mut bytes = [0; 4];
        bytes.copy_from_slice(&self.bytes[at..at + 4]);
        if self.endian == Endian::Big {
            bytes.reverse();
        }
        bytes
    }

    fn whole(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.bytes_at(at))
    }

    fn number(&self, at: usize) -> f64 {
        f64::from(f32::from_le_bytes(self.bytes_at(at)))
    }
}

fn header(bytes: &[u8]) -> Result<Header, Fault> {
    // Some programs leave the stamp out; a size of 2^24 or more in one order is a small one in the other.
    let little = Words {
        bytes,
        endian: Endian::Little,
    };
    let endian = match bytes[212] {
        0x11 => Endian::Big,
        0x44 => Endian::Little,
        _ if (1..1 << 24).contains(&little.whole(0)) => Endian::Little,
        _ => Endian::Big,
    };
    let words = Words { bytes, endian };
    let size = |at: usize, name: &str| {
        let size = words.whole(at);
        usize::try_from(size)
            .ok()
            .filter(|&size| size > 0)
            .ok_or_else(|| format!("{name} (byte {at}) is {size}: expected at least 1"))
    };
    let dims = [size(0, "NX")?, size(4, "NY")?, size(8, "NZ")?];
    let voxel_type = match words.whole(12) {
        0 => VoxelType::I8,
        1 => VoxelType::I16,
        2 => VoxelType::F32,
        6 => VoxelType::U16,
        other => {
            let what = match other {
                3 | 4 => "complex numbers, a transform",
                12 => "half floats",
                101 => "4 bits a voxel",
                _ => "unknown",
            };
            return Err(unsupported(format!(
                "its type (MODE, byte 12) is {other}, {what}: save it as floats (mode 2)"
            )));
        }
    };
    Ok(Header {
        dims,
        voxel_type,
        endian,
        extended: u64::from(words.whole(92).max(0).unsigned_abs()),
        world_from_index: place(&words)?,
    })
}

/// Where the voxels lie: the cell divided along its axes, from the place of the first voxel on.
fn place(words: &Words) -> Result<DAffine3, Fault> {
    // The axis of the cell along each axis of the file, counted from 1; some programs leave them 0.
    let mut axes = [64, 68, 72].map(|at| words.whole(at));
    if axes == [0; 3] {
        axes = [1, 2, 3];
    }
    let mut sorted = axes;
    sorted.sort_unstable();
    if sorted != [1, 2, 3] {
        return Err(Fault::Invalid(format!(
            "its axes (MAPC, MAPR, MAPS, byte 64) are {axes:?}: expected 1, 2 and 3, each once"
        )));
    }
    let axes = axes.map(|axis| (axis.unsigned_abs() - 1) as usize);
    let spacing = |axis: usize| {
        let (length, parts) = (words.number(40 + 4 * axis), words.whole(28 + 4 * axis));
        let spacing = length / f64::from(parts);
        if spacing > 0.0 && spacing.is_finite() {
            spacing
        } else {
            1.0
        }
    };
    let unit = cell_directions([52, 56, 60].map(|at| words.number(at)));
    let along = [0, 1, 2].map(|axis| unit.col(axis) * spacing(axis));
    let columns = axes.map(|axis| along[axis]);
    let start: DVec3 = [0, 1, 2]
        .map(|file_axis| columns[file_axis] * f64::from(words.whole(16 + 4 * file_axis)))
        .into_iter()
        .sum();
    let origin = DVec3::from_array([196, 200, 204].map(|at| words.number(at)));
    // A map has one of the two; those of microscopes have the origin.
    let first = if origin.is_finite() && origin != DVec3::ZERO {
        origin
    } else {
        start
    };
    Ok(DAffine3::from_mat3_translation(
        DMat3::from_cols(columns[0], columns[1], columns[2]),
        first,
    ))
}

/// Unit directions of a cell's axes, by its angles in degrees: the first along x, the second in the plane of x and y.
fn cell_directions([alpha, beta, gamma]: [f64; 3]) -> DMat3 {
    let [a, b, c] = [alpha, beta, gamma].map(|angle| {
        // Right angles are exact, and what is none counts as one.
        if angle == 90.0 || !(1.0..179.0).contains(&angle) {
            0.0
        } else {
            angle.to_radians().cos()
        }
    });
    let sine = (1.0 - c * c).sqrt();
    let y = (a - b * c) / sine;
    let z = 1.0 - b * b - y * y;
    if !(z > 0.0) {
        return DMat3::IDENTITY;
    }
    DMat3::from_cols(
        DVec3::X,
        DVec3::new(c, sine, 0.0),
        DVec3::new(b, y, z.sqrt()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::test_files::{Folder, gzip, survive_damage};
    use crate::input::{Format, LoadOptions, format_of};
    use crate::volume::Voxels;

    /// 3x2x2 voxels of a mode in a cell of 6x3x4 units, divided in 3, 2 and 2.
    fn header(mode: i32, order: Endian) -> Vec<u8> {
        let mut bytes = vec![0; HEADER_BYTES];
        let mut put = |at: usize, word: [u8; 4]| {
            let word = match order {
                Endian::Little => word,
                Endian::Big => [word[3], word[2], word[1], word[0]],
            };
            bytes[at..at + 4].copy_from_slice(&word);
        };
        for (at, value) in [
            (0, 3),
            (4, 2),
            (8, 2),
            (12, mode),
            (16, 10),
            (28, 3),
            (32, 2),
            (36, 2),
            (64, 1),
            (68, 2),
            (72, 3),
        ] {
            put(at, i32::to_le_bytes(value));
        }
        for (at, value) in [
            (40, 6.0),
            (44, 3.0),
            (48, 4.0),
            (52, 90.0),
            (56, 90.0),
            (60, 90.0),
        ] {
            put(at, f32::to_le_bytes(value));
        }
        bytes[208..212].copy_from_slice(b"MAP ");
        bytes[212] = match order {
            Endian::Little => 0x44,
            Endian::Big => 0x11,
        };
        bytes
    }

    fn floats() -> Vec<f32> {
        (0..12).map(|i| i as f32 - 2.5).collect()
    }

    #[test]
    fn maps_of_both_byte_orders_read_back_packed_or_not() {
        let folder = Folder::new();
        for order in [Endian::Little, Endian::Big] {
            let bytes = |value: f32| match order {
                Endian::Little => value.to_le_bytes(),
                Endian::Big => value.to_be_bytes(),
            };
            let file = [
                header(2, order),
                floats().into_iter().flat_map(bytes).collect(),
            ]
            .concat();
            for file in [gzip(&file), file] {
                let path = folder.write("a", &[&file]);
                assert_eq!(format_of(&path).expect("readable"), Some(Format::Mrc));
                let volume = crate::load(&path, &LoadOptions::default()).expect("a good map");
                assert_eq!(
                    (volume.dims, &volume.voxels),
                    ([3, 2, 2], &Voxels::F32(floats()))
                );
                assert_eq!(volume.spacing(), [2.0, 1.5, 2.0]);
                assert_eq!(
                    volume.world_from_index.translation,
                    DVec3::new(20.0, 0.0, 0.0)
                );
            }
        }
    }

    #[test]
    fn axes_angles_and_extended_headers_are_followed() {
        let mut file = header(0, Endian::Little);
        // The first axis of the file is z of the cell, whose x and y meet at 120 degrees.
        for (at, axis) in [(64, 3), (68, 1), (72, 2)] {
            file[at..at + 4].copy_from_slice(&i32::to_le_bytes(axis));
        }
        file[16..20].copy_from_slice(&[0; 4]);
        file[60..64].copy_from_slice(&120f32.to_le_bytes());
        file[92..96].copy_from_slice(&5i32.to_le_bytes());
        file[196..200].copy_from_slice(&7f32.to_le_bytes());
        file.extend([99; 5]);
        file.extend(0..12u8);
        let volume = Folder::new().load(&[&file]).expect("a good map");
        assert_eq!(volume.voxels, Voxels::I8((0..12).collect()));
        let map = volume.world_from_index;
        assert!(map.matrix3.x_axis.distance(DVec3::new(0.0, 0.0, 2.0)) < 1e-12);
        let y = 1.5 * DVec3::new(-0.5, 0.75f64.sqrt(), 0.0);
        assert!(
            map.matrix3.z_axis.distance(y) < 1e-6,
            "{}",
            map.matrix3.z_axis
        );
        assert_eq!(map.translation, DVec3::new(7.0, 0.0, 0.0));
    }

    #[test]
    fn faults_name_their_place_and_damage_never_panics() {
        let folder = Folder::new();
        let mut twice = header(2, Endian::Little);
        twice[68] = 1;
        let mut empty = header(2, Endian::Little);
        empty[4] = 0;
        for (file, named) in [
            (header(4, Endian::Little), "complex"),
            (header(12, Endian::Little), "half floats"),
            (header(2, Endian::Little), "1024 are there"),
            (twice, "each once"),
            (empty, "NY (byte 4) is 0"),
        ] {
            let text = folder.refusal(&[&file]);
            assert!(text.contains(named), "{named}: {text}");
        }
        let file = [header(1, Endian::Little), vec![3; 24]].concat();
        survive_damage(&file, &LoadOptions::default(), 200);
    }
}
