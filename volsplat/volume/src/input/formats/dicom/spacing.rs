//! Slices at uneven distances, resampled to even ones.
//!
//! Takes the distances of neighbours, gives the even lattice between the first and the last slice: its step is about the finest distance
//! that occurs often, so that nothing of the finer part is lost and a missing slice is filled in. A slice of the lattice is the linear
//! mean of its two neighbours, or one of them where it lies there.
//! Limits: at most 4 times as many slices; linear interpolation widens what lies between distant slices.

use crate::volume::Voxels;

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
