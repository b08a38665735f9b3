//! The picture of a DICOM file: size, type, and the place and scale of each frame.
//!
//! Takes the elements, gives a [`Picture`]. A file of one frame says where it lies at its top level; an enhanced one in
//! the groups shared by all frames and in those of each frame, of which the latter come first.

use glam::DVec3;

use crate::input::decode::rescale::Rescale;
use crate::input::fault::{Fault, excerpt, unsupported};
use crate::input::formats::dicom::dataset::{Dataset, PIXEL_DATA, Tag};
use crate::volume::Modality;

const SERIES_UID: Tag = 0x0020_000E;
const MODALITY: Tag = 0x0008_0060;
const SERIES_DESCRIPTION: Tag = 0x0008_103E;
const SLICE_THICKNESS: Tag = 0x0018_0050;
const SPACING_BETWEEN_SLICES: Tag = 0x0018_0088;
const INSTANCE_NUMBER: Tag = 0x0020_0013;
const POSITION: Tag = 0x0020_0032;
const ORIENTATION: Tag = 0x0020_0037;
const SAMPLES_PER_PIXEL: Tag = 0x0028_0002;
const PHOTOMETRIC: Tag = 0x0028_0004;
const NUMBER_OF_FRAMES: Tag = 0x0028_0008;
const ROWS: Tag = 0x0028_0010;
const COLUMNS: Tag = 0x0028_0011;
const PIXEL_SPACING: Tag = 0x0028_0030;
const BITS_ALLOCATED: Tag = 0x0028_0100;
const BITS_STORED: Tag = 0x0028_0101;
const HIGH_BIT: Tag = 0x0028_0102;
const PIXEL_REPRESENTATION: Tag = 0x0028_0103;
const RESCALE_INTERCEPT: Tag = 0x0028_1052;
const RESCALE_SLOPE: Tag = 0x0028_1053;
const POSITION_GROUP: Tag = 0x0020_9113;
const ORIENTATION_GROUP: Tag = 0x0020_9116;
const MEASURES_GROUP: Tag = 0x0028_9110;
const RESCALE_GROUP: Tag = 0x0028_9145;
const SHARED_GROUPS: Tag = 0x5200_9229;
const FRAME_GROUPS: Tag = 0x5200_9230;

/// Size and type of the frames of a file; all slices of a volume have the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kind {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// 8, 16 or 32.
    pub(crate) bits_allocated: u32,
    /// Bits that count, at most those allocated.
    pub(crate) bits_stored: u32,
    pub(crate) is_signed: bool,
}

impl Kind {
    /// Values of one frame.
    pub(crate) fn frame_len(&self) -> usize {
        self.columns * self.rows
    }

    /// For a message.
    pub(crate) fn described(&self) -> String {
        let sign = if self.is_signed { "signed" } else { "unsigned" };
        format!(
            "{}x{} pixels of {} bits, {sign}",
            self.columns, self.rows, self.bits_stored
        )
    }
}

/// Where a frame lies, and what its numbers mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    /// World position of the first pixel, millimetres.
    pub(crate) position: Option<DVec3>,
    /// World directions in which columns and rows are counted.
    pub(crate) directions: [DVec3; 2],
    /// Distance of columns and of rows, millimetres.
    pub(crate) spacing: [f64; 2],
    pub(crate) rescale: Rescale,
}

/// The facts of a file's picture.
pub(crate) struct Picture {
    pub(crate) kind: Kind,
    /// At least one.
    pub(crate) frames: Vec<Frame>,
    /// Distance of slices, where positions do not tell it, millimetres.
    pub(crate) slice_step: f64,
    pub(crate) series: String,
    pub(crate) description: String,
    pub(crate) modality: Option<Modality>,
    /// The number of the picture in its series.
    pub(crate) instance: Option<f64>,
}

/// More frames than any scanner writes in one file; the groups of each take memory. A guess.
const MAX_FRAMES: usize = 1 << 16;

/// The picture of a file; `None` if the file holds something else.
pub(crate) fn picture(dataset: &Dataset) -> Result<Option<Picture>, Fault> {
    if dataset.value(PIXEL_DATA).is_none() || dataset.number_16(ROWS).is_none() {
        return Ok(None);
    }
    let step = dataset
        .decimals::<1>(SPACING_BETWEEN_SLICES)?
        .or(dataset.decimals::<1>(SLICE_THICKNESS)?);
    let step = step.map_or(1.0, |[step]| step.abs());
    Ok(Some(Picture {
        kind: kind(dataset)?,
        frames: frames(dataset)?,
        slice_step: if step > 0.0 { step } else { 1.0 },
        series: dataset.text(SERIES_UID).unwrap_or_default(),
        description: dataset.text(SERIES_DESCRIPTION).unwrap_or_default(),
        modality: match dataset.text(MODALITY).as_deref().map(str::trim) {
            Some("CT") => Some(Modality::Ct),
            Some("MR") => Some(Modality::Mr),
            _ => None,
        },
        instance: dataset
            .text(INSTANCE_NUMBER)
            .and_then(|text| text.trim().parse().ok())
            .filter(|number: &f64| number.is_finite()),
    }))
}

