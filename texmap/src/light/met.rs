//! The reflection of small lights by rough surfaces: the model's own formula, sixteen places at a time.

use std::f32::consts::PI;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

use super::bumps;
use super::suns::Sun;

/// Surfaces as a small light meets them.
pub(super) struct Met<S: Simd> {
    pub(super) normal: [f32x16<S>; 3],
    pub(super) eye: [f32x16<S>; 3],
    /// Between the two.
    pub(super) cosine: f32x16<S>,
    pub(super) roughness: f32x16<S>,
    /// Mean square of the distance of normals from their mean.
    pub(super) variance: f32x16<S>,
}

impl<S: Simd> Met<S> {
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
        let shape = bumps::shape(
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
