//! Post-classification: the transfer function as a table over the scalars that it shows.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};
use resample_core::OpacityMode;

use crate::transfer::TransferFunction;
use crate::transfer::strength::classified;

/// Entries over the visible scalars; a scalar takes the nearest. For 8-bit data that moves it by at most 1/32 of a
/// step, and the table (64 kB) stays in the second-level cache.
const ENTRIES: usize = 4096;

/// Places in the table: the entries, one below and one above, up to a power of two, so that a masked place needs no
/// further check.
const PLACES: usize = 2 * ENTRIES;

/// Colour and strength by scalar.
#[derive(Clone, Debug)]
pub(crate) struct TransferTable {
    entries: Box<[[f32; 4]; PLACES]>,
    /// A scalar's place is itself times the scale plus the shift, rounded down.
    scale: f32,
    shift: f32,
}

impl TransferTable {
    /// Tabulates `transfer` over its visible scalars inside `range`, the scalars of the volume.
    pub(crate) fn new(
        transfer: &TransferFunction,
        opacity: OpacityMode,
        range: (f64, f64),
    ) -> Self {
        // A transfer function that shows nothing leaves no voxel, so that its table is never asked.
        let shown = transfer.visible_range().unwrap_or(range);
        let (low, high) = (shown.0.max(range.0), shown.1.min(range.1));
        // One visible scalar, or none: the span only has to be above 0.
        let span = if high > low {
            high - low
        } else {
            low.abs().max(1.0) * f64::from(f32::EPSILON)
        };
        let step = span / (ENTRIES - 1) as f64;
        let mut entries = Box::new([[0.0; 4]; PLACES]);
        for i in 0..ENTRIES {
            entries[i + 1] = classified(transfer, opacity, low + i as f64 * step);
        }
        // Scalars outside are transparent, but where the volume ends before the function does, what rounding puts
        // outside is what lies at the end.
        if shown.0 <= range.0 {
            entries[0] = entries[1];
        }
        if shown.1 >= range.1 {
            entries[ENTRIES + 1] = entries[ENTRIES];
        }
        Self {
            entries,
            scale: (1.0 / step) as f32,
            shift: (1.5 - low / step) as f32,
        }
    }

    /// A table in which the scalar i, a whole number from 0 on, stands for entry i; at most as many as it has places for.
    pub(crate) fn of_entries(listed: &[[f32; 4]]) -> Self {
        let mut entries = Box::new([[0.0; 4]; PLACES]);
        for (entry, listed) in entries[1..=ENTRIES + 1].iter_mut().zip(listed) {
            *entry = *listed;
        }
        // Places are rounded down: half a place more keeps whole numbers off the edge.
        Self {
            entries,
            scale: 1.0,
            shift: 1.5,
        }
    }

    /// Colour and strength of these scalars, where they are the same for all from the least to the greatest.
    pub(crate) fn constant_over(&self, [least, greatest]: [f32; 2]) -> Option<[f32; 4]> {
        let (first, last) = (self.place(least), self.place(greatest));
        let entry = self.entry(first);
        (first..=last)
            .all(|place| self.entry(place) == entry)
            .then_some(entry)
    }

    /// The places of scalars.
    #[inline(always)]
    pub(crate) fn places<S: Simd>(&self, simd: S, values: f32x8<S>) -> i32x8<S> {
        let constant = |v: f32| f32x8::splat(simd, v);
        let place = values.mul_add(constant(self.scale), constant(self.shift));
        place
            .max(constant(0.0))
            .min(constant((ENTRIES + 1) as f32))
            .to_int()
    }

    /// Linear red, green, blue and strength at a place.
    #[inline(always)]
    pub(crate) fn entry(&self, place: i32) -> [f32; 4] {
        self.entries[place as usize & (PLACES - 1)]
    }

    /// Linear red, green, blue and strength of a scalar.
    #[inline(always)]
    pub(crate) fn at(&self, value: f32) -> [f32; 4] {
        self.entry(self.place(value))
    }

    /// The place of one scalar.
    #[inline(always)]
    fn place(&self, value: f32) -> i32 {
        (value * self.scale + self.shift).clamp(0.0, (ENTRIES + 1) as f32) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::{ColourKnot, OpacityKnot};

    fn table(opacities: &[(f64, f64)], range: (f64, f64)) -> TransferTable {
        let colours = vec![ColourKnot {
            value: 0.0,
            rgb: [1.0, 0.5, 0.25],
        }];
        let knots = opacities
            .iter()
            .map(|&(value, opacity)| OpacityKnot { value, opacity })
            .collect();
        let transfer = TransferFunction::new(colours, knots).expect("valid");
        TransferTable::new(&transfer, OpacityMode::Linear, range)
    }

    #[test]
    fn a_ramp_is_the_ramp_to_half_an_entry() {
        let table = table(&[(70.0, 0.0), (110.0, 0.5), (255.0, 0.5)], (0.0, 255.0));
        for i in 0..2550 {
            let value = i as f32 * 0.1;
            let expected = if value <= 70.0 {
                0.0
            } else {
                ((value - 70.0) / 40.0 * 0.5).min(0.5)
            };
            let got = table.at(value)[3];
            assert!(
                (got - expected).abs() < 0.5 / 40.0 * 0.5 * 185.0 / 4095.0 + 1e-6,
                "{value}: {got} {expected}"
            );
        }
    }

    #[test]
    fn outside_is_transparent_but_the_ends_of_the_volume_hold() {
        let band = table(
            &[(100.0, 0.0), (100.0, 0.3), (200.0, 0.3), (200.0, 0.0)],
            (0.0, 255.0),
        );
        assert_eq!(band.at(99.9)[3], 0.0, "below a step");
        assert!((band.at(150.0)[3] - 0.3).abs() < 1e-6, "inside");
        assert_eq!(band.at(200.1)[3], 0.0, "above a step");
        let all = table(&[(0.0, 0.7), (255.0, 0.7)], (10.0, 20.0));
        assert!((all.at(9.9999)[3] - 0.7).abs() < 1e-6 && (all.at(20.0001)[3] - 0.7).abs() < 1e-6);
    }

    #[test]
    fn one_visible_scalar_is_enough() {
        let table = table(&[(5.0, 0.4)], (5.0, 5.0));
        assert!((table.at(5.0)[3] - 0.4).abs() < 1e-6);
    }
}
