//! FreeSurfer's volumes, `.mgh`, and packed by gzip, `.mgz`.
//!
//! Takes a path, gives the parts of a volume. A header of 284 bytes has fixed places, all numbers big-endian: version,
//! sizes, volumes over time, type, and, where a flag says so, spacing, directions of the axes and the world position of the
//! voxel at half of each size. What follows the last volume (scanner parameters, tags) is passed over.
//! Source: the description of the format in FreeSurfer's wiki (FsTutorial/MghFormat).
//! World coordinates are the format's own: x to the right, y to the front, z to the head.

use std::io::Read;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use resample_io::Gate;

use crate::Error;
use crate::input::axes;
use crate::input::decode;
use crate::input::decode::Layout;
use crate::input::decode::stored::Stream;
use crate::input::file::{Fault, Parts, unsupported};
use crate::volume::{Endian, Lattice, VoxelType, voxel_count};

/// Bytes before the first voxel.
const HEADER_BYTES: usize = 284;

/// Bytes of the header that mean something.
const USED_BYTES: usize = 90;

/// Most voxels along an axis of a file that counts as one of this format, which has no mark but its version.
const PLAUSIBLE_SIZE: i32 = 1 << 16;

/// The facts of the header.
struct Header {
    dims: [usize; 3],
    times: usize,
    kind: i32,
    world_from_index: DAffine3,
}

/// Returns true if an unpacked file that begins with `head` is of this format.
pub(crate) fn begins(head: &[u8]) -> bool {
    let Some(fields) = head.get(..USED_BYTES) else {
        return false;
    };
    let [version, x, y, z, times, kind, _] =
        [0, 1, 2, 3, 4, 5, 6].map(|place| word(fields, 4 * place));
    let flag = i16::from_be_bytes([fields[28], fields[29]]);
    version == 1
        && [x, y, z, times]
            .iter()
            .all(|size| (1..=PLAUSIBLE_SIZE).contains(size))
        && (0..=10).contains(&kind)
        && (0..=1).contains(&flag)
}

/// Points in time.
pub(crate) fn times(path: &Path) -> Result<usize, Error> {
    let header = header(&mut Stream::open(path)?).map_err(|fault| fault.at(path))?;
    Ok(header.times)
}

/// Reads the volume of a point in time; the first, with a remark, where there are several and the caller names no point in time.
pub(crate) fn load(path: &Path, time: Option<usize>, gate: &Gate) -> Result<Parts, Error> {
    let mut stream = Stream::open(path)?;
    read(&mut stream, path, time, gate).map_err(|fault| fault.at(path))
}

fn read(
    stream: &mut Stream,
    path: &Path,
    time: Option<usize>,
    gate: &Gate,
) -> Result<Parts, Fault> {
    let header = header(stream)?;
    let times = header.times;
    if time.is_some_and(|time| time >= times) {
        return Err(Fault::Option(format!(
            "time={}: the file holds {times} point(s) in time, counted from 0",
            time.unwrap_or_default()
        )));
    }
    if times > 1 && time.is_none() {
        gate.remark(axes::first_of(times, path));
    }
    let layout = Layout {
        voxel_type: voxel_type(header.kind)?,
        endian: Endian::Big,
        count: voxel_count(header.dims)?,
    };
    let one = layout.bytes()?;
    let behind = |volumes: usize| {
        let bytes = one.checked_mul(volumes as u64);
        bytes.and_then(|bytes| bytes.checked_add(HEADER_BYTES as u64))
    };
    let before = time.unwrap_or(0);
    let (Some(all), Some(until)) = (behind(times), behind(before + 1)) else {
        return Err(Fault::Invalid(
            "its sizes promise more than can be addressed".to_owned(),
        ));
    };
    if stream.is_packed {
        decode::check_expansion(all, stream.held)?;
        decode::check_deflated(until, stream.held, gate)?;
    } else if all > stream.held {
        let ([x, y, z], held) = (header.dims, stream.held);
        return Err(Fault::Invalid(format!(
            "the header promises {x}x{y}x{z} voxels of {} at {times} time(s), which are {all} bytes with the header, but {held} \
             are there: the file is cut off or its sizes are wrong",
            layout.voxel_type.name()
        )));
    }
    stream.pass(until - one - HEADER_BYTES as u64)?;
    let voxels = decode::binary(&mut (&mut stream.bytes).take(one), &layout)?;
    Ok(Parts {
        lattice: Lattice {
            dims: header.dims,
            world_from_index: header.world_from_index,
            up_hint: Some(DVec3::Z),
            space: Some("right-anterior-superior".to_owned()),
            modality: None,
            unit: Some("mm".to_owned()),
            window: None,
        },
        voxels: vec![voxels],
    })
}

