//! How often each scalar occurs in a volume.
//!
//! Takes a volume, returns counts in equal bins. Integers that span few values have one bin each; all values of a small type are counted
//! once, so that later questions need no voxel. Where all but a few
//! voxels fall into two neighbouring bins (one broken voxel of 1e30 does that), the histogram is made again over what
//! those bins hold, and the few are counted at its ends.

use std::convert::Infallible;
use std::ops::Range;

use rayon::prelude::*;

use crate::volume::{Volume, VoxelType, Voxels, scalar, with_voxels};

/// Counts of the scalars of a volume in equal bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    low: f64,
    high: f64,
    counts: Vec<u64>,
}

/// Integers of up to this many values get one bin each; all 8- and 16-bit types do.
const MAX_EXACT_BINS: f64 = 65536.0;

/// Bins of other data: sixteen times the levels of a picture. A guess.
const BINS: usize = 4096;

/// Up to this share of the voxels are outliers when all others fall into two bins: 167 of 256^3. A guess; an object
/// that small differs from outliers only to the eye.
const OUTLIER_SHARE: f64 = 1e-5;

/// Share of the voxels that are the brightest few: fat and vessels shine far above all else in MR. A guess.
const BRIGHTEST_SHARE: f64 = 0.002;

/// Ways from the range of f64 down to one bin: each zoom divides the range by 2048, and f64 spans 2^2098.
const MAX_ZOOMS: usize = 200;

impl Histogram {
    /// The histogram of a volume; a few passes over its voxels, or one where they are of a type of few values.
    ///
    /// ```
    /// use glam::DAffine3;
    /// use resample_volume::{Histogram, Volume, Voxels};
    ///
    /// let volume = Volume::new([4, 1, 1], Voxels::U8(vec![7, 7, 9, 8]), DAffine3::IDENTITY)?;
    /// let histogram = Histogram::of_volume(&volume);
    /// assert_eq!(histogram.range(), (7.0, 9.0));
    /// assert_eq!(histogram.counts(), [2, 1, 1]);
    /// # Ok::<(), resample_volume::Error>(())
    /// ```
    pub fn of_volume(volume: &Volume) -> Self {
        if let Some(mut tally) = Tally::of_type(VoxelType::of(&volume.voxels)) {
            tally.add(&volume.voxels);
            return tally.histogram();
        }
        Self::of_voxels(volume)
    }

    /// The same by passes over the voxels, of any type.
    fn of_voxels(volume: &Volume) -> Self {
        let is_integer = !matches!(volume.voxels, Voxels::F32(_) | Voxels::F64(_));
        let Ok(histogram) = Self::refined::<Infallible>(
            volume.value_range(),
            |low, high| Ok(Self::over(&volume.voxels, low, high, is_integer)),
            |from, to| Ok(range_within(&volume.voxels, from, to)),
        );
        histogram
    }

    /// The histogram of values that two questions are asked about: their histogram between two scalars, and the least
    /// and greatest of those between two scalars.
    pub fn refined<E>(
        (mut low, mut high): (f64, f64),
        mut over: impl FnMut(f64, f64) -> Result<Self, E>,
        mut range_within: impl FnMut(f64, f64) -> Result<(f64, f64), E>,
    ) -> Result<Self, E> {
        let mut histogram = over(low, high)?;
        for _ in 0..MAX_ZOOMS {
            let Some((from, to)) = histogram.crowded_range() else {
                break;
            };
            let (inner_low, inner_high) = range_within(from, to)?;
            // One value and a few others is a clear case, and a range that does not shrink will never be.
            if inner_low >= inner_high || (inner_low, inner_high) == (low, high) {
                break;
            }
            (low, high) = (inner_low, inner_high);
            histogram = over(low, high)?;
        }
        Ok(histogram)
    }

    /// Adds the counts of another one over the same range.
    pub fn add(&mut self, other: &Self) {
        self.counts
            .iter_mut()
            .zip(&other.counts)
            .for_each(|(count, more)| *count += more);
    }

    /// One histogram over the ranges of several; a bin counts where the scalar falls that it stands for.
    pub fn merged(all: &[Self], is_integer: bool) -> Self {
        let ends = |(low, high): (f64, f64), one: &Self| (low.min(one.low), high.max(one.high));
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = match all.iter().fold(none, ends) {
            (low, high) if low <= high => (low, high),
            _ => (0.0, 0.0),
        };
        let (bins, bin_of) = bins(low, high, is_integer);
        let mut counts = vec![0; bins];
        for one in all {
            for (bin, count) in one.counts.iter().enumerate() {
                counts[bin_of(one.value(bin))] += count;
            }
        }
        Self { low, high, counts }
    }

