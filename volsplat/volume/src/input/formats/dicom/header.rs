//! The picture of a DICOM file: size, type, and the place and scale of each frame; and slices at uneven distances, resampled to even ones.
//!
//! Takes the elements, returns a [`Picture`]. A file of one frame says where it lies at its top level; an enhanced one in
//! the groups shared by all frames and in those of each frame, of which the latter come first.
//!
//! [`Even`] takes the distances of neighbours, returns the even lattice between the first and the last slice: its step is about the finest
//! distance that occurs often, so that nothing of the finer part is lost and a missing slice is filled in. A slice of the lattice is the
//! linear mean of its two neighbours, or one of them where it lies there.
//! Limits: at most 4 times as many slices; linear interpolation widens thin objects between distant slices.

use glam::DVec3;

use crate::input::decode::rescale::Rescale;
use crate::input::file::{Fault, excerpt, unsupported};
use crate::input::formats::dicom::elements::{Dataset, PIXEL_DATA, Tag};
use crate::volume::{Modality, Voxels};

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
pub(crate) const ROWS: Tag = 0x0028_0010;
pub(crate) const COLUMNS: Tag = 0x0028_0011;
const PIXEL_SPACING: Tag = 0x0028_0030;
pub(crate) const BITS_ALLOCATED: Tag = 0x0028_0100;
const BITS_STORED: Tag = 0x0028_0101;
const HIGH_BIT: Tag = 0x0028_0102;
const PIXEL_REPRESENTATION: Tag = 0x0028_0103;
const WINDOW_CENTER: Tag = 0x0028_1050;
const WINDOW_WIDTH: Tag = 0x0028_1051;
const RESCALE_INTERCEPT: Tag = 0x0028_1052;
const RESCALE_SLOPE: Tag = 0x0028_1053;
const POSITION_GROUP: Tag = 0x0020_9113;
const ORIENTATION_GROUP: Tag = 0x0020_9116;
const MEASURES_GROUP: Tag = 0x0028_9110;
const WINDOW_GROUP: Tag = 0x0028_9132;
const RESCALE_GROUP: Tag = 0x0028_9145;
pub(crate) const SHARED_GROUPS: Tag = 0x5200_9229;
pub(crate) const FRAME_GROUPS: Tag = 0x5200_9230;

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
    /// Its values that are black and white, where the file has them.
    pub(crate) window: Option<[f64; 2]>,
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
    let modality = dataset.text(MODALITY);
    let modality = modality.as_deref().map(str::trim);
    // Segments lie beside the scan that they belong to, and are read by themselves.
    if dataset.value(PIXEL_DATA).is_none()
        || dataset.number_16(ROWS).is_none()
        || modality == Some("SEG")
    {
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
        modality: match modality {
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

/// The frames of a file.
pub(crate) fn frames(dataset: &Dataset) -> Result<Vec<Frame>, Fault> {
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

/// Distance of slices, millimetres, where the file tells it.
pub(crate) fn step_of(dataset: &Dataset) -> Result<Option<f64>, Fault> {
    let own = dataset.items(FRAME_GROUPS).first();
    let places = [own, dataset.items(SHARED_GROUPS).first(), Some(dataset)];
    let between = find::<1>(&places, MEASURES_GROUP, SPACING_BETWEEN_SLICES)?;
    let step = between.or(find::<1>(&places, MEASURES_GROUP, SLICE_THICKNESS)?);
    Ok(step.map(|[step]| step.abs()).filter(|&step| step > 0.0))
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
        window: window(places),
    })
}

/// The numbers of `tag` in the first place that has them, directly or in its sequence `group`.
fn find<const N: usize>(
    places: &[Option<&Dataset>],
    group: Tag,
    tag: Tag,
) -> Result<Option<[f64; N]>, String> {
    let mut found = with_groups(places, group).map(|dataset| dataset.decimals(tag));
    found.find_map(Result::transpose).transpose()
}

/// Each place, and behind it the first item of its sequence `group`.
fn with_groups<'d, 'a>(
    places: &[Option<&'d Dataset<'a>>],
    group: Tag,
) -> impl Iterator<Item = &'d Dataset<'a>> {
    let places = places.iter().flatten().copied();
    places.flat_map(move |place| {
        [Some(place), place.items(group).first()]
            .into_iter()
            .flatten()
    })
}

/// Black and white, by the first of several windows (PS3.3, C.11.2.1.2). A window that cannot be read is left out: voxels do not depend on it.
fn window(places: &[Option<&Dataset>]) -> Option<[f64; 2]> {
    let first = |dataset: &Dataset, tag| -> Option<f64> {
        let text = dataset.text(tag)?;
        let number: f64 = text.split('\\').next()?.trim().parse().ok()?;
        number.is_finite().then_some(number)
    };
    let (center, width) = with_groups(places, WINDOW_GROUP)
        .find_map(|place| Some((first(place, WINDOW_CENTER)?, first(place, WINDOW_WIDTH)?)))?;
    let half = (width - 1.0) / 2.0;
    (half > 0.0).then_some([center - 0.5 - half, center - 0.5 + half])
}

/// The slices of an even lattice, among those that were read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Even {
    /// Distance along the normal, millimetres.
    pub(crate) step: f64,
    /// The slice before each, and how far it is on the way to the next.
    places: Vec<(usize, f64)>,
}

/// Share of all distances that have to be about as fine for the lattice to be that fine: a single pair may lie closer by chance.
const OFTEN: f64 = 0.1;

