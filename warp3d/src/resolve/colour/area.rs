//! Colours over a footprint of several samples: a Gaussian sum along a line of cubic lookups, or over an ellipse of samples.
//!
//! Along a row of samples a Gaussian's weight changes by a factor that itself changes by a constant factor, so that a
//! sample costs two multiplications and no exponential.

use fearless_simd::f32x4;
use fearless_simd::prelude::*;
use glam::DVec2;

use super::{Footprint, Lookup, SAMPLED_VARIANCE};
use crate::surfaces::surface::RECOLOURED;

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
