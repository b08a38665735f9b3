//! The kind of data that a volume holds, as far as its values tell it, and a transfer function from nothing but the histogram.
//!
//! Takes a volume and its histogram, returns one of four kinds. The rules, the first that fits:
//! 1. Hounsfield units: the range of a CT scanner, not in 8 bits, and most values are air, padding or soft tissue; or the
//!    file calls itself CT and the range fits.
//! 2. Labels: whole numbers, at most 512 of them that differ; of neighbours that are not 0 most are equal, and those that
//!    differ do so by more than a step to the next value. A mask (one value beside 0) is a field: interpolated, its surface is smooth.
//! 3. A scan: the file calls itself MR, or names a patient's space and holds nothing below 0.
//! 4. A field otherwise.
//!
//! The function is opacity knots, with colours from a named map. Otsu's threshold divides the scalars into a lower
//! class, the background, and an upper one, the object. The ramp begins at the end of the background, which lies
//! below the threshold when the background is narrow, so that thin and faint parts of the object stay.
//! Source: Otsu, "A Threshold Selection Method from Gray-Level Histograms", IEEE Trans. SMC 9(1), 1979.
//! Limits: values alone do not tell MR from CT that was shifted; labels of a volume that stays in its file are not found. Bright scalars
//! are taken as the object; data with a bright background needs its own function.

use crate::volume::{Described, Modality, Volume, VoxelType, Voxels, scalar, with_voxels};

use crate::transfer::{ColourMap, Histogram, OpacityKnot, TransferFunction};

/// The kind of a volume's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataKind {
    /// CT in Hounsfield units.
    Hounsfield,
    /// A scan of a patient in no unit, such as MR.
    Scan,
    /// Whole numbers that are names.
    Labels,
    /// Any other quantity.
    Field,
}

/// Scalars beyond which a volume does not look like Hounsfield units: scanners store 12 bits from -1024 on, some extend
/// them for metal, and air outside the round field of view is written as -2000, -2048 or -3024 by some.
const HOUNSFIELD_RANGE: (f64, f64) = (-3024.0, 32767.0);

/// Ranges of Hounsfield units that hold most of every scan of a body: padding, air, and soft tissue with fat.
const HOUNSFIELD_PEAKS: [(f64, f64); 3] = [(-3024.0, -1500.0), (-1100.0, -880.0), (-200.0, 200.0)];

/// Least share of the values in those ranges. Lungs and bone are the rest. A guess.
const HOUNSFIELD_SHARE: f64 = 0.5;

/// Least value of a scan in Hounsfield units: there is air in or around every body.
const HOUNSFIELD_AIR: f64 = -500.0;

/// Most labels of a map that are recognised; atlases have some hundred. A guess.
const MOST_LABELS: usize = 512;

/// Least share of equal neighbours among those that are not 0. Of real data, a map of tissues has 0.99, a CT head of 21 grey
/// levels 0.82, and scans of 8 bits 0.02 to 0.58.
const EQUAL_SHARE: f64 = 0.75;

/// Least share of steps over a value among unequal neighbours. The map has 0.90, the head of 21 levels 0.14, and scans of 8 bits,
/// which the other share excludes, 0.5 and more.
const JUMP_SHARE: f64 = 0.3;

/// Rows of voxels that are looked at for labels: enough for shares of a percent.
const ROWS: usize = 2048;

impl DataKind {
    /// The kind of a volume in memory.
    pub fn of_volume(volume: &Volume, histogram: &Histogram) -> Self {
        if !is_hounsfield(volume, histogram) && is_label_map(volume) {
            return Self::Labels;
        }
        Self::of(volume, histogram)
    }

    /// The kind of a volume whose single voxels are not looked at: labels count as a field.
    pub fn of(volume: &dyn Described, histogram: &Histogram) -> Self {
        let lattice = volume.lattice();
        if is_hounsfield(volume, histogram) {
            return Self::Hounsfield;
        }
        let space = lattice.space.unwrap_or_default().to_lowercase();
        let is_patient = space.contains("anterior") || space.contains("posterior");
        let is_scan = match lattice.modality {
            Some(Modality::Mr) => true,
            Some(Modality::Ct) => false,
            None => is_patient && histogram.range().0 >= 0.0,
        };
        if is_scan { Self::Scan } else { Self::Field }
    }
}

