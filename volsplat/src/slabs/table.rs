//! Post-classification: the transfer function as a table over the scalars that it shows, and its integrals over the scalar: the mean colour
//! and extinction between two scalars, exactly.
//!
//! Along a short piece of a ray the scalar changes linearly, so that the mean of the extinction over the piece is the
//! integral of the extinction between the scalars at its ends, over their difference; colours weigh by extinction. Sums
//! from the least place of the table on give each integral in two look-ups, and no peak between the ends is missed.
//! The sums are whole numbers: their differences are exact, also those of faint scalars behind an opaque peak.
//! Source: K. Engel, M. Kraus, T. Ertl, "High-Quality Pre-Integrated Volume Rendering Using Hardware-Accelerated Pixel
//! Shading", Graphics Hardware 2001, which tabulates both scalars; here one is enough.
//! Limits: inside a piece, no part hides another: pieces must be short beside what the extinction lets through.

use std::sync::Arc;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, i32x8, i32x16, mask32x16};
use resample_core::OpacityMode;

use crate::look::transfer::TransferFunction;
use crate::look::transfer::classified;

/// Lanes of a vector: half a row of a tile. A brick covers about half the lanes of a whole row, and a gather into a
/// whole row would come back from memory in pieces that a wider load has to wait for.
pub(crate) const LANES: usize = 8;

/// A vector's place in a tile.
#[derive(Clone, Copy)]
pub(crate) struct HalfRow {
    pub(crate) row: usize,
    pub(crate) first: usize,
}

/// Codes of a whole integral: as many as leave room for the rounding of the parts.
const CODES: f64 = (1 << 30) as f64;

/// Least difference of two places: the integral over it is divided by it, and f32 counts places of the table to 5e-4.
const LEAST_SPAN: f32 = 1.0 / 64.0;

/// Prefix sums over the places of a table.
#[derive(Clone, Debug)]
pub(crate) struct TransferIntegrals {
    /// Extinction up to each place.
    strength: Box<[i32]>,
    /// Extinction times red, green, blue and the place over the number of places, up to each place.
    weighted: Box<[[i32; 4]]>,
    strength_unit: f32,
    weighted_unit: f32,
}

/// Places of scalars in the table, and the extinction up to them.
#[derive(Clone, Copy)]
pub(crate) struct Prefix<S: Simd> {
    /// Not bounded by the table.
    pub(crate) place: f32x8<S>,
    /// Whole places below, inside the table.
    index: [i32; LANES],
    /// Codes up to the whole place, those to the next whole place, and those to the place itself.
    code: i32x8<S>,
    rise: f32x8<S>,
    rest: f32x8<S>,
}

impl TransferIntegrals {
    /// The integrals of extinction times red, green and blue, and extinction, each the mean between two whole places.
    pub(crate) fn new(values: impl Iterator<Item = [f64; 4]>) -> Self {
        let values: Vec<[f64; 4]> = values.collect();
        let count = values.len() as f64;
        let parts = |place: usize, value: &[f64; 4]| {
            let [r, g, b, strength] = *value;
            [r, g, b, strength * (place as f64 + 0.5) / count]
        };
        let (mut strength_sum, mut sums) = (0.0, [0.0; 4]);
        for (place, value) in values.iter().enumerate() {
            strength_sum += value[3];
            for (sum, part) in sums.iter_mut().zip(parts(place, value)) {
                *sum += part;
            }
        }
        let unit = |whole: f64| whole.max(f64::MIN_POSITIVE) / CODES;
        let strength_unit = unit(strength_sum);
        let weighted_unit = unit(sums.into_iter().fold(0.0, f64::max));
        let (mut strength, mut weighted) = (vec![0], vec![[0; 4]]);
        let (mut strength_sum, mut sums) = (0.0, [0.0; 4]);
        for (place, value) in values.iter().enumerate() {
            strength_sum += value[3];
            strength.push((strength_sum / strength_unit).round() as i32);
            for (sum, part) in sums.iter_mut().zip(parts(place, value)) {
                *sum += part;
            }
            weighted.push(sums.map(|sum| (sum / weighted_unit).round() as i32));
        }
        Self {
            strength: strength.into(),
            weighted: weighted.into(),
            strength_unit: strength_unit as f32,
            weighted_unit: weighted_unit as f32,
        }
    }