fn header(stream: &mut Stream) -> Result<Header, Fault> {
    let bytes = stream.header(HEADER_BYTES)?;
    let size = |place: usize, name: &str| {
        let size = word(&bytes, place);
        usize::try_from(size)
            .ok()
            .filter(|&size| size > 0)
            .ok_or_else(|| format!("{name} (byte {place}) is {size}: expected at least 1"))
    };
    let dims = [size(4, "width")?, size(8, "height")?, size(12, "depth")?];
    Ok(Header {
        dims,
        times: size(16, "the number of frames")?,
        kind: word(&bytes, 20),
        world_from_index: place(&bytes, dims),
    })
}

/// Where the image lies: as the flag says, or as coronal slices of 1 mm around the origin, which is the format's default.
fn place(bytes: &[u8], dims: [usize; 3]) -> DAffine3 {
    let float = |number: usize| {
        let at = 30 + 4 * number;
        f64::from(f32::from_be_bytes([
            bytes[at],
            bytes[at + 1],
            bytes[at + 2],
            bytes[at + 3],
        ]))
    };
    let vector = |first: usize| DVec3::new(float(first), float(first + 1), float(first + 2));
    let is_given = i16::from_be_bytes([bytes[28], bytes[29]]) == 1;
    let (spacing, axes, middle) = if is_given {
        (vector(0), [vector(3), vector(6), vector(9)], vector(12))
    } else {
        (
            DVec3::ONE,
            [DVec3::NEG_X, DVec3::NEG_Z, DVec3::Y],
            DVec3::ZERO,
        )
    };
    let axes = DMat3::from_cols(axes[0], axes[1], axes[2]) * DMat3::from_diagonal(spacing);
    let half = 0.5 * DVec3::from_array(dims.map(|size| size as f64));
    DAffine3::from_mat3_translation(axes, middle - axes * half)
}

fn voxel_type(kind: i32) -> Result<VoxelType, Fault> {
    match kind {
        0 => Ok(VoxelType::U8),
        1 => Ok(VoxelType::I32),
        3 => Ok(VoxelType::F32),
        4 => Ok(VoxelType::I16),
        10 => Ok(VoxelType::U16),
        other => Err(unsupported(format!(
            "type {other} (byte 20): expected 0 (u8), 1 (i32), 3 (f32), 4 (i16) or 10 (u16); save it as one of these"
        ))),
    }
}

