//! DICOM segmentations: a frame for each segment and slice, of one bit or a share a pixel, made into a volume of labels.
//!
//! Takes a path, gives the parts of a volume whose numbers are those of the segments; 0 is outside of all. Slices without a segment are often
//! left out of the file, so the places of the frames say which slices there are. Where segments overlap, the later frame is shown.
//! Source: DICOM PS3.3, A.51 and C.8.20. Limits: shares count from half of their greatest value on; names and colours of segments are not
//! taken over, but a remark lists the names.

use std::io::Read;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use resample_io::Gate;

use crate::Error;
use crate::input::file::{Fault, unsupported};
use crate::input::formats::dicom::elements::{self, Dataset, PIXEL_DATA, Tag};
use crate::input::formats::dicom::header::{
    BITS_ALLOCATED, COLUMNS, FRAME_GROUPS, Frame, ROWS, SHARED_GROUPS, frames, step_of,
};
use crate::input::{Parts, cannot_read, open};
use crate::volume::{Lattice, Voxels};

const SEGMENTS: Tag = 0x0062_0002;
const SEGMENT_NUMBER: Tag = 0x0062_0004;
const SEGMENT_LABEL: Tag = 0x0062_0005;
const GREATEST_SHARE: Tag = 0x0062_000E;
const SEGMENT_OF_FRAME: Tag = 0x0062_000A;
const REFERENCED_NUMBER: Tag = 0x0062_000B;

/// Bytes in which the class of the file stands.
const HEAD_BYTES: u64 = 1024;

/// Share of the distance of slices by which a frame may lie beside its slice. A guess: places are rounded to a few digits.
const MOST_BESIDE: f64 = 0.1;

/// Most slices between the first and the last. A guess, far above any scan.
const MOST_SLICES: f64 = 65536.0;

/// Most names that a remark lists.
const MOST_NAMES: usize = 12;

/// Reads the labels; `None` if the file holds something else.
pub(crate) fn load(path: &Path, gate: &Gate) -> Result<Option<Parts>, Error> {
    let mut file = open(path)?;
    let mut bytes = Vec::new();
    let read = (&mut file).take(HEAD_BYTES).read_to_end(&mut bytes);
    read.map_err(|source| cannot_read(path, source))?;
    if !elements::is_segmentation(&bytes) {
        return Ok(None);
    }
    let rest = file.read_to_end(&mut bytes);
    rest.map_err(|source| cannot_read(path, source))?;
    let parts = || {
        let (meta, elements) = elements::read_meta(&bytes, gate)?;
        labels(&elements::parse(&elements, &meta)?, gate)
    };
    parts().map(Some).map_err(|fault: Fault| fault.at(path))
}

/// The slices on which frames lie.
struct Slices {
    first: DVec3,
    step: DVec3,
    count: usize,
    /// Of each frame.
    numbers: Vec<usize>,
}

fn labels(dataset: &Dataset, gate: &Gate) -> Result<Parts, Fault> {
    let size = |tag, name: &str| {
        let size = dataset.number_16(tag).filter(|&size| size > 0);
        size.map(usize::from)
            .ok_or_else(|| Fault::Invalid(format!("it has no {name}")))
    };
    let (rows, columns) = (size(ROWS, "Rows")?, size(COLUMNS, "Columns")?);
    let frames = frames(dataset)?;
    let segments = segments(dataset, frames.len())
        .ok_or_else(|| unsupported("its frames do not say which segment they show"))?;
    let slices = slices(dataset, &frames)?;
    let (of_slice, all) = (rows * columns, frames.len() * rows * columns);
    let count = of_slice.saturating_mul(slices.count);
    gate.ask(2 * count as u64, "the labels")?;
    let is_inside = inside(dataset, all)?;
    let mut labels = vec![0u16; count];
    let mut overlaps = 0usize;
    for (frame, (&slice, &segment)) in slices.numbers.iter().zip(&segments).enumerate() {
        let target = &mut labels[slice * of_slice..][..of_slice];
        for (pixel, label) in target.iter_mut().enumerate() {
            if is_inside(frame * of_slice + pixel) {
                overlaps += usize::from(*label != 0 && *label != segment);
                *label = segment;
            }
        }
    }
    remark(dataset, overlaps, gate);
    let place = &frames[0];
    let [x, y] = place.directions;
    let axes = DMat3::from_cols(x * place.spacing[0], y * place.spacing[1], slices.step);
    let voxels = if segments.iter().all(|&segment| segment < 256) {
        Voxels::U8(labels.into_iter().map(|label| label as u8).collect())
    } else {
        Voxels::U16(labels)
    };
    Ok(Parts {
        lattice: Lattice {
            up_hint: Some(DVec3::Z),
            space: Some("left-posterior-superior".to_owned()),
            unit: Some("mm".to_owned()),
            ..Lattice::unnamed(
                [columns, rows, slices.count],
                DAffine3::from_mat3_translation(axes, slices.first),
            )
        },
        voxels: vec![voxels],
    })
}

