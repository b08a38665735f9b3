//! A footprint whose roughness or metal varies, as one or two lobes.
//!
//! Takes the mean of metal, the mean and the variance of roughness, and the covariance of both; gives roughnesses, each with a weight and a
//! metal of its own, that have these moments. Two lobes lie a deviation to either side of the mean, half of the footprint each, as
//! far as their metals lie within 0..=1; where roughness follows metal the weights move until one lobe is all metal or all
//! paint. So rough silver beside smooth paint are those two, and not two mixtures of both.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

/// Variance of roughness from which on it is two lobes: below, they differ by less than a level of the environment.
const TWO_LOBES: f32 = 0.0016;

/// The least part of a footprint that is a lobe of its own.
const LEAST_PART: f32 = 1e-3;

/// Added to squares that may be 0.
const TINY: f32 = 1e-20;

/// One of the lobes.
pub(super) struct Lobe<S: Simd> {
    pub(super) weight: f32x16<S>,
    pub(super) roughness: f32x16<S>,
    pub(super) metal: f32x16<S>,
}

/// Means, variance and covariance over a footprint.
pub(super) struct FootprintMoments<S: Simd> {
    pub(super) metal: f32x16<S>,
    pub(super) roughness: f32x16<S>,
    /// Variance of roughness.
    pub(super) variance: f32x16<S>,
    /// Covariance of roughness and metal.
    pub(super) with_metal: f32x16<S>,
}

impl<S: Simd> FootprintMoments<S> {
    /// The lobes, and how many of them differ.
    #[inline(always)]
    pub(super) fn lobes(&self, simd: S) -> ([Lobe<S>; 2], usize) {
        let splat = |x: f32| f32x16::splat(simd, x);
        let (zero, one, tiny) = (splat(0.0), splat(1.0), splat(TINY));
        let apart = self.variance.simd_gt(splat(TWO_LOBES));
        if !apart.any_true() {
            let lobe = |weight| Lobe {
                weight,
                roughness: self.roughness.max(zero).min(one),
                metal: self.metal,
            };
            return ([lobe(one), lobe(zero)], 1);
        }
        let spread = apart.select(self.variance.max(zero).sqrt(), zero);
        let paint = one - self.metal;
        // How far metals move with a deviation of roughness; at most as far as two values can.
        let most = (self.metal * paint).max(zero).sqrt();
        let moved = apart.select(self.with_metal / spread.max(splat(1e-6)), zero);
        let moved = moved.max(zero - most).min(most);
        let moved2 = moved * moved;
        let is_up = moved.simd_gt(zero);
        let above = is_up.select(paint, self.metal);
        let below = is_up.select(self.metal, paint);
        // The rougher lobe's part: it has no more metal than 1 and no less than 0, and so has the other.
        let least = moved2 / (moved2 + above * above + tiny);
        let greatest = (below * below + tiny) / (moved2 + below * below + tiny);
        let part = splat(0.5).max(least).min(greatest);
        let part = part.max(splat(LEAST_PART)).min(splat(1.0 - LEAST_PART));
        let odds = ((one - part) / part).sqrt();
        let lobe = |weight: f32x16<S>, away: f32x16<S>| Lobe {
            weight,
            roughness: (self.roughness + spread * away).max(zero).min(one),
            metal: (self.metal + moved * away).max(zero).min(one),
        };
        ([lobe(part, odds), lobe(one - part, zero - one / odds)], 2)
    }
}