fn kind(dataset: &Dataset) -> Result<Kind, Fault> {
    let photometric = dataset
        .text(PHOTOMETRIC)
        .unwrap_or_else(|| "MONOCHROME2".to_owned());
    let samples = dataset.number_16(SAMPLES_PER_PIXEL).unwrap_or(1);
    if samples != 1 || !photometric.starts_with("MONOCHROME") {
        let photometric = excerpt(&photometric);
        return Err(unsupported(format!(
            "{samples} sample(s) per pixel, {photometric}: only grey pictures are read"
        )));
    }
    let required = |tag, name| {
        dataset
            .number_16(tag)
            .ok_or_else(|| format!("the file has a picture, but no {name}"))
            .map(u32::from)
    };
    let bits_allocated = required(BITS_ALLOCATED, "BitsAllocated")?;
    let bits_stored = dataset
        .number_16(BITS_STORED)
        .map_or(bits_allocated, u32::from);
    let high_bit = dataset
        .number_16(HIGH_BIT)
        .map_or(bits_stored.saturating_sub(1), u32::from);
    if !matches!(bits_allocated, 8 | 16 | 32) || !(1..=bits_allocated).contains(&bits_stored) {
        return Err(unsupported(format!(
            "{bits_stored} bits stored in {bits_allocated}: expected 8, 16 or 32 allocated"
        )));
    }
    if high_bit + 1 != bits_stored {
        return Err(unsupported(format!(
            "the high bit is {high_bit}, but {bits_stored} bits are stored"
        )));
    }
    let (columns, rows) = (
        required(COLUMNS, "Columns")? as usize,
        required(ROWS, "Rows")? as usize,
    );
    if columns == 0 || rows == 0 {
        return Err(Fault::Invalid(format!(
            "the picture has {columns}x{rows} pixels: each must be at least 1"
        )));
    }
    let is_signed = dataset.number_16(PIXEL_REPRESENTATION) == Some(1);
    Ok(Kind {
        columns,
        rows,
        bits_allocated,
        bits_stored,
        is_signed,
    })
}

fn frames(dataset: &Dataset) -> Result<Vec<Frame>, Fault> {
    let count = dataset
        .text(NUMBER_OF_FRAMES)
        .map_or(Ok(1), |text| text.parse().map_err(|_| text));
    let count: usize = count
        .map_err(|text| format!("NumberOfFrames is '{}': expected a number", excerpt(&text)))?;
    if !(1..=MAX_FRAMES).contains(&count) {
        return Err(Fault::Invalid(format!(
            "NumberOfFrames is {count}: expected 1 to {MAX_FRAMES}"
        )));
    }
    let shared = dataset.items(SHARED_GROUPS).first();
    let own = dataset.items(FRAME_GROUPS);
    if !own.is_empty() && own.len() != count {
        let groups = own.len();
        return Err(Fault::Invalid(format!(
            "there are {count} frames, but the groups of {groups}"
        )));
    }
    if own.is_empty() {
        // All frames have the same groups, and none has a place of its own.
        let frame = frame(&[shared, Some(dataset)])?;
        let position = if count == 1 { frame.position } else { None };
        return Ok(vec![Frame { position, ..frame }; count]);
    }
    own.iter()
        .map(|own| frame(&[Some(own), shared, Some(dataset)]))
        .collect()
}

/// `places` are the data sets that can say it, the closest first.
fn frame(places: &[Option<&Dataset>]) -> Result<Frame, Fault> {
    let position = find::<3>(places, POSITION_GROUP, POSITION)?.map(DVec3::from_array);
    let directions = find::<6>(places, ORIENTATION_GROUP, ORIENTATION)?;
    let directions = directions.map_or([DVec3::X, DVec3::Y], |d| {
        [DVec3::new(d[0], d[1], d[2]), DVec3::new(d[3], d[4], d[5])]
    });
    // The distance of rows comes first, then that of columns.
    let [of_rows, of_columns] =
        find::<2>(places, MEASURES_GROUP, PIXEL_SPACING)?.unwrap_or([1.0; 2]);
    if !(of_rows > 0.0 && of_columns > 0.0) {
        return Err(Fault::Invalid(format!(
            "PixelSpacing is {of_rows}\\{of_columns}: each must be above 0"
        )));
    }
    let slope = find::<1>(places, RESCALE_GROUP, RESCALE_SLOPE)?.map_or(1.0, |[slope]| slope);
    let intercept =
        find::<1>(places, RESCALE_GROUP, RESCALE_INTERCEPT)?.map_or(0.0, |[intercept]| intercept);
    if slope == 0.0 {
        return Err(Fault::Invalid(
            "RescaleSlope is 0, which makes all values equal".to_owned(),
        ));
    }
    Ok(Frame {
        position,
        directions,
        spacing: [of_columns, of_rows],
        rescale: Rescale { slope, intercept },
    })
}

/// The numbers of `tag` in the first place that has them, directly or in its sequence `group`.
fn find<const N: usize>(
    places: &[Option<&Dataset>],
    group: Tag,
    tag: Tag,
) -> Result<Option<[f64; N]>, String> {
    for place in places.iter().flatten() {
        for dataset in [Some(*place), place.items(group).first()]
            .into_iter()
            .flatten()
        {
            if let Some(numbers) = dataset.decimals(tag)? {
                return Ok(Some(numbers));
            }
        }
    }
    Ok(None)
}
