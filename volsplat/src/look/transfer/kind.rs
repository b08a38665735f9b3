//! The kind of data that a volume holds, as far as its values tell it.
//!
//! Takes a volume and its histogram, gives one of four kinds: Hounsfield units, another scan of a patient, labels, or a field of any other quantity.
//! The rules, the first that fits:
//! 1. Hounsfield units: the range of a CT scanner, not in 8 bits, and most values are air, padding or soft tissue; or the
//!    file calls itself CT and the range fits.
//! 2. Labels: whole numbers, at most 512 of them that differ; of neighbours that are not 0 most are equal, and those that
//!    differ do so by more than a step to the next value. A mask (one value beside 0) is a field: interpolated, its surface is smooth.
//! 3. A scan: the file calls itself MR, or names a patient's space and holds nothing below 0.
//! 4. A field otherwise.
//!
//! Limits: values alone do not tell MR from CT that was shifted; labels of a volume that stays in its file are not found.

use resample_volume::volume::{
    Described, Modality, Volume, VoxelType, Voxels, scalar, with_voxels,
};

use crate::look::transfer::Histogram;

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

#[cfg(test)]
mod tests;