    /// The extinction up to places.
    #[inline(always)]
    pub(crate) fn up_to<S: Simd>(&self, simd: S, place: f32x8<S>) -> Prefix<S> {
        let constant = |v: f32| f32x8::splat(simd, v);
        let last = self.strength.len() - 2;
        let inside = place.max(constant(0.0)).min(constant((last + 1) as f32));
        let whole = inside.min(constant(last as f32)).trunc();
        let index = whole.to_int::<i32x8<S>>().to_array();
        let (mut below, mut above) = ([0; LANES], [0; LANES]);
        for lane in 0..LANES {
            let at = (index[lane] as usize).min(last);
            below[lane] = self.strength[at];
            above[lane] = self.strength[at + 1];
        }
        let code = i32x8::from_slice(simd, &below);
        let rise = (i32x8::from_slice(simd, &above) - code).to_float::<f32x8<S>>();
        Prefix {
            place,
            index,
            code,
            rise,
            rest: rise * (inside - whole),
        }
    }

    /// Returns true if any place between two lies in the table.
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(&self, simd: S, from: f32x16<S>, to: f32x16<S>) -> mask32x16<S> {
        let end = f32x16::splat(simd, (self.strength.len() - 1) as f32);
        from.max(to).simd_ge(f32x16::splat(simd, 0.0)) & from.min(to).simd_le(end)
    }

    /// The mean extinction between two scalars.
    #[inline(always)]
    pub(crate) fn mean<S: Simd>(&self, simd: S, from: &Prefix<S>, to: &Prefix<S>) -> f32x8<S> {
        let constant = |v: f32| f32x8::splat(simd, v);
        let span = to.place - from.place;
        let codes = (to.code - from.code).to_float::<f32x8<S>>() + (to.rest - from.rest);
        let tiny = span.abs().simd_lt(constant(LEAST_SPAN));
        let mean = tiny.select(to.rise, codes / tiny.select(constant(1.0), span));
        mean.max(constant(0.0)) * constant(self.strength_unit)
    }

    /// Mean red, green and blue between two scalars, weighted by extinction, and the mean place. `mean` is the mean
    /// extinction of the lane, above 0.
    #[inline(always)]
    pub(crate) fn mean_colour<S: Simd>(
        &self,
        from: &Prefix<S>,
        to: &Prefix<S>,
        lane: usize,
        mean: f32,
    ) -> [f32; 4] {
        let last = self.weighted.len() - 2;
        let places = [from.place.to_array()[lane], to.place.to_array()[lane]];
        let [first, end] = [from.index[lane], to.index[lane]].map(|i| (i as usize).min(last));
        let [low, low_next] = [self.weighted[first], self.weighted[first + 1]];
        let [high, high_next] = [self.weighted[end], self.weighted[end + 1]];
        let span = places[1] - places[0];
        let is_tiny = span.abs() < LEAST_SPAN;
        let inside = |place: f32, index: usize| place.clamp(0.0, (last + 1) as f32) - index as f32;
        let (before, after) = (inside(places[0], first), inside(places[1], end));
        let scale = self.weighted_unit / mean / if is_tiny { 1.0 } else { span };
        let mut colour = [0.0; 4];
        for k in 0..4 {
            let rise = (high_next[k] - high[k]) as f32;
            let between =
                (high[k] - low[k]) as f32 + after * rise - before * (low_next[k] - low[k]) as f32;
            colour[k] = if is_tiny { rise } else { between } * scale;
        }
        colour[3] *= (last + 1) as f32;
        colour
    }
}

/// Entries over the visible scalars; a scalar takes the nearest. For 8-bit data that moves it by at most 1/32 of a
/// step, and the table (64 kB) stays in the second-level cache.
const ENTRIES: usize = 4096;

/// Places in the table: the entries, one below and one above, up to a power of two, so that a masked place needs no
/// further check.
pub(crate) const PLACES: usize = 2 * ENTRIES;

/// Part of the volume's range that a scalar typically moves by between two samples at an edge: an edge of two voxels in
/// four samples, and edges of a quarter of the range. A guess; with half and twice as much the same scenes have peaks.
const PEAK_REACH: f64 = 1.0 / 16.0;

/// Extinction per voxel by which a peak stands out: missed or met by a sample half a voxel long, it changes an opacity by
/// a fifth.
const PEAK_STRENGTH: f64 = 0.5;

/// Scalars at which a place of the integrals is evaluated.
const PARTS: usize = 4;

/// Colour and strength by scalar.
#[derive(Clone, Debug)]
pub(crate) struct TransferTable {
    entries: Box<[[f32; 4]; PLACES]>,
    /// The strengths of the entries.
    strengths: Box<[f32; PLACES]>,
    /// A scalar's place is itself times the scale plus the shift, rounded down.
    scale: f32,
    shift: f32,
    /// Where narrow peaks are to be integrated between samples.
    integrals: Option<Arc<TransferIntegrals>>,
}

