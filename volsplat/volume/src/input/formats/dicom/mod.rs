//! DICOM pictures: a series of files with one slice each, or files of several frames.
//!
//! Takes paths, gives the parts of a volume. Every file is parsed (`elements.rs`) and asked for its picture
//! (`header.rs`); of the files of one series the slices are put in order and into the world (`stack.rs`); then they are
//! unpacked one after the other (`pixels.rs`) and scaled to what the numbers mean, such as Hounsfield units.
//! Source: the DICOM standard, PS3.3, PS3.5 and PS3.10. The parser is our own because claims of lengths have to be held
//! against the file before memory is taken.
//! Limits: grey pictures of 8, 16 or 32 bits; modality tables are left aside.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use glam::DVec3;
use resample_io::Gate;

use crate::Error;
use crate::input::decode::rescale::Rescale;
use crate::input::{Parts, cannot_read, decode, invalid, open};
use crate::volume::{Lattice, Voxels};

mod dataset;
mod elements;
mod header;
mod pixels;
mod rle;
mod spacing;
mod stack;

use header::Picture;
use spacing::Even;
use stack::{Slice, Stack};

/// Returns true if a file that begins with `head` is DICOM.
pub(crate) fn begins(head: &[u8]) -> bool {
    elements::begins(head)
}

/// Reads the slices of one series. `named` is what the caller named, for messages about all files together.
pub(crate) fn load(
    paths: &[PathBuf],
    named: &Path,
    series: Option<&str>,
    gate: &Gate,
) -> Result<Parts, Error> {
    let mut files = Vec::new();
    for path in paths {
        // Folders hold reports and indices beside pictures.
        files.extend(picture_of(path, gate)?.map(|picture| (path.clone(), picture)));
    }
    let (paths, pictures): (Vec<PathBuf>, Vec<Picture>) =
        chosen_series(files, named, series, gate)?
            .into_iter()
            .unzip();
    let kind = pictures[0].kind;
    if let Some(index) = pictures.iter().position(|picture| picture.kind != kind) {
        let (other, first) = (pictures[index].kind.described(), kind.described());
        return Err(invalid(
            &paths[index],
            format!("a slice of {other}, but the first one has {first}"),
        ));
    }
    let Stack {
        slices,
        world_from_index,
        even,
        remark,
    } = stack::stack(&pictures).map_err(|fault| fault.at(named))?;
    // Resampled slices stand beside those that were read for a moment.
    let held = slices.len() + even.as_ref().map_or(0, Even::len);
    let bytes =
        (kind.frame_len() as u64 * held as u64).saturating_mul(u64::from(kind.bits_allocated) / 8);
    let packed = paths
        .iter()
        .map(|path| std::fs::metadata(path).map_or(0, |file| file.len()))
        .sum();
    gate.ask_unpacked(bytes, packed, "the slices")
        .map_err(|what| invalid(named, what))?;
    let read = voxels(&slices, &paths, &pictures, gate)?;
    let (voxels, depth) = match &even {
        Some(even) => (even.resampled(&read, kind.frame_len()), even.len()),
        None => (read, slices.len()),
    };
    if let Some(remark) = remark {
        gate.remark(format!("{}: {remark}", named.display()));
    }
    Ok(Parts {
        lattice: Lattice {
            dims: [kind.columns, kind.rows, depth],
            world_from_index,
            up_hint: Some(DVec3::Z),
            space: Some("left-posterior-superior".to_owned()),
            modality: pictures[0].modality,
        },
        voxels,
    })
}

fn picture_of(path: &Path, gate: &Gate) -> Result<Option<Picture>, Error> {
    let bytes = bytes_of(path)?;
    let (meta, elements) = elements::read_meta(&bytes, gate).map_err(|fault| fault.at(path))?;
    let dataset = elements::parse(&elements, &meta).map_err(|fault| fault.at(path))?;
    header::picture(&dataset).map_err(|fault| fault.at(path))
}

fn bytes_of(path: &Path) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    open(path)?
        .read_to_end(&mut bytes)
        .map_err(|source| cannot_read(path, source))?;
    Ok(bytes)
}

