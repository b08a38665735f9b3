//! The support of a transfer function: the scalars that it shows.
//!
//! Cells and voxels are dropped when their scalars miss the support; the test may keep what it could drop, and never
//! drops what is seen.

use std::ops::RangeInclusive;

use resample_core::dispatch;
use resample_core::simd::SimdLevel;

use super::cells::ShownCells;
use super::scalars::Scalars;
use super::shown::CellRanges;
use crate::look::transfer::TransferFunction;

/// The scalars whose opacity is above 0.
#[derive(Clone, Debug)]
pub(crate) struct Support {
    /// Ascending, apart from one another.
    intervals: Vec<RangeInclusive<f32>>,
    /// How far beyond them the rounding to an entry of the transfer function's table may show a scalar.
    reach: f32,
}

impl Support {
    pub(crate) fn new(transfer: &TransferFunction) -> Self {
        let knots = transfer.opacity_knots();
        let visible = |i: usize| knots[i].opacity > 0.0;
        let at = |i: usize| knots[i].value as f32;
        let mut intervals = Vec::new();
        if visible(0) {
            intervals.push(f32::NEG_INFINITY..=at(0));
        }
        for i in 1..knots.len() {
            if visible(i - 1) || visible(i) {
                // A ramp that starts from 0 is visible only past its knot. Two knots at one scalar are a step: the
                // upper one holds from there on.
                let rises = !visible(i - 1) && at(i) > at(i - 1);
                let falls = !visible(i) && at(i) > at(i - 1);
                let low = if rises {
                    at(i - 1).next_up()
                } else {
                    at(i - 1)
                };
                let high = if falls { at(i).next_down() } else { at(i) };
                intervals.push(low..=high);
            }
        }
        if visible(knots.len() - 1) {
            intervals.push(at(knots.len() - 1)..=f32::INFINITY);
        }
        Self {
            intervals: joined(intervals),
            reach: 0.0,
        }
    }

    /// All scalars.
    pub(crate) fn everything() -> Self {
        Self {
            intervals: vec![f32::NEG_INFINITY..=f32::INFINITY],
            reach: 0.0,
        }
    }

    /// No scalar.
    pub(crate) fn nothing() -> Self {
        Self {
            intervals: Vec::new(),
            reach: 0.0,
        }
    }

    /// One scalar.
    pub(crate) fn of(value: f32) -> Self {
        Self {
            intervals: vec![value..=value],
            reach: 0.0,
        }
    }

    /// The support for a table whose entries are this far apart.
    pub(crate) fn tabulated(self, step: f32) -> Self {
        Self {
            reach: step,
            ..self
        }
    }

    /// Returns true if all scalars of another support are in this one.
    pub(crate) fn covers(&self, other: &Self) -> bool {
        let holds = |part: &RangeInclusive<f32>| {
            self.intervals
                .iter()
                .any(|whole| whole.start() <= part.start() && part.end() <= whole.end())
        };
        other.intervals.iter().all(holds)
    }

    /// Returns true if any scalar from `low` to `high` may be visible.
    #[inline(always)]
    pub(crate) fn meets(&self, low: f32, high: f32) -> bool {
        self.intervals
            .iter()
            .any(|s| high >= *s.start() && low <= *s.end())
    }

    /// Returns true if one interval holds all scalars from the least to the greatest.
    pub(crate) fn holds(&self, [least, greatest]: [f32; 2]) -> bool {
        self.intervals
            .iter()
            .any(|s| *s.start() <= least && greatest <= *s.end())
    }

    /// The cells of a table with this range that it meets, and those that it meets with its reach.
    pub(super) fn cells(&self, scalars: &Scalars, range: [f32; 2]) -> [ShownCells; 2] {
        if self.holds(range) {
            return [ShownCells::all(), ShownCells::all()];
        }
        let level = SimdLevel::Auto.resolve();
        dispatch!(level, simd => self.met_cells(scalars))
    }

    #[inline(always)]
    fn met_cells(&self, scalars: &Scalars) -> [ShownCells; 2] {
        let ranges = CellRanges::new(scalars);
        let (mut met, mut reached) = (ShownCells::none(), ShownCells::none());
        for interval in &self.intervals {
            let (start, end) = (*interval.start(), *interval.end());
            met = met.or(&ranges.select(|low, high| high >= start && low <= end));
            reached = reached
                .or(&ranges
                    .select(|low, high| high + self.reach >= start && low - self.reach <= end));
        }
        [met, reached]
    }
}

/// The same scalars in as few intervals as there can be: those that touch or overlap are one.
fn joined(mut intervals: Vec<RangeInclusive<f32>>) -> Vec<RangeInclusive<f32>> {
    intervals.retain(|interval| !interval.is_empty());
    intervals.sort_by(|a, b| a.start().total_cmp(b.start()));
    let mut joined: Vec<RangeInclusive<f32>> = Vec::new();
    for interval in intervals {
        match joined.last_mut() {
            Some(last) if *interval.start() <= last.end().next_up() => {
                *last = *last.start()..=last.end().max(*interval.end());
            }
            _ => joined.push(interval),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::look::transfer::{ColourKnot, OpacityKnot};

    fn support(knots: &[(f64, f64)]) -> Support {
        let colours = vec![ColourKnot {
            value: 0.0,
            rgb: [1.0; 3],
        }];
        let knots = knots
            .iter()
            .map(|&(value, opacity)| OpacityKnot { value, opacity })
            .collect();
        Support::new(&TransferFunction::new(colours, knots).expect("a valid function"))
    }

    #[test]
    fn a_support_covers_what_lies_inside_it() {
        let wide = support(&[(10.0, 0.0), (20.0, 1.0), (50.0, 0.5), (60.0, 0.0)]);
        let narrow = support(&[(15.0, 0.0), (30.0, 1.0), (60.0, 0.0)]);
        assert!(
            wide.covers(&narrow) && !narrow.covers(&wide),
            "one inside another"
        );
        assert!(
            wide.covers(&wide) && Support::everything().covers(&wide),
            "the same, and all"
        );
        let parts = support(&[
            (10.0, 0.0),
            (20.0, 1.0),
            (30.0, 0.0),
            (40.0, 0.0),
            (50.0, 1.0),
            (60.0, 0.0),
        ]);
        assert!(
            wide.covers(&parts) && !parts.covers(&wide),
            "a gap is not covered"
        );
        let open = support(&[(10.0, 0.0), (20.0, 1.0)]);
        assert!(open.covers(&wide) && !wide.covers(&open), "without end");
        assert!(
            narrow.covers(&support(&[(0.0, 0.0)])),
            "nothing is covered by anything"
        );
    }

    #[test]
    fn a_mean_shows_what_either_function_shows() {
        let colours = vec![ColourKnot {
            value: 0.0,
            rgb: [1.0; 3],
        }];
        let function = |knots: &[(f64, f64)]| {
            let knots = knots
                .iter()
                .map(|&(value, opacity)| OpacityKnot { value, opacity })
                .collect();
            TransferFunction::new(colours.clone(), knots).expect("a valid function")
        };
        let (a, b) = (
            function(&[(10.0, 0.0), (20.0, 0.4), (20.0, 0.0), (40.0, 0.0)]),
            function(&[(15.0, 0.0), (30.0, 0.1), (35.0, 0.0)]),
        );
        let kept = Support::new(&a.mixed(&b, 0.5));
        for share in [0.0, 0.1, 0.7, 1.0] {
            assert!(
                kept.covers(&Support::new(&a.mixed(&b, share))),
                "share {share}"
            );
        }
    }
}