/// The segment of each frame; one of a single segment may stand among what all frames share.
fn segments(dataset: &Dataset, count: usize) -> Option<Vec<u16>> {
    let of = |groups: &Dataset| {
        let segment = groups.items(SEGMENT_OF_FRAME).first()?;
        segment.number_16(REFERENCED_NUMBER)
    };
    let shared = dataset.items(SHARED_GROUPS).first().and_then(of);
    let own = dataset.items(FRAME_GROUPS).iter();
    let all: Option<Vec<u16>> = own.map(|groups| of(groups).or(shared)).collect();
    all.filter(|all| all.len() == count)
}

/// Returns true for the pixels of all frames that lie inside of their segment.
fn inside<'a>(dataset: &Dataset<'a>, all: usize) -> Result<impl Fn(usize) -> bool + 'a, Fault> {
    let bits = dataset.number_16(BITS_ALLOCATED).unwrap_or(1);
    let pixels = dataset
        .bytes(PIXEL_DATA)
        .ok_or_else(|| unsupported("its segments are packed: save them plainly"))?;
    let needed = match bits {
        1 => all.div_ceil(8),
        8 => all,
        other => {
            return Err(unsupported(format!(
                "{other} bits a pixel: expected 1 or 8"
            )));
        }
    };
    if pixels.len() < needed {
        let held = pixels.len();
        return Err(Fault::Invalid(format!(
            "its frames need {needed} bytes, {held} are there: it is cut off"
        )));
    }
    let greatest = dataset.number_16(GREATEST_SHARE).unwrap_or(255).max(1);
    Ok(move |pixel: usize| match bits {
        1 => pixels[pixel / 8] >> (pixel % 8) & 1 == 1,
        _ => 2 * u16::from(pixels[pixel]) >= greatest,
    })
}

fn slices(dataset: &Dataset, frames: &[Frame]) -> Result<Slices, Fault> {
    let positions: Option<Vec<DVec3>> = frames.iter().map(|frame| frame.position).collect();
    let positions = positions.ok_or_else(|| unsupported("its frames do not say where they lie"))?;
    let is_turned = |frame: &Frame| frame.directions != frames[0].directions;
    if frames.iter().any(is_turned) {
        return Err(unsupported("its frames have several directions"));
    }
    let [x, y] = frames[0].directions;
    let normal = x.cross(y).try_normalize();
    let normal = normal.ok_or_else(|| "ImageOrientationPatient spans no plane".to_owned())?;
    let height = |position: &DVec3| position.dot(normal);
    let mut sorted = positions.clone();
    sorted.sort_by(|a, b| height(a).total_cmp(&height(b)));
    let (first, last) = (sorted[0], sorted[sorted.len() - 1]);
    let gaps = sorted
        .windows(2)
        .map(|pair| height(&pair[1]) - height(&pair[0]));
    let told = step_of(dataset)?;
    let least = gaps
        .filter(|&gap| gap > MOST_BESIDE * told.unwrap_or(0.1))
        .fold(f64::INFINITY, f64::min);
    let step = told.unwrap_or(if least.is_finite() { least } else { 1.0 });
    let whole = ((height(&last) - height(&first)) / step).round();
    if !(whole < MOST_SLICES) {
        return Err(Fault::Invalid(format!(
            "its frames lie {step} mm apart over {whole} slices"
        )));
    }
    let number = |position: &DVec3| {
        let place = (height(position) - height(&first)) / step;
        let is_beside = (place - place.round()).abs() > MOST_BESIDE;
        (!is_beside)
            .then(|| resample_core::narrow::count(resample_core::narrow::whole(place.round())))
    };
    let numbers: Option<Vec<usize>> = positions.iter().map(number).collect();
    let numbers = numbers.ok_or_else(|| {
        unsupported(format!(
            "its frames do not lie on slices {step} mm apart: resample them to the scan first"
        ))
    })?;
    let count = numbers.iter().max().map_or(1, |last| last + 1);
    Ok(Slices {
        first,
        step: match count {
            1 => normal * step,
            _ => (last - first) / (count - 1) as f64,
        },
        count,
        numbers,
    })
}

/// Names the segments, and says where they overlap.
fn remark(dataset: &Dataset, overlaps: usize, gate: &Gate) {
    let names: Vec<String> = dataset
        .items(SEGMENTS)
        .iter()
        .filter_map(|segment| {
            let number = segment.number_16(SEGMENT_NUMBER)?;
            let name = segment.text(SEGMENT_LABEL).unwrap_or_default();
            Some(format!("{number} {}", name.trim()))
        })
        .collect();
    let more = names.len().saturating_sub(MOST_NAMES);
    let mut text = format!("segments: {}", names[..names.len() - more].join(", "));
    if more > 0 {
        text += &format!(", and {more} more");
    }
    if overlaps > 0 {
        text += &format!("; {overlaps} voxels belong to several: the last is shown");
    }
    gate.remark(text);
}
