//! Integrals of a transfer function over the scalar: the mean colour and extinction between two scalars, exactly.
//!
//! Along a short piece of a ray the scalar changes linearly, so that the mean of the extinction over the piece is the
//! integral of the extinction between the scalars at its ends, over their difference; colours weigh by extinction. Sums
//! from the least place of the table on give each integral in two look-ups, and no peak between the ends is missed.
//! The sums are whole numbers: their differences are exact, also those of faint scalars behind an opaque peak.
//! Source: K. Engel, M. Kraus, T. Ertl, "High-Quality Pre-Integrated Volume Rendering Using Hardware-Accelerated Pixel
//! Shading", Graphics Hardware 2001, which tabulates both scalars; here one is enough.
//! Limits: inside a piece, no part hides another: pieces must be short beside what the extinction lets through.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, i32x8, mask32x16};

use super::lanes::LANES;

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

#[cfg(test)]
mod tests {
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    use super::*;

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
}
