//! DICOM pictures: a series of files with one slice each, or files of several frames.
//!
//! Takes paths, returns the parts of a volume. Every file is parsed (`elements.rs`) and its picture described
//! (`header.rs`); the slices of one series are put in order and into the world; then they are
//! unpacked one after the other (`pixels.rs`) and scaled to physical values, such as Hounsfield units. A file of segments becomes
//! a volume of labels (`segments.rs`).
//!
//! Slices are sorted along their normal, or by their instance numbers where they have no positions. The step from one to the
//! next need not be at right angles to the slices: a tilted gantry shifts them, and the sheared map says exactly that. Where steps
//! differ in length (two distances, a missing slice), the slices are resampled. The world is the patient's: x to
//! the left, y to the back, z to the head, millimetres.
//! Source: the DICOM standard, PS3.3, PS3.5 and PS3.10. The parser is our own because claims of lengths have to be held
//! against the file before memory is taken.
//! Limits: grey pictures of 8, 16 or 32 bits; modality tables are ignored.

mod elements;
mod header;
mod pixels;
mod segments;

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};
use resample_io::Gate;

use crate::Error;
use crate::input::decode::rescale::Rescale;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::dicom::header::{Even, Frame, Picture};
use crate::input::{Parts, cannot_read, decode, invalid, open};
use crate::volume::{Lattice, Voxels};

pub(crate) use elements::{begins, is_index};

/// Reads the slices of one series. `named` is what the caller named, for messages about all files together.
pub(crate) fn load(
    paths: &[PathBuf],
    named: &Path,
    series: Option<&str>,
    gate: &Gate,
) -> Result<Parts, Error> {
    if let [only] = paths
        && let Some(parts) = segments::load(only, gate)?
    {
        return Ok(parts);
    }
    let mut files = Vec::new();
    let mut broken = Vec::new();
    for path in paths {
        match picture_of(path, gate) {
            // Folders hold reports and indices beside pictures.
            Ok(picture) => files.extend(picture.map(|picture| (path.clone(), picture))),
            Err(error) => broken.push(error),
        }
    }
    note_broken(broken, files.len(), gate)?;
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
    } = stack(&pictures).map_err(|fault| fault.at(named))?;
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
            unit: Some("mm".to_owned()),
            // Each slice may have its own; those at the ends show the least.
            window: slices[slices.len() / 2].place.window,
        },
        voxels: vec![voxels],
    })
}

/// Files that cannot be read are left out, with a note, where others are in the majority.
fn note_broken(broken: Vec<Error>, good: usize, gate: &Gate) -> Result<(), Error> {
    let count = broken.len();
    let Some(first) = broken.into_iter().next() else {
        return Ok(());
    };
    if count >= good {
        return Err(first);
    }
    gate.remark(format!(
        "{count} of {} files cannot be read and are left out; the first: {first}",
        count + good
    ));
    Ok(())
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
                "{named}: {count} series, of which the largest was taken, {uid}; choose another with #series=UID, or a name of its own, of {listed}"
            ));
            files.retain(|(_, picture)| picture.series == uid);
            Ok(files)
        }
        Some(word) => {
            let is_named = |(uid, (_, name)): &(&&str, &(usize, &str))| {
                **uid == word || name.trim().eq_ignore_ascii_case(word.trim())
            };
            let mut fitting = all
                .iter()
                .filter(is_named)
                .map(|(uid, _)| (*uid).to_owned());
            let uid = fitting.next().filter(|_| fitting.next().is_none());
            let uid = uid.ok_or_else(|| {
                Error::Option(format!(
                    "{named}: series={word}: no series, or several, have this UID or name; there are: {listed}"
                ))
            })?;
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
        Ok(vec![if is_common {
            frame
        } else {
            scaled_single(frame, slice.place.rescale)
        }])
    };
    let voxels = decode::joined(slices.iter().map(frame_of))?
        .pop()
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

/// One slice: a frame of a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slice {
    /// Index of the file.
    pub(crate) file: usize,
    /// Index of the frame in the file.
    pub(crate) frame: usize,
    pub(crate) place: Frame,
}