fn is_hounsfield(volume: &dyn Described, histogram: &Histogram) -> bool {
    let modality = volume.lattice().modality;
    let (low, high) = histogram.range();
    let is_small = matches!(volume.voxel_type(), VoxelType::U8 | VoxelType::I8);
    if is_small || low < HOUNSFIELD_RANGE.0 || high > HOUNSFIELD_RANGE.1 || low > HOUNSFIELD_AIR {
        return false;
    }
    match modality {
        Some(Modality::Ct) => true,
        Some(Modality::Mr) => false,
        None => share_in_peaks(histogram) >= HOUNSFIELD_SHARE,
    }
}

fn share_in_peaks(histogram: &Histogram) -> f64 {
    let counts = histogram.counts();
    let all: u64 = counts.iter().sum();
    let is_typical = |value: f64| {
        let mut peaks = HOUNSFIELD_PEAKS.iter();
        peaks.any(|&(low, high)| (low..=high).contains(&value))
    };
    let typical: u64 = counts
        .iter()
        .enumerate()
        .filter(|&(bin, _)| is_typical(histogram.value(bin)))
        .map(|(_, &count)| count)
        .sum();
    typical as f64 / (all as f64).max(1.0)
}

/// Pairs of neighbours along x.
#[derive(Debug, Default)]
struct Pairs {
    /// Neither of them is 0.
    both: u64,
    /// Both are the same, and not 0.
    equal: u64,
    /// They differ.
    unequal: u64,
    /// They differ by more than a step to the next value that occurs.
    jumps: u64,
}

fn is_label_map(volume: &Volume) -> bool {
    let Some(values) = few_whole_values(volume) else {
        return false;
    };
    // 0, and one value: a mask.
    if values.iter().filter(|&&value| value != 0).count() < 2 {
        return false;
    }
    let mut pairs = Pairs::default();
    for_rows(volume, |row| pairs.add(row, &values));
    let share = |part: u64, all: u64| part as f64 / (all as f64).max(1.0);
    share(pairs.equal, pairs.both) >= EQUAL_SHARE
        && share(pairs.jumps, pairs.unequal) >= JUMP_SHARE
        && is_whole(&volume.voxels)
}

/// The values of some rows, ascending, where all are whole and few differ.
fn few_whole_values(volume: &Volume) -> Option<Vec<i64>> {
    let mut values: Vec<i64> = Vec::new();
    let mut is_few = true;
    for_rows(volume, |row| {
        let mut last = f64::NAN;
        for &value in row {
            if value == last || !is_few {
                continue;
            }
            last = value;
            is_few = value.fract() == 0.0 && value.abs() < 9e15;
            if let Err(place) = values.binary_search(&(value as i64)) {
                values.insert(place, value as i64);
            }
            is_few &= values.len() <= MOST_LABELS;
        }
    });
    is_few.then_some(values)
}

/// Calls for [`ROWS`] rows, evenly spread.
fn for_rows(volume: &Volume, mut call: impl FnMut(&[f64])) {
    let [x, y, z] = volume.dims;
    let rows = y * z;
    let step = (rows / ROWS).max(1);
    // Not a divisor of the slices' height as a rule, so that rows are not all from one place of the slices.
    let step = if step > 1 { step | 1 } else { step };
    let mut row = Vec::with_capacity(x);
    for number in (0..rows).step_by(step) {
        let part = number * x..(number + 1) * x;
        row.clear();
        with_voxels!(&volume.voxels, slice => {
            row.extend(slice[part].iter().map(|&value| scalar(value)));
        });
        call(&row);
    }
}

impl Pairs {
    fn add(&mut self, row: &[f64], values: &[i64]) {
        let place = |value: f64| values.partition_point(|&v| v < value as i64);
        for pair in row.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            self.both += u64::from(a != 0.0 && b != 0.0);
            if a == b {
                self.equal += u64::from(a != 0.0);
            } else {
                self.unequal += 1;
                self.jumps += u64::from(place(a).abs_diff(place(b)) > 1);
            }
        }
    }
}

/// Returns true if every voxel is a whole number.
fn is_whole(voxels: &Voxels) -> bool {
    match voxels {
        Voxels::F32(values) => values.iter().all(|value| value.fract() == 0.0),
        Voxels::F64(values) => values.iter().all(|value| value.fract() == 0.0),
        _ => true,
    }
}