impl TransferTable {
    /// Tabulates `transfer` over its visible scalars inside `range`, the scalars of the volume.
    pub(crate) fn new(
        transfer: &TransferFunction,
        opacity: OpacityMode,
        range: (f64, f64),
    ) -> Self {
        let shown = shown_of(transfer, range);
        let low = shown.0.max(range.0);
        let step = Self::step(transfer, range);
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
        let reach = ((range.1 - range.0) * PEAK_REACH / step).max(1.0);
        let beyond = [entries[0][3], entries[ENTRIES + 1][3]];
        let integrals = has_peaks(&entries[1..=ENTRIES], beyond, reach)
            .then(|| Arc::new(integrals(transfer, opacity, low, step)));
        Self {
            strengths: strengths(&entries),
            entries,
            scale: (1.0 / step) as f32,
            shift: (1.5 - low / step) as f32,
            integrals,
        }
    }

    /// How far apart the scalars of the entries are, of the table that [`TransferTable::new`] gives.
    pub(crate) fn step(transfer: &TransferFunction, range: (f64, f64)) -> f64 {
        let shown = shown_of(transfer, range);
        let (low, high) = (shown.0.max(range.0), shown.1.min(range.1));
        // One visible scalar, or none: the span only has to be above 0.
        let span = if high > low {
            high - low
        } else {
            low.abs().max(1.0) * f64::from(f32::EPSILON)
        };
        span / (ENTRIES - 1) as f64
    }

    /// How far apart the scalars of the entries are.
    pub(crate) fn step_of_entries(&self) -> f32 {
        1.0 / self.scale
    }

