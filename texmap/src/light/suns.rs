//! Small bright lights of the surroundings, and what rough surfaces reflect of them.
//!
//! Seen at an angle, the lobe of a rough surface is long in the plane of incidence and narrow across. Blurred surroundings have round lobes, in
//! which a light that is smaller than the lobe keeps as little as a sixth of its highlight. So such lights are points with an area, and what a
//! surface reflects of them is the model's own formula, sixteen places at a time.

use std::f32::consts::PI;
use std::sync::LazyLock;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::Vec3;
use resample_core::narrow::cell;

use crate::light::around::{LEVELS, roughness_of_level};
use crate::screen::LANES;

/// A small bright light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sun {
    /// Towards it, of length 1.
    pub(crate) direction: Vec3,
    /// Radiance above what lies around, summed over the solid angle.
    pub(crate) power: Vec3,
    /// The sun's contribution to the square of a lobe's width (alpha): a disc's variance is a quarter of its radius squared along each axis, a
    /// half vector turns by half of that angle, and alpha squared is twice the variance of half vectors.
    pub(crate) alpha2: f32,
    /// The first level of roughness whose blurred surroundings lack this light: its lobe is some times wider than the light is, and levels
    /// before it show the light as it is.
    pub(crate) first_level: usize,
}

/// How much larger than a light's contribution to it the square of a lobe's width is, where the light is a formula. A guess.
const WIDER: f32 = 4.0;

/// The first level that may lack lights: those before it mirror them.
const FIRST_LEVEL: usize = 2;

impl Sun {
    /// A light of a radius.
    pub(crate) fn new(direction: Vec3, power: Vec3, radius2: f32) -> Self {
        let alpha2 = radius2 / 8.0;
        // The width is the square of roughness.
        let roughness = (WIDER * alpha2).sqrt().sqrt();
        let is_wider = |level: &usize| roughness_of_level(*level as f32) >= roughness;
        Self {
            direction,
            power,
            alpha2,
            first_level: (FIRST_LEVEL..LEVELS).find(is_wider).unwrap_or(LEVELS - 1),
        }
    }

    /// The mean cosine between it and normals that vary, 0 where they are turned away.
    #[inline(always)]
    pub(super) fn mean_cosine<S: Simd>(
        &self,
        simd: S,
        normal: &[f32x16<S>; 3],
        variance: f32x16<S>,
    ) -> f32x16<S> {
        let splat = |v: f32| f32x16::splat(simd, v);
        let (zero, one, half) = (splat(0.0), splat(1.0), splat(0.5));
        let [x, y, z] = self.direction.to_array().map(splat);
        let cosine = normal[0] * x + normal[1] * y + normal[2] * z;
        let sine2 = (one - cosine * cosine).max(zero);
        // Variances along one axis of normals and of the disc, a quarter of its radius squared.
        let spread = variance.max(zero) * half + splat(2.0 * self.alpha2);
        let mean = cosine * (one - variance * half).max(zero);
        // Normals that face away reflect nothing. The mean of max(x, 0), for x of a Gaussian, is its deviation over the root of 2 pi if the Gaussian's mean is
        // 0. A hyperbola has this value there, and tends to the mean, or to 0, far away.
        let root = (mean * mean + spread * sine2 * splat(2.0 / PI)).sqrt();
        (mean + root) * half
    }
}

/// Most lights: each is a formula a pixel.
pub(crate) const MOST: usize = 4;

// Facets on a surface with bumps that are too small to be seen are denser or sparser.
//
// Slopes of facets are spread as GGX has it, slopes of bumps as a Gaussian; both together are spread as the two blurred by one another. GGX
// is a mix of Gaussians: with alpha squared a, its density at slope s is the integral of exp(-t) G(s; a / t) over t > 0, where G(s; v) =
// exp(-s^2 / v) / (pi v). A Gaussian of bumps with variance b (sum of both axes) makes each of them G(s; a / t + b). The table holds what this is of
// the plain GGX with alpha squared a + b, which has its tails where the sum has few.

/// Surfaces as a small light meets them.
pub(super) struct LitSurface<S: Simd> {
    pub(super) normal: [f32x16<S>; 3],
    pub(super) eye: [f32x16<S>; 3],
    /// Between the two.
    pub(super) cosine: f32x16<S>,
    pub(super) roughness: f32x16<S>,
    /// Mean square of the distance of normals from their mean.
    pub(super) variance: f32x16<S>,
}

