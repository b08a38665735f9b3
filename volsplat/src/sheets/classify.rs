//! Post-classification: the transfer function as a table over the scalars where it is not transparent.

use resample_core::OpacityMode;

use crate::sample::classified;
use crate::transfer::TransferFunction;

/// Entries over the visible scalars. Between entries the function is linear, which a piecewise-linear function is
/// anyway but at its knots: a knot is blurred over 1/4096 of the visible range. 64 kB: second-level cache.
const ENTRIES: usize = 4096;

/// Colour and strength by scalar.
#[derive(Clone, Debug)]
pub(crate) struct TransferTable {
    entries: Vec<[f32; 4]>,
    low: f32,
    entries_per_value: f32,
    /// Scalars outside these are transparent; an end is infinite where the volume ends before the function does.
    visible: [f32; 2],
}

impl TransferTable {
    /// Tabulates `transfer` over its visible scalars inside `range`, the scalars of the volume.
    pub(crate) fn new(transfer: &TransferFunction, opacity: OpacityMode, range: (f64, f64)) -> Self {
        // A transfer function that shows nothing leaves no voxel, so that its table is never asked.
        let shown = transfer.visible_range().unwrap_or(range);
        let (low, high) = (shown.0.max(range.0), shown.1.min(range.1));
        // One visible scalar, or none: the span only has to be above 0.
        let span = if high > low { high - low } else { low.abs().max(1.0) * f64::from(f32::EPSILON) };
        let entry = |i: usize| classified(transfer, opacity, low + span * i as f64 / ENTRIES as f64);
        Self {
            entries: (0..=ENTRIES + 1).map(entry).collect(),
            low: low as f32,
            entries_per_value: (ENTRIES as f64 / span) as f32,
            visible: [
                if shown.0 > range.0 { shown.0 as f32 } else { f32::NEG_INFINITY },
                if shown.1 < range.1 { shown.1 as f32 } else { f32::INFINITY },
            ],
        }
    }

    /// Linear red, green, blue and strength of a scalar.
    #[inline(always)]
    pub(crate) fn at(&self, value: f32) -> [f32; 4] {
        if !(value >= self.visible[0] && value <= self.visible[1]) {
            return [0.0; 4];
        }
        let position = ((value - self.low) * self.entries_per_value).clamp(0.0, ENTRIES as f32);
        let index = position as usize;
        let share = position - index as f32;
        let (below, above) = (self.entries[index], self.entries[index + 1]);
        std::array::from_fn(|k| below[k] + share * (above[k] - below[k]))
    }
}