    /// Least and greatest scalar that the bins stand for.
    pub fn range(&self) -> (f64, f64) {
        (self.value(0), self.value(self.counts.len() - 1))
    }

    /// The counts, one per bin, at least one bin.
    pub fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// The scalar that a bin stands for; the first and last bin stand for the ends of the range.
    pub fn value(&self, bin: usize) -> f64 {
        let last = (self.counts.len() - 1).max(1) as f64;
        if self.high - self.low == last {
            // One bin per integer: exactly that integer.
            return self.low + bin as f64;
        }
        let place = bin as f64 / last;
        self.low * (1.0 - place) + self.high * place
    }

    /// The scalar above which there are only the brightest few voxels.
    pub fn value_below_brightest(&self) -> f64 {
        self.value_with_above(BRIGHTEST_SHARE, f64::NEG_INFINITY)
    }

    /// The scalars between which slices go from black to white: all but the darkest hundredth and the brightest two hundredths, without the background,
    /// which is the first 256th of the range.
    pub fn usual_window(&self) -> [f64; 2] {
        let (low, high) = self.range();
        let background = low + (high - low) / 256.0;
        let ends = [0.99, 0.02].map(|share| self.value_with_above(share, background));
        match ends[0] < ends[1] {
            true => ends,
            false => [low, high],
        }
    }

    /// The greatest scalar above which there is more than a share of the voxels from `low` on.
    pub fn value_with_above(&self, share: f64, low: f64) -> f64 {
        let first = (0..self.counts.len())
            .find(|&bin| self.value(bin) >= low)
            .unwrap_or(0);
        let total: u64 = self.counts[first..].iter().sum();
        let allowed = share * total as f64;
        let mut above = 0.0;
        for bin in (first..self.counts.len()).rev() {
            above += self.counts[bin] as f64;
            if above > allowed {
                return self.value(bin);
            }
        }
        self.range().1
    }

    /// Counts scalars in bins whose centres run from `low` to `high`; scalars beyond are counted at the ends.
    pub fn over(voxels: &Voxels, low: f64, high: f64, is_integer: bool) -> Self {
        let (bins, bin_of) = bins(low, high, is_integer);
        let count = |part: Range<usize>| {
            let mut counts = vec![0u64; bins];
            with_voxels!(voxels, slice => {
                for &value in &slice[part] {
                    counts[bin_of(scalar(value))] += 1;
                }
            });
            counts
        };
        let parts = voxels.parts().into_par_iter().map(count);
        let counts = parts.reduce_with(|mut one, other| {
            one.iter_mut()
                .zip(other)
                .for_each(|(count, more)| *count += more);
            one
        });
        Self {
            low,
            high,
            counts: counts.unwrap_or_else(|| vec![0; bins]),
        }
    }

    /// The range of the two neighbouring bins that hold all voxels but a few, if there are such.
    fn crowded_range(&self) -> Option<(f64, f64)> {
        let total: u64 = self.counts.iter().sum();
        let first =
            (1..self.counts.len()).max_by_key(|&bin| self.counts[bin - 1] + self.counts[bin])? - 1;
        let outside = total - self.counts[first] - self.counts[first + 1];
        let half_bin = 0.5 * (self.value(first + 1) - self.value(first));
        let is_crowded = outside as f64 <= OUTLIER_SHARE * total as f64 && self.counts.len() > 2;
        is_crowded.then(|| {
            (
                self.value(first) - half_bin,
                self.value(first + 1) + half_bin,
            )
        })
    }
}

/// How many bins there are over a range, and which one a scalar falls into.
fn bins(low: f64, high: f64, is_integer: bool) -> (usize, impl Fn(f64) -> usize + Sync) {
    let bins = match high - low {
        span if is_integer && span < MAX_EXACT_BINS => span as usize + 1,
        span if span > 0.0 => BINS,
        _ => 1,
    };
    let last = (bins - 1) as f64;
    // One bin only is a constant volume; its share would be 0/0.
    let bin_of = move |value: f64| {
        if bins == 1 {
            0
        } else {
            (share_of(value, low, high) * last + 0.5) as usize
        }
    };
    (bins, bin_of)
}