/// Slices in their order, and the map of the lattice that they make.
pub(crate) struct Stack {
    pub(crate) slices: Vec<Slice>,
    pub(crate) world_from_index: DAffine3,
    /// The slices of the lattice, where they are not those that were read.
    pub(crate) even: Option<Even>,
    /// A note on a decision.
    pub(crate) remark: Option<String>,
}

/// Where the first slice lies, and what leads from one to the next.
struct Course {
    origin: DVec3,
    step: DVec3,
    even: Option<Even>,
    remark: Option<String>,
}

impl Course {
    fn of_steps(origin: DVec3, step: DVec3) -> Self {
        Self {
            origin,
            step,
            even: None,
            remark: None,
        }
    }
}

/// Directions of slices of one volume differ by rounding only, in the sixth decimal.
const DIRECTION_TOLERANCE: f64 = 1e-4;

/// By this much, millimetres plus a share of the step, steps between slices may differ. Positions are decimals of a few
/// digits; a scanner that leaves out a slice or changes its distance differs by far more. A guess.
const STEP_TOLERANCE_MM: f64 = 0.01;
const STEP_TOLERANCE_SHARE: f64 = 0.01;

pub(crate) fn stack(pictures: &[Picture]) -> Result<Stack, Fault> {
    let mut slices = Vec::new();
    for (file, picture) in pictures.iter().enumerate() {
        let frames = picture.frames.iter().enumerate();
        slices.extend(frames.map(|(frame, &place)| Slice { file, frame, place }));
    }
    let first = slices
        .first()
        .ok_or_else(|| "there is no slice".to_owned())?
        .place;
    check_directions(&slices, &first)?;
    let [x, y] = first.directions;
    let normal = x
        .cross(y)
        .try_normalize()
        .ok_or_else(|| "ImageOrientationPatient spans no plane".to_owned())?;
    let course = if slices.len() == 1 {
        Course::of_steps(
            first.position.unwrap_or(DVec3::ZERO),
            normal * pictures[0].slice_step,
        )
    } else {
        sorted_course(&mut slices, normal, pictures)?
    };
    let axes = DMat3::from_cols(x * first.spacing[0], y * first.spacing[1], course.step);
    Ok(Stack {
        slices,
        world_from_index: DAffine3::from_mat3_translation(axes, course.origin),
        even: course.even,
        remark: course.remark,
    })
}

fn check_directions(slices: &[Slice], first: &Frame) -> Result<(), Fault> {
    for slice in slices {
        let place = &slice.place;
        let turned = (0..2)
            .any(|i| !((place.directions[i] - first.directions[i]).length() < DIRECTION_TOLERANCE));
        let rescaled = (0..2)
            .any(|i| !((place.spacing[i] / first.spacing[i] - 1.0).abs() < DIRECTION_TOLERANCE));
        if turned || rescaled {
            let what = if turned {
                "is turned against"
            } else {
                "has another pixel spacing than"
            };
            return Err(unsupported(format!(
                "a slice {what} the first one: a series with an overview or of several directions must be split into \
                 folders first"
            )));
        }
    }
    Ok(())
}

/// Sorts the slices along the normal and says how they follow one another.
fn sorted_course(
    slices: &mut [Slice],
    normal: DVec3,
    pictures: &[Picture],
) -> Result<Course, Fault> {
    let held = slices
        .iter()
        .filter(|slice| slice.place.position.is_some())
        .count();
    match held {
        // The frames of one file are in order.
        0 if pictures.len() == 1 => {
            let step = normal * pictures[0].slice_step;
            return Ok(Course::of_steps(DVec3::ZERO, step));
        }
        0 => return numbered_course(slices, normal, pictures),
        held if held < slices.len() => {
            let (all, without) = (slices.len(), slices.len() - held);
            return Err(Fault::Invalid(format!(
                "{without} of {all} slices have no ImagePositionPatient"
            )));
        }
        _ => {}
    }
    let at = |slice: &Slice| slice.place.position.unwrap_or_default();
    slices.sort_by(|a, b| at(a).dot(normal).total_cmp(&at(b).dot(normal)));
    let positions: Vec<DVec3> = slices.iter().map(at).collect();
    let steps: Vec<DVec3> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let span = positions[positions.len() - 1] - positions[0];
    course_of(&steps, span, normal).map(|course| Course {
        origin: positions[0],
        ..course
    })
}