impl TransferFunction {
    /// A sensible one for a volume of which nothing is known but its values: the background is left out, the object
    /// is translucent at its faintest and dense at its brightest, and the colour map spans what is seen.
    ///
    /// The background is the lower side of the histogram, so data with a bright background needs its own function.
    /// A volume of one value is visible as a whole.
    ///
    /// ```
    /// use resample_volume::volume::procedural::blobs;
    /// use resample_volume::{ColourMap, Described, TransferFunction};
    ///
    /// let function = TransferFunction::automatic(&blobs(16)?.histogram(), ColourMap::default());
    /// assert_eq!(function.opacity(0.0), 0.0, "the empty space is transparent");
    /// # Ok::<(), resample_volume::Error>(())
    /// ```
    pub fn automatic(histogram: &Histogram, map: ColourMap) -> Self {
        transfer(histogram, map)
    }

    /// One for the greatest, least or mean value of a ray: the map spans all values but the brightest few, and the darkest tenth
    /// of it fades to nothing.
    pub fn projection(histogram: &Histogram, map: ColourMap) -> Self {
        let low = histogram.range().0;
        let high = histogram.value_below_brightest().max(low);
        let knot = |share: f64, opacity: f64| OpacityKnot {
            value: low * (1.0 - share) + high * share,
            opacity,
        };
        Self {
            colours: map.knots(low, high),
            opacities: vec![knot(0.0, 0.0), knot(FADED_SHARE, 1.0)],
        }
    }
}

/// Share of the range over which a projection fades to nothing, so that the background does not hide what is behind the picture.
const FADED_SHARE: f64 = 0.1;

/// The background is taken to reach this many standard deviations above its mean. A guess, looked at on CT of an engine,
/// a head, a lobster, a walnut and vessels: with 3, resin and noise begin to show; with 5, thin vessels fade.
const BACKGROUND_DEVIATIONS: f64 = 4.0;

/// Opacity per unit of length at the mean of the object: two voxels deep half of what is behind is still hidden. A guess.
const OBJECT_OPACITY: f64 = 0.5;

/// Opacity per unit of length at the greatest scalar. A guess.
const BRIGHTEST_OPACITY: f64 = 0.9;

/// Lower and upper class of the scalars.
#[derive(Debug)]
struct Classes {
    /// The scalar that divides them.
    threshold: f64,
    background_mean: f64,
    background_deviation: f64,
    object_mean: f64,
}

pub(crate) fn transfer(histogram: &Histogram, map: ColourMap) -> TransferFunction {
    let opacities = opacities(histogram);
    let low = opacities[0].value;
    // A range of almost all of f64 can round the last knot past the end; the order of knots does not depend on it.
    let high = histogram.range().1.max(low);
    TransferFunction {
        colours: map.knots(low, high),
        opacities,
    }
}

/// At least one knot, ascending.
pub(crate) fn opacities(histogram: &Histogram) -> Vec<OpacityKnot> {
    let (low, high) = histogram.range();
    let Some(classes) = otsu(histogram) else {
        return vec![OpacityKnot {
            value: low,
            opacity: OBJECT_OPACITY,
        }];
    };
    let begin = classes.background_end().clamp(low, high);
    if let Some(between) = mean_below_filling(histogram, begin) {
        // What fills the space is left out, and what lies between is seen as shells.
        let knots = [(begin, 0.0), (between, OBJECT_OPACITY), (high, 0.0)];
        return knots
            .map(|(value, opacity)| OpacityKnot { value, opacity })
            .to_vec();
    }
    let middle = classes.object_mean.clamp(begin, high);
    let mut knots = vec![
        OpacityKnot {
            value: begin,
            opacity: 0.0,
        },
        OpacityKnot {
            value: middle,
            opacity: OBJECT_OPACITY,
        },
    ];
    // Two values only: the object has no brighter part.
    if middle < high {
        knots.push(OpacityKnot {
            value: high,
            opacity: BRIGHTEST_OPACITY,
        });
    }
    knots
}

/// Share of all voxels from which on the greatest value is what fills the space, and not what stands in it. A guess, as is the next:
/// a cut-off jet has 0.28 and 0.035; saturated vessels of a scan have 0.002.
const FILLING_SHARE: f64 = 0.2;

/// Least share of all voxels between the background and what fills the space: below, there is nothing else to show.
const BETWEEN_SHARE: f64 = 0.02;