/// Least and greatest of the scalars in `from..=to`; (infinity, -infinity) if there are none.
pub fn range_within(voxels: &Voxels, from: f64, to: f64) -> (f64, f64) {
    let nothing = || (f64::INFINITY, f64::NEG_INFINITY);
    let range = |part: Range<usize>| {
        with_voxels!(voxels, slice => {
            let inside = slice[part].iter().map(|&value| scalar(value)).filter(|value| (from..=to).contains(value));
            inside.fold(nothing(), |(low, high), value| (low.min(value), high.max(value)))
        })
    };
    let parts = voxels.parts().into_par_iter().map(range);
    parts.reduce(nothing, |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Where `value` lies between two scalars, 0..=1.
pub fn share_of(value: f64, low: f64, high: f64) -> f64 {
    let span = high - low;
    let share = if span.is_finite() {
        (value - low) / span
    } else {
        // Two scalars near the ends of f64: halved, their distance is finite.
        (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low)
    };
    share.clamp(0.0, 1.0)
}

/// How often each value of a type of 8 or 16 bits occurs.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    lowest: i32,
    counts: Vec<u64>,
}

/// Voxels per parallel task: a task fills a table of 65536 counts of its own, which must be little beside its work.
const VOXELS_PER_TASK: usize = 1 << 22;

impl Tally {
    /// No value yet; `None` for a type of more than 16 bits.
    pub fn of_type(voxel_type: VoxelType) -> Option<Self> {
        let (lowest, count) = match voxel_type {
            VoxelType::U8 => (0, 1 << 8),
            VoxelType::I8 => (-(1 << 7), 1 << 8),
            VoxelType::U16 => (0, 1 << 16),
            VoxelType::I16 => (-(1 << 15), 1 << 16),
            _ => return None,
        };
        Some(Self {
            lowest,
            counts: vec![0; count],
        })
    }

    /// Counts voxels of the type.
    pub fn add(&mut self, voxels: &Voxels) {
        let (lowest, len) = (self.lowest, self.counts.len());
        let count = |part: Range<usize>| {
            if let Voxels::U8(bytes) = voxels {
                return counts_of_bytes(&bytes[part]);
            }
            let mut counts = vec![0u64; len];
            with_voxels!(voxels, slice => {
                for &value in &slice[part] {
                    counts[(scalar(value) as i32 - lowest) as usize] += 1;
                }
            });
            counts
        };
        let counts: Vec<Vec<u64>> = voxels
            .parts_of(VOXELS_PER_TASK)
            .into_par_iter()
            .map(count)
            .collect();
        for part in counts {
            self.counts
                .iter_mut()
                .zip(part)
                .for_each(|(count, more)| *count += more);
        }
    }

    /// Least and greatest value that occurs.
    pub fn range(&self) -> (f64, f64) {
        self.within(f64::NEG_INFINITY, f64::INFINITY)
    }

    /// How many values there are that pass.
    pub fn count(&self, passes: impl Fn(f64) -> bool) -> u64 {
        self.values()
            .filter(|&(value, _)| passes(value))
            .map(|(_, count)| count)
            .sum()
    }

    /// The histogram that [`Histogram::of_volume`] returns for the counted voxels.
    pub fn histogram(&self) -> Histogram {
        let Ok(histogram) = Histogram::refined::<Infallible>(
            self.range(),
            |low, high| Ok(self.over(low, high)),
            |from, to| Ok(self.within(from, to)),
        );
        histogram
    }

    fn over(&self, low: f64, high: f64) -> Histogram {
        let (bins, bin_of) = bins(low, high, true);
        let mut counts = vec![0; bins];
        self.values()
            .for_each(|(value, count)| counts[bin_of(value)] += count);
        Histogram { low, high, counts }
    }

    fn within(&self, from: f64, to: f64) -> (f64, f64) {
        let inside = self
            .values()
            .filter(|(value, _)| (from..=to).contains(value));
        inside.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (v, _)| {
            (low.min(v), high.max(v))
        })
    }

    /// The values that occur, ascending, and how often.
    fn values(&self) -> impl Iterator<Item = (f64, u64)> + '_ {
        let all = self
            .counts
            .iter()
            .enumerate()
            .filter(|(_, count)| **count > 0);
        all.map(|(i, &count)| (f64::from(self.lowest) + i as f64, count))
    }
}