/// The files of the series that was asked for, or of the largest one.
fn chosen_series(
    mut files: Vec<(PathBuf, Picture)>,
    named: &Path,
    series: Option<&str>,
    gate: &Gate,
) -> Result<Vec<(PathBuf, Picture)>, Error> {
    let mut all: BTreeMap<&str, (usize, &str)> = BTreeMap::new();
    for (_, picture) in &files {
        all.entry(&picture.series)
            .or_insert((0, &picture.description))
            .0 += picture.frames.len();
    }
    let listed: Vec<String> = all
        .iter()
        .map(|(uid, (count, name))| format!("{uid} ({count} slices, '{name}')"))
        .collect();
    // Of equal ones the first in the order of their names, so that it does not depend on the folder.
    let largest = all
        .iter()
        .rev()
        .max_by_key(|(_, (count, _))| *count)
        .map(|(&uid, _)| uid.to_owned());
    let (listed, count, named) = (listed.join(", "), all.len(), named.display());
    match series {
        _ if files.is_empty() => Err(Error::Unsupported {
            path: named.to_string().into(),
            what: "no picture in it".to_owned(),
        }),
        None if count == 1 => Ok(files),
        None => {
            let uid = largest.unwrap_or_default();
            gate.remark(format!(
                "{named}: {count} series, of which the largest was taken, {uid}; choose another with #series=UID, of {listed}"
            ));
            files.retain(|(_, picture)| picture.series == uid);
            Ok(files)
        }
        Some(uid) => {
            if !all.contains_key(uid) {
                return Err(Error::Option(format!(
                    "{named}: series={uid}: no such series; there are: {listed}"
                )));
            }
            files.retain(|(_, picture)| picture.series == uid);
            Ok(files)
        }
    }
}

/// The scaled numbers of all slices in their order.
fn voxels(
    slices: &[Slice],
    paths: &[PathBuf],
    pictures: &[Picture],
    gate: &Gate,
) -> Result<Voxels, Error> {
    let common = slices[0].place.rescale;
    let is_common = slices.iter().all(|slice| slice.place.rescale == common);
    // Frames of a file are unpacked together and wait here until it is their turn.
    let mut waiting: Vec<Vec<Option<Voxels>>> = (0..paths.len()).map(|_| Vec::new()).collect();
    let frame_of = |slice: &Slice| {
        if waiting[slice.file].is_empty() {
            let frames = unpacked(&paths[slice.file], &pictures[slice.file], gate)?;
            waiting[slice.file] = frames.into_iter().map(Some).collect();
        }
        let frame = waiting[slice.file]
            .get_mut(slice.frame)
            .and_then(Option::take);
        let frame = frame.ok_or_else(|| invalid(&paths[slice.file], "a frame is absent"))?;
        // Slices of different scales have no common stored type.
        Ok(if is_common {
            frame
        } else {
            scaled_single(frame, slice.place.rescale)
        })
    };
    let voxels = decode::joined(slices.iter().map(frame_of))?
        .ok_or_else(|| invalid(&paths[0], "no slice"))?;
    Ok(if is_common {
        common.apply(voxels)
    } else {
        voxels
    })
}

fn unpacked(path: &Path, picture: &Picture, gate: &Gate) -> Result<Vec<Voxels>, Error> {
    let bytes = bytes_of(path)?;
    let (meta, elements) = elements::read_meta(&bytes, gate).map_err(|fault| fault.at(path))?;
    let dataset = elements::parse(&elements, &meta).map_err(|fault| fault.at(path))?;
    pixels::frames(&dataset, &meta, picture.kind, picture.frames.len())
        .map_err(|fault| fault.at(path))
}

fn scaled_single(frame: Voxels, rescale: Rescale) -> Voxels {
    let scaled = |index: usize| (frame.value(index) * rescale.slope + rescale.intercept) as f32;
    Voxels::F32((0..frame.len()).map(scaled).collect())
}

#[cfg(test)]
mod tests;
