//! Between which stored numbers the depth of a picture or of a sequence lies, where its numbers have no unit.
//!
//! Takes the numbers of one depth file or of many, gives two of them: the quantile of the far end and that of the near
//! end. A sequence has one range for all of its frames, so that a thing that stands still keeps its depth whatever else
//! comes into the picture. Single wrong numbers decide nothing. Limits: a thing that covers less than [`SHARE`] of all
//! pixels and is nearer than all others becomes flat, at the near end.

use crate::Error;
use resample_io::{Plane, Receiver};

/// Share of the numbers that lie beyond the range at each end. A guess: of sensible sizes the smallest that leaves out
/// the flying pixels of a map of 200x100, some tens; 2 %, which pictures of such maps often take, flattens small heads.
pub const SHARE: f64 = 0.005;

/// Most numbers of a frame that count. The rank of a quantile then is off by 3 % of `SHARE` (one deviation of a binomial).
const FRAME_NUMBERS: usize = 1 << 18;

/// The numbers that decide a range.
pub(crate) struct RangeOf<'a> {
    /// Returns true if a stored number may mean a depth.
    is_known: &'a dyn Fn(f32) -> bool,
    width: usize,
    step: usize,
    numbers: Vec<f32>,
}

impl<'a> RangeOf<'a> {
    pub(crate) fn new(is_known: &'a dyn Fn(f32) -> bool) -> Self {
        Self {
            is_known,
            width: 0,
            step: 1,
            numbers: Vec::new(),
        }
    }

    /// Takes the numbers of a plane.
    pub(crate) fn take(&mut self, stored: &Plane) {
        self.start([stored.width, stored.height]);
        self.take_from(0, &stored.values);
    }

    /// A new frame: every how many of its numbers one counts. Out of step with its width, so that all columns count.
    fn start(&mut self, [width, height]: [usize; 2]) {
        let mut step = (width * height).div_ceil(FRAME_NUMBERS).max(1);
        while step > 1 && has_common_factor(step, width) {
            step += 1;
        }
        (self.width, self.step) = (width, step);
    }

    /// Takes numbers that follow one another, the first of which is pixel `first`.
    fn take_from(&mut self, first: usize, values: &[f32]) {
        let skipped = (self.step - first % self.step) % self.step;
        let counted = values.iter().skip(skipped).step_by(self.step).copied();
        let is_known = |value: &f32| (self.is_known)(*value);
        self.numbers.extend(counted.filter(is_known));
    }

    /// The range; `None` where no number is usable.
    pub(crate) fn found(mut self) -> Option<[f64; 2]> {
        let last = self.numbers.len().checked_sub(1)?;
        let beyond = (SHARE * last as f64) as usize;
        let mut at = |rank: usize| {
            let (_, number, _) = self.numbers.select_nth_unstable_by(rank, f32::total_cmp);
            f64::from(*number)
        };
        let (far, near) = (at(beyond), at(last - beyond));
        // Where nearly all numbers are one, the others are what the picture shows.
        Some(if far < near {
            [far, near]
        } else {
            [at(0), at(last)]
        })
    }
}

impl Receiver for RangeOf<'_> {
    fn begin(&mut self, size: [usize; 2]) -> Result<(), Error> {
        self.start(size);
        Ok(())
    }

    fn put(&mut self, [x, y]: [usize; 2], values: &[f32]) -> Result<(), Error> {
        self.take_from(y * self.width + x, values);
        Ok(())
    }
}

/// Returns true if two numbers above 0 have a factor above 1 in common.
fn has_common_factor(mut a: usize, mut b: usize) -> bool {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a > 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use resample_io::Stored;

    fn plane(width: usize, values: Vec<f32>) -> Plane {
        Plane {
            width,
            height: values.len() / width,
            values,
            stored: Stored::Float,
        }
    }

    fn range(planes: &[Plane]) -> Option<[f64; 2]> {
        let mut range = RangeOf::new(&|value| value.is_finite());
        planes.iter().for_each(|plane| range.take(plane));
        range.found()
    }

    #[test]
    fn wild_numbers_decide_nothing_and_few_numbers_all_count() {
        let ramp = |i: usize| 1.0 + (i % 200) as f32;
        let mut values: Vec<f32> = (0..20_000).map(ramp).collect();
        let clean = range(&[plane(200, values.clone())]);
        for i in 0..40 {
            values[i * 450] = [-1e6, 1e6, f32::NAN, f32::INFINITY][i % 4];
        }
        assert_eq!(range(&[plane(200, values)]), clean);
        assert_eq!(clean, Some([1.0, 200.0]));
        let few = plane(3, vec![20.0, 120.0, 70.0]);
        assert_eq!(range(&[few]), Some([20.0, 120.0]));
        assert_eq!(range(&[plane(1, vec![f32::NAN])]), None);
        let mut nearly_flat = vec![3.0; 1000];
        nearly_flat[7] = 5.0;
        assert_eq!(range(&[plane(10, nearly_flat)]), Some([3.0, 5.0]));
    }

    #[test]
    fn every_frame_counts_and_pieces_of_rows_count_as_the_whole() {
        let (width, height) = (1024, 700);
        let near = plane(width, vec![9.0; width * height]);
        let far = plane(
            width,
            (0..width * height).map(|i| (i % width) as f32).collect(),
        );
        let both = range(&[near.clone(), far.clone()]).expect("numbers");
        assert!(both[0] < 12.0 && both[1] > 1000.0, "{both:?}");
        let is_known = |value: f32| value.is_finite();
        let (mut whole, mut pieces) = (RangeOf::new(&is_known), RangeOf::new(&is_known));
        whole.take(&far);
        pieces.begin([width, height]).expect("a frame");
        for (y, row) in far.values.chunks(width).enumerate() {
            for (part, values) in row.chunks(100).enumerate() {
                pieces.put([part * 100, y], values).expect("a piece");
            }
        }
        assert_eq!(whole.numbers, pieces.numbers);
    }
}