/// The mean of the values between the background and the greatest value, if the greatest value fills the space. A simulation's cut-off values
/// do, and hide all other values. `None` otherwise.
fn mean_below_filling(histogram: &Histogram, begin: f64) -> Option<f64> {
    let counts = histogram.counts();
    let (low, high) = histogram.range();
    let (filling, below) = counts.split_last()?;
    let total: f64 = counts.iter().map(|&count| count as f64).sum();
    let place = (begin - low) / (high - low) * below.len() as f64;
    let first = (place.floor() as usize + 1).min(below.len());
    let between: f64 = below[first..].iter().map(|&count| count as f64).sum();
    if (*filling as f64) < FILLING_SHARE * total || between < BETWEEN_SHARE * total {
        return None;
    }
    let (mean, _) = moments(&below[first..])?;
    let place = (first as f64 + mean) / below.len() as f64;
    Some(low * (1.0 - place) + high * place)
}

/// The scalar at which the background is over; the least scalar where there is no background.
pub fn background_end(histogram: &Histogram) -> f64 {
    let (low, high) = histogram.range();
    otsu(histogram).map_or(low, |classes| classes.background_end().clamp(low, high))
}

impl Classes {
    fn background_end(&self) -> f64 {
        let end = self.background_mean + BACKGROUND_DEVIATIONS * self.background_deviation;
        end.min(self.threshold)
    }
}

/// `None` if there are no two different values.
fn otsu(histogram: &Histogram) -> Option<Classes> {
    let counts = histogram.counts();
    let split = best_split(counts)?;
    let (background_mean, background_deviation) = moments(&counts[..split])?;
    let (object_mean, _) = moments(&counts[split..])?;
    // Bins to scalars; a deviation is a distance, so it is taken between two scalars.
    let scalar = |bin: f64| {
        let (low, high) = histogram.range();
        let place = bin / (counts.len() - 1) as f64;
        low * (1.0 - place) + high * place
    };
    Some(Classes {
        threshold: scalar(split as f64 - 0.5),
        background_mean: scalar(background_mean),
        background_deviation: scalar(background_mean + background_deviation)
            - scalar(background_mean),
        object_mean: scalar(object_mean + split as f64),
    })
}

/// The first bin of the upper class: the split with the greatest variance between the classes. Where empty bins make
/// several equal, the middle one.
fn best_split(counts: &[u64]) -> Option<usize> {
    let total: f64 = counts.iter().map(|&count| count as f64).sum();
    let moment: f64 = counts
        .iter()
        .enumerate()
        .map(|(bin, &count)| bin as f64 * count as f64)
        .sum();
    let (mut below, mut moment_below) = (0.0, 0.0);
    let (mut best, mut first, mut last) = (0.0, 0, 0);
    for (bin, &count) in counts.iter().enumerate() {
        below += count as f64;
        moment_below += bin as f64 * count as f64;
        if below == 0.0 || below == total {
            continue;
        }
        let difference = moment_below / below - (moment - moment_below) / (total - below);
        let variance = below * (total - below) * difference * difference;
        if variance > best {
            (best, first, last) = (variance, bin + 1, bin + 1);
        } else if count == 0 && last == bin {
            // An empty bin moves nothing, so it belongs to the same plateau.
            last = bin + 1;
        }
    }
    (best > 0.0).then_some(first.midpoint(last))
}

/// Mean and standard deviation of the bins' numbers, by counts; `None` without counts.
fn moments(counts: &[u64]) -> Option<(f64, f64)> {
    let total: f64 = counts.iter().map(|&count| count as f64).sum();
    if total == 0.0 {
        return None;
    }
    let weighted = |power: &dyn Fn(f64) -> f64| {
        let sum: f64 = counts
            .iter()
            .enumerate()
            .map(|(bin, &count)| power(bin as f64) * count as f64)
            .sum();
        sum / total
    };
    let mean = weighted(&|bin| bin);
    let variance = weighted(&|bin| (bin - mean) * (bin - mean));
    Some((mean, variance.sqrt()))
}

#[cfg(test)]
mod tests {
    use crate::volume::{Modality, Volume, Voxels};
    use glam::DAffine3;

    use super::{DataKind, *};
    use crate::transfer::Histogram;

    const SIDE: usize = 40;

