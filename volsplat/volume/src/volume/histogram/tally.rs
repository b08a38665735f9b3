//! Counts of all values of a small type: whatever is asked later about a volume's values needs no voxel any more.

use std::convert::Infallible;
use std::ops::Range;

use rayon::prelude::*;

use crate::volume::histogram::{Histogram, bins};
use crate::volume::{VoxelType, Voxels, scalar, with_voxels};

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