    /// A table in which the scalar i, a whole number from 0 on, stands for entry i; at most as many as it has places for.
    pub(crate) fn of_entries(listed: &[[f32; 4]]) -> Self {
        let mut entries = Box::new([[0.0; 4]; PLACES]);
        for (entry, listed) in entries[1..=ENTRIES + 1].iter_mut().zip(listed) {
            *entry = *listed;
        }
        // Places are rounded down: half a place more keeps whole numbers off the edge.
        Self {
            strengths: strengths(&entries),
            entries,
            scale: 1.0,
            shift: 1.5,
            integrals: None,
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

    /// The integrals of a function with narrow peaks.
    pub(crate) fn integrals(&self) -> Option<&TransferIntegrals> {
        self.integrals.as_deref()
    }

    /// Where scalars lie in the table and beyond its ends.
    #[inline(always)]
    pub(crate) fn unbounded_place<S: Simd>(&self, simd: S, values: f32x16<S>) -> f32x16<S> {
        let constant = |v: f32| f32x16::splat(simd, v);
        values.mul_add(constant(self.scale), constant(self.shift))
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

    /// As [`TransferTable::places`], of twice as many.
    #[inline(always)]
    pub(crate) fn places16<S: Simd>(&self, simd: S, values: f32x16<S>) -> i32x16<S> {
        let constant = |v: f32| f32x16::splat(simd, v);
        let place = values.mul_add(constant(self.scale), constant(self.shift));
        place
            .max(constant(0.0))
            .min(constant((ENTRIES + 1) as f32))
            .to_int()
    }

    /// The strength of each place.
    pub(crate) fn strengths(&self) -> &[f32] {
        &self.strengths[..ENTRIES + 2]
    }

    /// A scalar's place is itself times the first, plus the second.
    pub(crate) fn place_of_scalar(&self) -> [f32; 2] {
        [self.scale, self.shift]
    }

    /// The strength at a place.
    #[inline(always)]
    pub(crate) fn strength(&self, place: i32) -> f32 {
        self.strengths[place as usize & (PLACES - 1)]
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

/// The strengths of entries, side by side.
fn strengths(entries: &[[f32; 4]; PLACES]) -> Box<[f32; PLACES]> {
    let mut strengths = Box::new([0.0; PLACES]);
    for (strength, entry) in strengths.iter_mut().zip(entries) {
        *strength = entry[3];
    }
    strengths
}

/// The scalars that are seen. A transfer function that shows nothing leaves no voxel, so that its table is never asked.
fn shown_of(transfer: &TransferFunction, range: (f64, f64)) -> (f64, f64) {
    transfer.visible_range().unwrap_or(range)
}

/// Returns true if the extinction has a peak that samples half a voxel apart would miss: somewhere it stands above its means over
/// the reach on either side. `beyond` is the extinction before the table and behind it.
fn has_peaks(entries: &[[f32; 4]], beyond: [f32; 2], reach: f64) -> bool {
    let mut sums = vec![0.0];
    for (place, entry) in entries.iter().enumerate() {
        sums.push(sums[place] + f64::from(entry[3]));
    }
    let end = entries.len() as f64;
    let up_to = |place: f64| {
        let outside =
            place.min(0.0) * f64::from(beyond[0]) + (place - end).max(0.0) * f64::from(beyond[1]);
        sums[place.clamp(0.0, end) as usize] + outside
    };
    entries.iter().enumerate().any(|(place, entry)| {
        let at = place as f64 + 0.5;
        let below = (up_to(at) - up_to(at - reach)) / reach;
        let above = (up_to(at + reach) - up_to(at)) / reach;
        f64::from(entry[3]) - below.max(above) > PEAK_STRENGTH
    })
}

/// The integrals of a function over the places of its table, from scalars a part of a place apart.
fn integrals(
    transfer: &TransferFunction,
    opacity: OpacityMode,
    low: f64,
    step: f64,
) -> TransferIntegrals {
    let part_of = |place: usize| {
        let mut mean = [0.0; 4];
        for part in 0..PARTS {
            // Place 1.5 is the least scalar.
            let place = place as f64 + (part as f64 + 0.5) / PARTS as f64 - 1.5;
            let [r, g, b, strength] =
                classified(transfer, opacity, low + place * step).map(f64::from);
            for (mean, value) in
                mean.iter_mut()
                    .zip([r * strength, g * strength, b * strength, strength])
            {
                *mean += value / PARTS as f64;
            }
        }
        mean
    };
    TransferIntegrals::new((0..ENTRIES + 2).map(part_of))
}

#[cfg(test)]
mod tests {
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    use super::*;
    use crate::look::transfer::{ColourKnot, OpacityKnot};

    /// A peak over places 8..24 of 64: red rises, extinction is 2.
    fn peak() -> TransferIntegrals {
        TransferIntegrals::new((0..64).map(|place| {
            let strength = if (8..24).contains(&place) { 2.0 } else { 0.0 };
            let red = (f64::from(place) + 0.5 - 8.0) / 16.0;
            [red * strength, 0.5 * strength, 0.0, strength]
        }))
    }

    /// Mean extinction, colour and place between two places.
    fn mean(from: f32, to: f32) -> (f32, [f32; 4]) {
        let integrals = peak();
        dispatch!(SimdLevel::Auto.resolve(), simd => {
            let at = |place: f32| integrals.up_to(simd, f32x8::splat(simd, place));
            let (from, to) = (at(from), at(to));
            let mean = integrals.mean(simd, &from, &to).to_array()[3];
            (mean, integrals.mean_colour(&from, &to, 3, mean.max(1e-6)))
        })
    }

    #[test]
    fn no_part_of_a_peak_is_missed() {
        for (from, to) in [(0.0, 64.0), (64.0, 0.0), (-200.0, 120.0), (1e4, -1e4)] {
            let (strength, colour) = mean(from, to);
            let wanted = 2.0 * 16.0 / (to - from).abs();
            assert!((strength - wanted).abs() < 1e-4 * wanted, "{from}..{to}");
            assert!((colour[0] - 0.5).abs() < 1e-4, "{from}..{to}: {colour:?}");
            assert!((colour[3] - 16.0).abs() < 1e-2, "{from}..{to}: {colour:?}");
        }
        assert_eq!(mean(-5.0, 8.0).0, 0.0);
        assert_eq!(mean(24.0, 90.0).0, 0.0);
    }

    #[test]
    fn between_scalars_that_are_nearly_the_same_it_is_the_function() {
        for apart in [0.0, 1e-3, 0.1, 1.0] {
            let (strength, colour) = mean(12.25, 12.25 + apart);
            assert!((strength - 2.0).abs() < 1e-3, "{apart}: {strength}");
            assert!((colour[1] - 0.5).abs() < 1e-3, "{apart}: {colour:?}");
        }
    }

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

    #[test]
    fn narrow_peaks_are_integrated_and_ramps_are_not() {
        let engine = [
            (70.0, 0.0),
            (110.0, 0.05),
            (150.0, 0.08),
            (200.0, 0.4),
            (255.0, 0.7),
        ];
        let step = [(71.0, 0.0), (71.0, 1.0), (255.0, 1.0)];
        let wide = [(50.0, 0.0), (100.0, 0.9), (150.0, 0.0)];
        for knots in [engine.as_slice(), &step, &wide] {
            assert!(
                table(knots, (0.0, 255.0)).integrals().is_none(),
                "{knots:?}"
            );
        }
        let shell = [(97.0, 0.0), (99.5, 0.95), (102.0, 0.0)];
        for range in [(0.0, 255.0), (90.0, 255.0)] {
            assert!(table(&shell, range).integrals().is_some(), "{range:?}");
        }
        // As a part of this range it is wide, and samples meet it.
        assert!(table(&shell, (95.0, 105.0)).integrals().is_none());
    }
}
