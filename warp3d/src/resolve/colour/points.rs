//! Cubic lookups at the five points of eight filters at once.
//!
//! A Gaussian whose variance is below a sample's spacing is a sum over three points along each of its axes (the rule of
//! Gauss and Hermite). Places and weights of eight filters are found together; the samples are then summed filter by
//! filter, which is all that is left to do for each of them.
//!
//! Limits: variances up to [`SAMPLED_VARIANCE`] along both axes.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16, f64x8, i32x8};
use resample_core::point::PIXEL_SIGMA_PX;

use super::cubic::{EightWeights, Taps, Weights, across, by_place};
use super::{Colours, LEAST_VARIANCE, Lookup, NOWHERE, SAMPLED_VARIANCE, eight_samples};
use crate::project::narrow;
use crate::surfaces::surface::Surfaces;

/// Filters that are prepared at once.
pub(crate) const FILTERS: usize = 8;

/// Points of one filter: its middle, two along its longer axis, two along the other.
const POINTS: usize = 5;

/// Steps to the points, along and across.
const STEPS: [[f64; 2]; POINTS] = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];

/// Where eight filters look samples up, and with which weights.
pub(crate) struct EightFilters {
    points: [EightPoints; POINTS],
    /// The filters that are so wide across that all five points count, one bit each; of others three.
    wide_across: u64,
}

/// One point of eight filters.
#[derive(Clone, Copy)]
struct EightPoints {
    /// The sample above and to the left: its number, its column and its row.
    sample: [u32; FILTERS],
    base: [[i32; FILTERS]; 2],
    /// Weights of the samples around, those along x times the weight of the point.
    taps: [Taps; FILTERS],
}

/// Variance of a filter along an axis that is minified so many times, squared, px^2.
#[inline(always)]
fn variance<S: Simd>(simd: S, minification2: f64x8<S>) -> f64x8<S> {
    let constant = |v: f64| f64x8::splat(simd, v);
    let sigma2 = constant(PIXEL_SIGMA_PX * PIXEL_SIGMA_PX);
    (sigma2 * (minification2 - constant(1.0))).max(constant(0.0))
}

impl EightFilters {
    /// Filters that look nothing up.
    pub(crate) const NONE: Self = Self {
        points: [EightPoints::NOWHERE; POINTS],
        wide_across: 0,
    };

    /// Returns true if a filter so much minified along its longer axis, squared, is small enough.
    #[inline(always)]
    pub(crate) fn can_hold(minification2: f32) -> bool {
        PIXEL_SIGMA_PX * PIXEL_SIGMA_PX * (f64::from(minification2) - 1.0) < SAMPLED_VARIANCE
    }

    /// Becomes the filters around `at` (reference px) whose longer axes are `along`, unit vectors, with these minifications
    /// along and across them, squared, in a picture of `size`.
    #[inline(always)]
    pub(crate) fn prepare<S: Simd>(
        &mut self,
        simd: S,
        at: [f64x8<S>; 2],
        (along, minification2): ([f64x8<S>; 2], [f64x8<S>; 2]),
        size: [usize; 2],
    ) {
        let constant = |v: f64| f64x8::splat(simd, v);
        let large = variance(simd, minification2[0]);
        let small = variance(simd, minification2[1]);
        self.wide_across = small.simd_gt(constant(LEAST_VARIANCE)).to_bitmask();
        let step_along = (constant(3.0) * large).sqrt();
        let step_across = (constant(3.0) * small).sqrt();
        // The other axis is the first one turned by a right angle.
        let steps = [
            [step_along * along[0], step_along * along[1]],
            [-(step_across * along[1]), step_across * along[0]],
        ];
        let count = if self.wide_across == 0 { 3 } else { POINTS };
        for (k, step) in STEPS.iter().enumerate().take(count) {
            let (by_along, by_across) = (constant(step[0]), constant(step[1]));
            let at = [
                at[0] + by_along * steps[0][0] + by_across * steps[1][0],
                at[1] + by_along * steps[0][1] + by_across * steps[1][1],
            ];
            let mut weights = [0.0; FILTERS];
            for (lane, weight) in weights.iter_mut().enumerate() {
                *weight = self.weight(k, lane);
            }
            self.points[k].prepare(simd, at, f32x8::simd_from(simd, weights), size);
        }
    }

    /// Number of points of one of the filters.
    #[inline(always)]
    fn count(&self, lane: usize) -> usize {
        if self.wide_across >> lane & 1 != 0 {
            POINTS
        } else {
            3
        }
    }

    /// The weight of the `k`-th point of one of the filters.
    #[inline(always)]
    fn weight(&self, k: usize, lane: usize) -> f32 {
        match (k, self.count(lane)) {
            (0, 3) => 2.0 / 3.0,
            (0, _) => 1.0 / 3.0,
            _ => 1.0 / 6.0,
        }
    }
}

impl EightPoints {
    const NOWHERE: Self = Self {
        sample: [NOWHERE; FILTERS],
        base: [[0; FILTERS]; 2],
        taps: [[0.0; 8]; FILTERS],
    };

    #[inline(always)]
    fn prepare<S: Simd>(&mut self, simd: S, at: [f64x8<S>; 2], weight: f32x8<S>, size: [usize; 2]) {
        let mut rows = [weight; 8];
        let mut bases = [i32x8::splat(simd, 0); 2];
        for (axis, at) in at.into_iter().enumerate() {
            let corner = at - f64x8::splat(simd, 0.5);
            // A place that rounding has put just before a sample is at it.
            let base = (corner + f64x8::splat(simd, 1e-6)).floor();
            let past = narrow(corner - base).max(f32x8::splat(simd, 0.0));
            bases[axis] = narrow(base).to_int();
            bases[axis].store_slice(&mut self.base[axis]);
            rows[4 * axis..4 * axis + 4].copy_from_slice(&EightWeights::new(simd, past).value);
        }
        for along_x in &mut rows[..4] {
            *along_x *= weight;
        }
        for (to, taps) in self.taps.iter_mut().zip(by_place(rows)) {
            taps.store_slice(to);
        }
        eight_samples(simd, bases, size).store_slice(&mut self.sample);
    }
}

/// The colour through one of eight filters; `lookup` is asked for where a cut is near.
#[inline(always)]
pub(crate) fn through<'a, S: Simd>(
    simd: S,
    (filters, lane): (&EightFilters, usize),
    (colours, surfaces): (&Colours, &Surfaces),
    lookup: impl Fn() -> Lookup<'a>,
) -> f32x4<S> {
    let width = surfaces.size[0];
    // Places with no cut around are summed by columns, and the columns once.
    let (mut columns, mut sum) = (f32x16::splat(simd, 0.0), f32x4::splat(simd, 0.0));
    for (k, point) in filters.points[..filters.count(lane)].iter().enumerate() {
        let (sample, taps) = (point.sample[lane], &point.taps[lane]);
        if Lookup::is_clear(surfaces, sample) {
            let weights = Weights { taps, turned: None };
            let first = sample as usize - width - 1;
            columns += weights.columns(simd, &colours.coefficients, first, width);
        } else {
            let base = [0, 1].map(|axis| f64::from(point.base[axis][lane]));
            // Samples that are continued are not of the point's weight.
            let weight = filters.weight(k, lane);
            let mut taps = *taps;
            for along_x in &mut taps[..4] {
                *along_x *= 1.0 / weight;
            }
            let value = lookup().cubic_at_rim(simd, base.into(), &taps);
            sum = value.mul_add(f32x4::splat(simd, weight), sum);
        }
    }
    sum + across(columns)
}