impl<S: Simd> LitSurface<S> {
    /// The share of a light's power that a surface of reflectance 1 returns, and the part of it that Schlick's term weighs.
    #[inline(always)]
    pub(super) fn lit_by(&self, simd: S, sun: &Sun) -> [f32x16<S>; 2] {
        let splat = |v: f32| f32x16::splat(simd, v);
        let (zero, one, least) = (splat(0.0), splat(1.0), splat(1e-7));
        let light = sun.direction.to_array().map(splat);
        let dot = |a: &[f32x16<S>; 3], b: &[f32x16<S>; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let half = [0, 1, 2].map(|k: usize| self.eye[k] + light[k]);
        let per_length = one / dot(&half, &half).sqrt().max(least);
        let to_light = dot(&self.normal, &light).max(zero);
        let to_half = (dot(&self.normal, &half) * per_length).max(zero).min(one);
        let tilt = (dot(&self.eye, &half) * per_length).max(zero).min(one);
        let alpha = self.roughness * self.roughness;
        // Slopes of normals add to those of facets; alpha squared is the sum of the variances along both axes.
        let added = self.variance + splat(sun.alpha2);
        let sum = alpha * alpha + added;
        let alpha2 = sum.min(one);
        let spread = one + to_half * to_half * (alpha2 - one);
        // Slopes of bumps and of a light's disc have no tails as those of facets have.
        let shape = shape_of_bumps(
            simd,
            added / sum.max(least),
            (one - to_half * to_half) / spread.max(least),
        );
        let dense = shape * alpha2 / (spread * spread * splat(PI)).max(least);
        let smith = |a: f32x16<S>, b: f32x16<S>| a * (b * b * (one - alpha2) + alpha2).sqrt();
        let blocked = smith(to_light, self.cosine) + smith(self.cosine, to_light);
        let plain = dense * to_light * splat(0.5) / blocked.max(least);
        let away = one - tilt;
        let away2 = away * away;
        [plain, plain * away2 * away2 * away]
    }
}

/// Nodes along each side: the shape is smooth, and bilinear between them to 0.3 %.
const SIDE: usize = 33;

/// By b / (a + b), then by s^2 / (a + b + s^2).
static SHAPE: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let share = |k: usize| k as f64 / (SIDE - 1) as f64;
    (0..SIDE * SIDE)
        .map(|node| at(share(node / SIDE), share(node % SIDE)) as f32)
        .collect()
});

/// The density of slopes over that of the plain GGX.
fn at(of_bumps: f64, away: f64) -> f64 {
    if away == 1.0 {
        // Far away only the tails of facets are left.
        return 1.0 - of_bumps;
    }
    let square = away / (1.0 - away);
    let plain = (1.0 + square).powi(-2);
    if of_bumps == 1.0 {
        return (-square).exp() / plain;
    }
    // In units of a + b; over the logarithm of t, where the integrand is smooth and falls off at both ends.
    let (step, count) = (0.1, 240);
    let mut sum = 0.0;
    for k in 0..count {
        let t = (-20.0 + step * f64::from(k)).exp();
        let variance = (1.0 - of_bumps) / t + of_bumps;
        sum += t * (-t - square / variance).exp() / variance;
    }
    sum * step / plain
}

/// The density of facets under bumps, by their part of the sum of variances, and by s^2 / (a + b + s^2).
#[inline(always)]
fn shape_of_bumps<S: Simd>(simd: S, of_bumps: f32x16<S>, away: f32x16<S>) -> f32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    let last = (SIDE - 1) as f32;
    let scaled = |v: f32x16<S>| v.max(splat(0.0)).min(splat(1.0)) * splat(last);
    let (mut rows, mut columns) = ([0.0; LANES], [0.0; LANES]);
    scaled(of_bumps).store_slice(&mut rows);
    scaled(away).store_slice(&mut columns);
    let table = &**SHAPE;
    let mut out = [1.0; LANES];
    for lane in 0..LANES {
        let row = cell(rows[lane]).min(SIDE - 2);
        let column = cell(columns[lane]).min(SIDE - 2);
        let (down, right) = (rows[lane] - row as f32, columns[lane] - column as f32);
        let first = row * SIDE + column;
        let mixed = |place: usize| table[place] + (table[place + 1] - table[place]) * right;
        let (top, low) = (mixed(first), mixed(first + SIDE));
        out[lane] = top + (low - top) * down;
    }
    f32x16::from_slice(simd, &out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_bumps_the_shape_is_that_of_facets() {
        for k in 0..10 {
            let found = at(0.0, f64::from(k) / 10.0);
            assert!((found - 1.0).abs() < 1e-6, "{k}: {found}");
        }
    }

    #[test]
    fn no_facets_are_lost_whatever_the_bumps() {
        // The density over all slopes: the integral of shape * (1 + y)^-2 over y is that of shape over z = y / (1 + y).
        for of_bumps in [0.1, 0.5, 0.9] {
            let count = 2000;
            let place = |k: i32| (f64::from(k) + 0.5) / f64::from(count);
            let sum: f64 = (0..count).map(|k| at(of_bumps, place(k))).sum();
            let mean = sum / f64::from(count);
            assert!((mean - 1.0).abs() < 1e-3, "{of_bumps}: {mean}");
        }
    }

    #[test]
    fn bumps_blur_the_density_of_slopes() {
        // The GGX blurred by brute force along a line through its middle.
        let (a, b) = (0.04f64, 0.02f64);
        let facets = |x: f64, y: f64| a / (std::f64::consts::PI * (a + x * x + y * y).powi(2));
        for s in [0.0, 0.1, 0.3, 0.6] {
            let (step, reach) = (0.005, 120);
            let (mut sum, mut whole) = (0.0, 0.0);
            for i in -reach..=reach {
                for j in -reach..=reach {
                    let (x, y) = (f64::from(i) * step, f64::from(j) * step);
                    let weight = (-(x * x + y * y) / b).exp();
                    sum += weight * facets(s - x, y);
                    whole += weight;
                }
            }
            let all = a + b;
            let plain = all / (std::f64::consts::PI * (all + s * s).powi(2));
            let found = plain * at(b / all, s * s / (all + s * s));
            let truth = sum / whole;
            assert!(
                (found / truth - 1.0).abs() < 1e-3,
                "slope {s}: {found} of {truth}"
            );
        }
    }
}