/// How often each byte occurs.
fn counts_of_bytes(bytes: &[u8]) -> Vec<u64> {
    // A count that was just raised is known to the next one after some cycles: bytes that are alike go to four tables.
    const TABLES: usize = 4;
    let mut counts = [[0u64; 1 << 8]; TABLES];
    let (fours, rest) = bytes.as_chunks::<TABLES>();
    for four in fours {
        for (counts, &byte) in counts.iter_mut().zip(four) {
            counts[usize::from(byte)] += 1;
        }
    }
    for &byte in rest {
        counts[0][usize::from(byte)] += 1;
    }
    let sum = |byte: usize| counts.iter().map(|counts| counts[byte]).sum();
    (0..1 << 8).map(sum).collect()
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::Volume;

    fn histogram(voxels: Voxels) -> Histogram {
        let volume = Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid");
        Histogram::of_volume(&volume)
    }

    #[test]
    fn integers_have_one_bin_each() {
        let counted = histogram(Voxels::I16(vec![-3, -3, 0, 2, 2, 2]));
        assert_eq!(counted.counts(), [2, 0, 0, 1, 0, 3]);
        assert_eq!(counted.range(), (-3.0, 2.0));
        assert_eq!(counted.value(3), 0.0);
    }

    #[test]
    fn the_usual_window_leaves_out_the_background_and_the_ends() {
        let thousand = (0..=1000).map(|value| value as u16);
        let counted = histogram(Voxels::U16([0; 5000].into_iter().chain(thousand).collect()));
        let [low, high] = counted.usual_window();
        assert!(
            (12.0..=15.0).contains(&low) && (979.0..=981.0).contains(&high),
            "{low}, {high}"
        );
        assert_eq!(histogram(Voxels::U8(vec![7; 9])).usual_window(), [7.0, 7.0]);
    }

    #[test]
    fn constant_volumes_have_one_bin() {
        let counted = histogram(Voxels::F32(vec![7.5; 9]));
        assert_eq!((counted.counts(), counted.range()), (&[9][..], (7.5, 7.5)));
    }

    #[test]
    fn outliers_do_not_flatten_the_rest() {
        let mut values: Vec<f64> = (0..400_000).map(|v| f64::from(v) / 400_000.0).collect();
        values[1234] = 1e300;
        values[4321] = -1e300;
        let counted = histogram(Voxels::F64(values));
        let (low, high) = counted.range();
        assert!(low >= 0.0 && high <= 1.0, "zoomed to {low} .. {high}");
        assert_eq!(
            counted.counts().iter().sum::<u64>(),
            400_000,
            "outliers are counted at the ends"
        );
        let fullest = counted.counts().iter().max().expect("bins");
        assert!(
            *fullest < 110,
            "even values fill all bins evenly, not {fullest}"
        );
    }

    #[test]
    fn a_small_object_in_a_constant_background_is_kept() {
        let mut values = vec![0.0f32; 400_000];
        values[77] = 5.0;
        assert_eq!(histogram(Voxels::F32(values)).range(), (0.0, 5.0));
    }

    #[test]
    fn extreme_ranges_neither_overflow_nor_vanish() {
        let counted = histogram(Voxels::F64(vec![-1.7e308, 0.0, 1.7e308]));
        assert_eq!(
            counted.counts().iter().filter(|&&count| count == 1).count(),
            3
        );
        let counted = histogram(Voxels::F64(vec![0.0, 1e-310, 2e-310]));
        assert_eq!(
            counted.counts().iter().filter(|&&count| count == 1).count(),
            3
        );
    }

    #[test]
    fn bytes_are_counted_by_four() {
        let bytes: Vec<u8> = (0..100_003u64).map(|i| ((i * i) >> 7) as u8).collect();
        let voxels = Voxels::U8(bytes);
        let volume = Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid");
        assert_eq!(Histogram::of_volume(&volume), Histogram::of_voxels(&volume));
    }

    #[test]
    fn a_tally_tells_what_the_volume_tells() {
        let spread: Vec<i16> = (0..4000).map(|i| (i * 7919 % 3001 - 1500) as i16).collect();
        let mut crowded = vec![5i16; 400_000];
        (crowded[17], crowded[99], crowded[123]) = (-30_000, 30_000, 6);
        for values in [spread, crowded, vec![7; 10]] {
            let voxels = Voxels::I16(values);
            let mut tally = Tally::of_type(VoxelType::I16).expect("a small type");
            tally.add(&voxels);
            let volume =
                Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid");
            assert_eq!(tally.range(), volume.value_range(), "range");
            assert_eq!(
                tally.histogram(),
                Histogram::of_voxels(&volume),
                "histogram"
            );
            assert_eq!(
                tally.count(|v| v > 5.5),
                (0..volume.len()).filter(|&i| volume.value(i) > 5.5).count() as u64
            );
        }
    }
}