/// Slices without positions, by their instance numbers.
fn numbered_course(
    slices: &mut [Slice],
    normal: DVec3,
    pictures: &[Picture],
) -> Result<Course, Fault> {
    let number = |slice: &Slice| pictures[slice.file].instance;
    slices.sort_by(|a, b| {
        number(a)
            .unwrap_or(0.0)
            .total_cmp(&number(b).unwrap_or(0.0))
    });
    let is_told = slices.iter().all(|slice| number(slice).is_some())
        && slices
            .windows(2)
            .all(|pair| pair[0].file == pair[1].file || number(&pair[0]) < number(&pair[1]));
    if !is_told {
        return Err(unsupported(
            "the slices have neither an ImagePositionPatient nor instance numbers of their own, so their order is not known: \
             convert them to another format",
        ));
    }
    let step = pictures[slices[0].file].slice_step;
    Ok(Course {
        remark: Some(format!(
            "the slices have no positions: they are in the order of their instance numbers, {step} mm apart"
        )),
        ..Course::of_steps(DVec3::ZERO, normal * step)
    })
}

/// How slices with these steps follow one another.
fn course_of(steps: &[DVec3], span: DVec3, normal: DVec3) -> Result<Course, Fault> {
    let mean = span / steps.len() as f64;
    let tolerance = STEP_TOLERANCE_MM + STEP_TOLERANCE_SHARE * mean.length();
    if let Some(index) = steps
        .iter()
        .position(|step| !(step.dot(normal) > 0.1 * tolerance))
    {
        return Err(unsupported(format!(
            "slices {index} and {} lie at the same place: the series holds several times or kinds of picture; put one \
             of each place into a folder of its own",
            index + 1
        )));
    }
    if steps
        .iter()
        .all(|step| (*step - mean).length() <= tolerance)
    {
        return Ok(Course::of_steps(DVec3::ZERO, mean));
    }
    let runs = runs(steps, tolerance);
    // One shear for all: each step is a share of the whole.
    let heights: Vec<f64> = steps.iter().map(|step| step.dot(normal)).collect();
    let along = span / span.dot(normal);
    let is_straight = steps
        .iter()
        .zip(&heights)
        .all(|(step, height)| (*step - *height * along).length() <= tolerance);
    let even = is_straight.then(|| Even::new(&heights)).flatten();
    let Some(even) = even else {
        return Err(unsupported(format!(
            "the slices are not evenly spaced: {runs}; put evenly spaced ones into a folder of their own"
        )));
    };
    let step = even.step * along;
    Ok(Course {
        remark: Some(format!(
            "the slices are not evenly spaced: {runs}; they were resampled to {} slices {:.2} mm apart",
            even.len(),
            step.length()
        )),
        even: Some(even),
        ..Course::of_steps(DVec3::ZERO, step)
    })
}

/// Most runs that a message lists.
const MAX_RUNS: usize = 6;

/// The slices, counted along the normal, at each distance.
fn runs(steps: &[DVec3], tolerance: f64) -> String {
    let mut runs: Vec<String> = Vec::new();
    let mut begin = 0;
    while begin < steps.len() && runs.len() < MAX_RUNS {
        let same = |step: &&DVec3| (**step - steps[begin]).length() <= tolerance;
        let end = begin + steps[begin..].iter().take_while(same).count();
        runs.push(format!(
            "{begin} to {end} are {:.2} mm apart",
            steps[begin].length()
        ));
        begin = end;
    }
    let more = if begin < steps.len() {
        ", and so on"
    } else {
        ""
    };
    format!("slices {}{more}", runs.join(", "))
}

#[cfg(test)]
mod tests;