/// Distances within this share of each other are the same.
const SAME: f64 = 0.02;

/// Most slices of the lattice for each that was read. A guess.
const MOST_GROWTH: usize = 4;

/// Slices that lie this near to one that was read, in steps, are that one.
const AT_SLICE: f64 = 1e-3;

impl Even {
    /// The lattice for these distances, all above 0; `None` where it would have far more slices.
    pub(crate) fn new(heights: &[f64]) -> Option<Self> {
        let whole: f64 = heights.iter().sum();
        let finest = often_finest(heights)?;
        let steps = (whole / finest).round().max(1.0);
        if steps > (MOST_GROWTH * (heights.len() + 1)) as f64 {
            return None;
        }
        let step = whole / steps;
        let mut at = vec![0.0];
        at.extend(heights.iter().scan(0.0, |sum, height| {
            *sum += height;
            Some(*sum)
        }));
        let place = |number: usize| {
            let height = number as f64 * step;
            let before = at
                .partition_point(|&slice| slice <= height)
                .clamp(1, heights.len())
                - 1;
            let share = (height - at[before]) / heights[before];
            let near = AT_SLICE * step / heights[before];
            match share {
                share if share < near => (before, 0.0),
                share if share > 1.0 - near => (before + 1, 0.0),
                share => (before, share),
            }
        };
        Some(Self {
            step,
            places: (0..=steps as usize).map(place).collect(),
        })
    }

    /// Number of slices.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// The slices of the lattice, from those that were read, of so many voxels each.
    pub(crate) fn resampled(&self, voxels: &Voxels, slice_len: usize) -> Voxels {
        let is_float = matches!(voxels, Voxels::F32(_) | Voxels::F64(_));
        macro_rules! mixed {
            ($slice:expr, $kind:ty) => {{
                let slice = $slice;
                let mut all: Vec<$kind> = Vec::with_capacity(self.len() * slice_len);
                for &(before, share) in &self.places {
                    let here = &slice[before * slice_len..][..slice_len];
                    if share == 0.0 {
                        all.extend_from_slice(here);
                        continue;
                    }
                    let next = &slice[(before + 1) * slice_len..][..slice_len];
                    all.extend(here.iter().zip(next).map(|(&a, &b)| {
                        let (a, b) = (f64::from(a), f64::from(b));
                        let mean = a * (1.0 - share) + b * share;
                        (if is_float { mean } else { mean.round() }) as $kind
                    }));
                }
                all
            }};
        }
        match voxels {
            Voxels::U8(slice) => Voxels::U8(mixed!(slice, u8)),
            Voxels::I8(slice) => Voxels::I8(mixed!(slice, i8)),
            Voxels::U16(slice) => Voxels::U16(mixed!(slice, u16)),
            Voxels::I16(slice) => Voxels::I16(mixed!(slice, i16)),
            Voxels::U32(slice) => Voxels::U32(mixed!(slice, u32)),
            Voxels::I32(slice) => Voxels::I32(mixed!(slice, i32)),
            Voxels::F32(slice) => Voxels::F32(mixed!(slice, f32)),
            Voxels::F64(slice) => Voxels::F64(mixed!(slice, f64)),
        }
    }
}

/// The least distance that, with those about as long, makes up [`OFTEN`] of all; the least of all where none does.
fn often_finest(heights: &[f64]) -> Option<f64> {
    let mut sorted = heights.to_vec();
    sorted.sort_by(f64::total_cmp);
    let needed = (OFTEN * sorted.len() as f64).max(2.0);
    let count = |height: f64| {
        let same = sorted
            .iter()
            .filter(|&&other| (other / height - 1.0).abs() <= SAME);
        same.count() as f64
    };
    let often = sorted
        .iter()
        .copied()
        .find(|&height| count(height) >= needed);
    often.or(sorted.first().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(even: &Even, slices: &[i16]) -> Vec<i16> {
        match even.resampled(&Voxels::I16(slices.to_vec()), 1) {
            Voxels::I16(values) => values,
            other => panic!("the type stays, not {other:?}"),
        }
    }

    #[test]
    fn a_missing_slice_is_the_mean_of_its_neighbours_and_the_others_stay() {
        let even = Even::new(&[2.0, 2.0, 4.0, 2.0]).expect("few");
        assert_eq!((even.step, even.len()), (2.0, 6));
        assert_eq!(values(&even, &[10, 20, 31, 50, 7]), [10, 20, 31, 41, 50, 7]);
    }

    #[test]
    fn of_two_distances_the_finer_one_is_taken_and_a_single_closer_pair_is_not() {
        let heights = [vec![4.0; 10], vec![1.0], vec![8.0; 10]].concat();
        let even = Even::new(&heights).expect("few");
        assert!((even.step - 4.0).abs() < 0.1, "{}", even.step);
        // A ramp stays a ramp: a slice holds its own height, ten times.
        let at: Vec<i16> = heights
            .iter()
            .scan(0.0, |sum, height| {
                *sum += height;
                Some((10.0 * *sum) as i16)
            })
            .collect();
        let ramp = [vec![0], at].concat();
        for (number, value) in values(&even, &ramp).iter().enumerate() {
            let expected = 10.0 * even.step * number as f64;
            assert!(
                (f64::from(*value) - expected).abs() <= 0.5,
                "slice {number}"
            );
        }
    }

    #[test]
    fn far_more_slices_are_refused() {
        assert_eq!(Even::new(&[0.01, 0.01, 500.0]), None);
    }
}