fn word(bytes: &[u8], at: usize) -> i32 {
    i32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::input::test_files::{Folder, gzip, survive_damage};
    use crate::input::{Format, LoadOptions, format_of, load};
    use crate::volume::Voxels;

    /// A header of 3x2x2 voxels.
    fn header(kind: i32, times: i32) -> Vec<u8> {
        let words = [1, 3, 2, 2, times, kind, 0].map(i32::to_be_bytes).concat();
        // Coronal slices: x to the left, y to the feet, z to the front, of 1, 1.5 and 2 mm.
        let place = [
            1.0f32, 1.5, 2.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 10.0, 20.0, 30.0,
        ];
        let mut bytes = [
            words,
            1i16.to_be_bytes().to_vec(),
            place.map(f32::to_be_bytes).concat(),
        ]
        .concat();
        bytes.resize(284, 0);
        bytes
    }

    fn values() -> Vec<u8> {
        (0..12).collect()
    }

    #[test]
    fn sizes_place_and_values_are_read_packed_or_not() {
        let folder = Folder::new();
        let file = [header(0, 1), values(), b"tags".to_vec()].concat();
        for file in [gzip(&file), file] {
            let path = folder.write("a", &[&file]);
            assert_eq!(format_of(&path).expect("readable"), Some(Format::Mgh));
            let volume = load(&path, &LoadOptions::default()).expect("a good file");
            assert_eq!(
                (volume.dims, &volume.voxels),
                ([3, 2, 2], &Voxels::U8(values()))
            );
            let map = volume.world_from_index;
            assert_eq!(map.matrix3.y_axis, DVec3::new(0.0, 0.0, -1.5), "a row down");
            // The world position belongs to the index (1.5, 1, 1).
            let middle = map.transform_point3(DVec3::new(1.5, 1.0, 1.0));
            assert!(
                middle.distance(DVec3::new(10.0, 20.0, 30.0)) < 1e-12,
                "{middle}"
            );
            assert_eq!(volume.up_hint, Some(DVec3::Z));
        }
    }

    #[test]
    fn every_type_reads_back() {
        let folder = Folder::new();
        let shorts: Vec<i16> = (0..12).map(|i| 300 * i - 1000).collect();
        let floats: Vec<f32> = (0..12).map(|i| i as f32 - 0.5).collect();
        let file = |kind, data: Vec<u8>| [header(kind, 1), data].concat();
        let big = |bytes: Vec<[u8; 2]>| bytes.concat();
        let cases = [
            (
                file(4, big(shorts.iter().map(|v| v.to_be_bytes()).collect())),
                Voxels::I16(shorts.clone()),
            ),
            (
                file(3, floats.iter().flat_map(|v| v.to_be_bytes()).collect()),
                Voxels::F32(floats),
            ),
            (
                file(
                    1,
                    shorts
                        .iter()
                        .flat_map(|&v| i32::from(v).to_be_bytes())
                        .collect(),
                ),
                Voxels::I32(shorts.iter().map(|&v| i32::from(v)).collect()),
            ),
        ];
        for (file, expected) in cases {
            assert_eq!(folder.load(&[&file]).expect("a good file").voxels, expected);
        }
    }

    #[test]
    fn times_are_chosen_or_the_first_is_read_with_a_remark() {
        let folder = Folder::new();
        let path = folder.write("a", &[&header(0, 2), &values(), &[7; 12]]);
        let options = LoadOptions::default();
        assert_eq!(
            load(&path, &options).expect("good").voxels,
            Voxels::U8(values())
        );
        assert!(options.gate.remarks()[0].contains("#time=N"));
        let second = LoadOptions {
            time: Some(1),
            ..LoadOptions::default()
        };
        assert_eq!(
            load(&path, &second).expect("good").voxels,
            Voxels::U8(vec![7; 12])
        );
    }

    #[test]
    fn faults_name_their_place() {
        let folder = Folder::new();
        let refused = |parts: &[&[u8]]| folder.refusal(parts);
        let text = refused(&[&header(0, 1), &values()[..11]]);
        assert!(
            text.contains("which are 296 bytes with the header, but 295"),
            "{text}"
        );
        assert!(refused(&[&header(2, 1), &values()]).contains("type 2 (byte 20)"));
        assert!(refused(&[&header(0, 1)[..200]]).contains("the header needs 284 bytes"));
        let packed = gzip(&header(0, 60_000));
        assert!(refused(&[&packed]).contains("at most"));
    }

    #[test]
    fn damaged_files_are_refused_and_never_panic() {
        let file = [header(4, 1), vec![3; 24]].concat();
        survive_damage(&file, &LoadOptions::default(), 1000);
        survive_damage(&gzip(&file), &LoadOptions::default(), 500);
    }
}