    /// A cube of values by place, 0 to 1 along each axis.
    fn cube(value: impl Fn([f64; 3]) -> f64) -> Vec<f64> {
        let place = |i: usize| i as f64 / (SIDE - 1) as f64;
        (0..SIDE.pow(3))
            .map(|i| value([i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(place)))
            .collect()
    }

    fn volume(voxels: Voxels) -> Volume {
        Volume::new([SIDE; 3], voxels, DAffine3::IDENTITY).expect("valid")
    }

    fn kind(volume: &Volume) -> DataKind {
        DataKind::of_volume(volume, &Histogram::of_volume(volume))
    }

    fn radius([x, y, z]: [f64; 3]) -> f64 {
        let square = |v: f64| (v - 0.5) * (v - 0.5);
        (square(x) + square(y) + square(z)).sqrt()
    }

    /// A body in Hounsfield units: air, a skin of fat, muscle, a bone.
    fn body(place: [f64; 3]) -> f64 {
        match radius(place) {
            r if r < 0.1 => 900.0 - 4000.0 * r,
            r if r < 0.35 => 50.0,
            r if r < 0.4 => -100.0,
            _ => -1000.0,
        }
    }

    #[test]
    fn hounsfield_units_are_told_by_range_air_and_tissue() {
        let ct = volume(Voxels::I16(cube(body).iter().map(|&v| v as i16).collect()));
        assert_eq!(kind(&ct), DataKind::Hounsfield);
        let as_singles = volume(Voxels::F32(cube(body).iter().map(|&v| v as f32).collect()));
        assert_eq!(kind(&as_singles), DataKind::Hounsfield, "NIfTI has singles");
        // The same range filled evenly is a temperature or the like.
        let even = cube(|[x, y, z]| -1000.0 + 3000.0 * (x + 40.0 * y + 1600.0 * z) / 1641.0);
        assert_eq!(kind(&volume(Voxels::F64(even))), DataKind::Field);
        let shifted: Vec<u16> = cube(body).iter().map(|&v| (v + 1000.0) as u16).collect();
        assert_eq!(
            kind(&volume(Voxels::U16(shifted))),
            DataKind::Field,
            "no unit known"
        );
    }

    #[test]
    fn a_file_that_names_its_scanner_is_believed() {
        let mut mr = volume(Voxels::I16(cube(body).iter().map(|&v| v as i16).collect()));
        mr.modality = Some(Modality::Mr);
        assert_eq!(kind(&mr), DataKind::Scan);
        // Bone fills most of it.
        let dense = cube(|p| if radius(p) < 0.45 { 700.0 } else { -1000.0 });
        let mut ct = volume(Voxels::I16(dense.iter().map(|&v| v as i16).collect()));
        ct.modality = Some(Modality::Ct);
        assert_eq!(kind(&ct), DataKind::Hounsfield);
    }

    #[test]
    fn a_patient_without_negative_values_is_a_scan() {
        let bright = cube(|p| 1000.0 * (0.9 - radius(p)).max(0.0) + p[0]);
        let mut scan = volume(Voxels::F64(bright));
        assert_eq!(kind(&scan), DataKind::Field);
        scan.space = Some("right-anterior-superior".to_owned());
        assert_eq!(kind(&scan), DataKind::Scan);
    }

    #[test]
    fn labels_are_few_whole_values_in_large_equal_regions() {
        let regions = |[x, y, z]: [f64; 3]| {
            let inside = radius([x, y, z]) < 0.45;
            let part = (x * 3.0) as usize + 3 * (y * 3.0) as usize;
            if inside {
                [
                    4.0, 17.0, 3.0, 9.0, 250.0, 2.0, 41.0, 8.0, 77.0, 1.0, 5.0, 6.0, 7.0, 10.0,
                    11.0, 12.0,
                ][part]
            } else {
                0.0
            }
        };
        let labels = cube(regions);
        assert_eq!(
            kind(&volume(Voxels::F64(labels.clone()))),
            DataKind::Labels,
            "as NIfTI scales them"
        );
        let mut bytes = volume(Voxels::U8(labels.iter().map(|&v| v as u8).collect()));
        bytes.space = Some("left-posterior-superior".to_owned());
        assert_eq!(kind(&bytes), DataKind::Labels, "in a patient's space too");
        let half = labels.iter().map(|v| v * 0.5).collect();
        assert_eq!(
            kind(&volume(Voxels::F64(half))),
            DataKind::Field,
            "not whole"
        );
    }

    #[test]
    fn masks_and_smooth_fields_of_few_values_are_no_labels() {
        let mask = cube(|p| f64::from(radius(p) < 0.4));
        let mask = volume(Voxels::U8(mask.iter().map(|&v| v as u8).collect()));
        assert_eq!(
            kind(&mask),
            DataKind::Field,
            "a mask is smooth when it is interpolated"
        );
        let steps = cube(|p| (20.0 * (0.8 - radius(p))).max(0.0).floor());
        let steps = volume(Voxels::U8(steps.iter().map(|&v| v as u8).collect()));
        assert_eq!(
            kind(&steps),
            DataKind::Field,
            "a field of few levels goes level by level"
        );
        let one = volume(Voxels::U8(vec![7; SIDE.pow(3)]));
        assert_eq!(kind(&one), DataKind::Field);
    }

    fn automatic(voxels: Voxels) -> TransferFunction {
        let volume = Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid");
        TransferFunction::automatic(&Histogram::of_volume(&volume), ColourMap::default())
    }

    /// A background of mean 100 and deviation about 10, and an object one tenth as large around 1000.
    fn two_bells(scale: f64, shift: f64) -> Vec<f64> {
        let bell = |mean: f64, count: usize| {
            (0..count).map(move |n| {
                let phases =
                    [0.618_034, 0.754_878, 0.569_840].map(|step: f64| (n as f64 * step).fract());
                mean + 20.0 * (phases.iter().sum::<f64>() - 1.5)
            })
        };
        bell(100.0, 10_000)
            .chain(bell(1000.0, 1000))
            .map(|value| value * scale + shift)
            .collect()
    }

    #[test]
    fn background_vanishes_and_object_stays_at_any_scale() {
        for (scale, shift) in [
            (1.0, 0.0),
            (1e-30, 0.0),
            (1e300, 0.0),
            (1.0, -5000.0),
            (0.01, 1e6),
        ] {
            let function = automatic(Voxels::F64(two_bells(scale, shift)));
            let at = |value: f64| function.opacity(value * scale + shift);
            assert_eq!(
                at(100.0),
                0.0,
                "scale {scale}, shift {shift}: the background is seen"
            );
            assert_eq!(
                at(130.0),
                0.0,
                "scale {scale}, shift {shift}: the end of the background is seen"
            );
            assert!(
                at(970.0) > 0.4,
                "scale {scale}, shift {shift}: the object is lost: {}",
                at(970.0)
            );
        }
    }

    #[test]
    fn integers_are_treated_alike() {
        let values = two_bells(1.0, -600.0)
            .iter()
            .map(|v| v.round() as i16)
            .collect();
        let function = automatic(Voxels::I16(values));
        assert_eq!(function.opacity(-500.0), 0.0);
        assert!(function.opacity(400.0) > 0.4);
    }

    #[test]
    fn the_greatest_value_is_left_out_where_it_fills_the_space() {
        let jet = |share_of_top: usize| {
            let value = move |i: usize| match i % 100 {
                n if n < share_of_top => 1000.0,
                n if n < share_of_top + 10 => (300 + 40 * (n - share_of_top)) as f32,
                _ => 0.0,
            };
            automatic(Voxels::F32((0..27_000).map(value).collect()))
        };
        let filled = jet(30);
        assert_eq!(filled.opacity(1000.0), 0.0);
        assert!(filled.opacity(560.0) > 0.4 && filled.opacity(0.0) == 0.0);
        // Cut off, too, but an object in empty space.
        assert!(jet(10).opacity(1000.0) > 0.85);
    }

    #[test]
    fn a_constant_volume_is_visible() {
        for value in [0.0, -7.0, 1e300] {
            let function = automatic(Voxels::F64(vec![value; 8]));
            assert_eq!(function.opacity(value), OBJECT_OPACITY);
            assert!(
                function
                    .colour(value)
                    .iter()
                    .all(|channel| channel.is_finite())
            );
        }
    }

    #[test]
    fn of_two_values_the_greater_is_the_object() {
        for (low, high) in [(0u8, 255u8), (3, 4), (0, 1)] {
            let function = automatic(Voxels::U8([vec![low; 99], vec![high]].concat()));
            assert_eq!(
                (function.opacity(low.into()), function.opacity(high.into())),
                (0.0, OBJECT_OPACITY)
            );
        }
    }

    #[test]
    fn the_split_of_two_values_lies_half_way() {
        assert_eq!(
            best_split(&[5, 0, 0, 0, 5]),
            Some(2),
            "bins 1 to 4 are equal, their middle is 2"
        );
        assert_eq!(best_split(&[5, 5]), Some(1));
        assert_eq!(best_split(&[9]), None);
        assert_eq!(best_split(&[0, 9, 0]), None);
    }
}
