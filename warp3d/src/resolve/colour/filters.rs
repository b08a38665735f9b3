//! Colours over a footprint: a rule of five points where it is small, else a sum along a line or over an ellipse of samples.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16, f64x8, i32x8};
use glam::DVec2;
use resample_core::point::PIXEL_SIGMA_PX;

use crate::project::narrow;
use crate::resolve::colour::cubic::{EightWeights, Taps, Weights, across, by_place};
use crate::resolve::colour::{
    Colours, Footprint, LEAST_VARIANCE, Lookup, NOWHERE, SAMPLED_VARIANCE, eight_samples,
};
use crate::surfaces::surface::{RECOLOURED, Surfaces};

// Cubic lookups at the five points of eight filters at once.
//
// A Gaussian whose variance is below a sample's spacing is a sum over three points along each of its axes (the rule of
// Gauss and Hermite). Places and weights of eight filters are found together; the samples are then summed filter by
// filter, which is all that is left to do for each of them.
//
// Limits: variances up to [`SAMPLED_VARIANCE`] along both axes.

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

// Colours over a footprint of several samples: a Gaussian sum along a line of cubic lookups, or over an ellipse of samples.
//
// Along a row of samples a Gaussian's weight changes by a factor that itself changes by a constant factor, so that a
// sample costs two multiplications and no exponential.

/// Gaussians are cut at this many sigmas; the rest is normalised.
const REACH_SIGMAS: f64 = 3.0;

/// The share of a two-dimensional Gaussian's variance that cutting removes, q exp(-q) / (1 - exp(-q)) with
/// q = REACH_SIGMAS^2 / 2, given back by widening it before.
const CUT_WIDENS_ELLIPSE: f64 = 1.0 / (1.0 - 0.050_6);

/// The same in one dimension: 2 t phi(t) / (2 Phi(t) - 1) with t = REACH_SIGMAS.
const CUT_WIDENS_LINE: f64 = 1.0 / (1.0 - 0.026_7);

/// exp(-(a x^2 + 2 b x + c) / 2) along the samples of a row.
struct Row {
    columns: std::ops::Range<usize>,
    weight: f64,
    factor: f64,
    factor_of_factor: f64,
}

/// The inverse covariance of an ellipse around a place.
struct Ellipse {
    xx: f64,
    xy: f64,
    yy: f64,
    /// Reach along y, and the covariance's xx.
    reach_y: f64,
    covariance_xx: f64,
}

impl Ellipse {
    fn new(footprint: &Footprint) -> Self {
        let [large, small] = footprint
            .variance
            .map(|v| CUT_WIDENS_ELLIPSE * v.max(SAMPLED_VARIANCE));
        let (e, f) = (footprint.along, footprint.across);
        let xx = large * e.x * e.x + small * f.x * f.x;
        let xy = large * e.x * e.y + small * f.x * f.y;
        let yy = large * e.y * e.y + small * f.y * f.y;
        let scale = 1.0 / (large * small);
        Self {
            xx: yy * scale,
            xy: -xy * scale,
            yy: xx * scale,
            reach_y: REACH_SIGMAS * yy.sqrt(),
            covariance_xx: xx,
        }
    }

    /// The reach along x, at most, samples.
    fn reach(&self) -> f64 {
        self.reach_y.max(REACH_SIGMAS * self.covariance_xx.sqrt())
    }

    /// The part of a row `dy` from the middle that lies in the ellipse. `x` is the middle, in samples.
    fn row(&self, x: f64, dy: f64, width: usize) -> Option<Row> {
        // xx dx^2 + 2 xy dx dy + yy dy^2 <= REACH^2, as a square around its middle.
        let middle = -self.xy * dy / self.xx;
        let rest = REACH_SIGMAS * REACH_SIGMAS - (self.yy - self.xy * self.xy / self.xx) * dy * dy;
        let half = (rest.max(0.0) / self.xx).sqrt();
        let first = (x + middle - half).ceil().max(0.0);
        let last = (x + middle + half).floor().min(width as f64 - 1.0);
        if rest < 0.0 || first > last {
            return None;
        }
        let dx = first - x;
        let exponent = self.xx * dx * dx + 2.0 * self.xy * dx * dy + self.yy * dy * dy;
        Some(Row {
            columns: first as usize..last as usize + 1,
            weight: (-0.5 * exponent).exp(),
            factor: (-0.5 * (self.xx * (2.0 * dx + 1.0) + 2.0 * self.xy * dy)).exp(),
            factor_of_factor: (-self.xx).exp(),
        })
    }
}

impl Lookup<'_> {
    /// A Gaussian along one direction, of cubic lookups.
    #[inline(always)]
    pub(crate) fn line<S: Simd>(
        &self,
        simd: S,
        at: DVec2,
        along: DVec2,
        variance: f64,
    ) -> f32x4<S> {
        let step = (3.0 * SAMPLED_VARIANCE).sqrt();
        let variance = CUT_WIDENS_LINE * variance;
        let count = (REACH_SIGMAS * variance.sqrt() / step).floor() as i32;
        let mut sum = f32x4::splat(simd, 0.0);
        let mut total = 0.0;
        for i in -count..=count {
            let weight = (-0.5 * (f64::from(i) * step).powi(2) / variance).exp() as f32;
            let value = self.cubic(simd, at + f64::from(i) * step * along);
            sum = value.mul_add(f32x4::splat(simd, weight), sum);
            total += weight;
        }
        sum * f32x4::splat(simd, 1.0 / total)
    }

    /// A Gaussian sum over the samples.
    #[inline(always)]
    pub(crate) fn ellipse<S: Simd>(&self, simd: S, at: DVec2, footprint: &Footprint) -> f32x4<S> {
        let ellipse = Ellipse::new(footprint);
        let [width, height] = self.surfaces.size;
        let middle = at - 0.5;
        let first = (middle.y - ellipse.reach_y).ceil().max(0.0);
        let last = (middle.y + ellipse.reach_y)
            .floor()
            .min(height as f64 - 1.0);
        let clear = self.clear_around(at, ellipse.reach().ceil() as usize);
        let mut sum = f32x4::splat(simd, 0.0);
        let mut total = 0.0f32;
        let rows = if first <= last {
            first as usize..last as usize + 1
        } else {
            0..0
        };
        for y in rows {
            let Some(mut row) = ellipse.row(middle.x, y as f64 - middle.y, width) else {
                continue;
            };
            let from = y * width + row.columns.start;
            let links = &self.surfaces.links[from..y * width + row.columns.end];
            for (i, links) in links.iter().enumerate() {
                if clear || self.counts(row.columns.start + i, y, from + i) {
                    let weight = row.weight as f32;
                    let sample = if links & RECOLOURED == 0 {
                        self.colours.taken.vector(simd, from + i)
                    } else {
                        self.sample(simd, from + i)
                    };
                    sum = sample.mul_add(f32x4::splat(simd, weight), sum);
                    total += weight;
                }
                row.weight *= row.factor;
                row.factor *= row.factor_of_factor;
            }
        }
        if total > 0.0 {
            sum * f32x4::splat(simd, 1.0 / total)
        } else {
            self.cubic(simd, at)
        }
    }

    /// The colour of a sample.
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, simd: S, index: usize) -> f32x4<S> {
        let links = self.surfaces.links[index];
        let [r, g, b] = self.colours.sample(index, links);
        f32x4::simd_from(simd, [r, g, b, 0.0])
    }
}
