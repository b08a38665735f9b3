//! Sixteen values at once.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

/// Points or discs that are taken at once.
pub(crate) const LANES: usize = 16;

/// A value of each.
pub(crate) type Lanes = [f32; LANES];

/// Three coordinates of each.
pub(crate) type Triple<S> = [f32x16<S>; 3];

#[inline(always)]
pub(crate) fn loaded<S: Simd>(simd: S, v: &[Lanes; 3]) -> Triple<S> {
    [
        f32x16::from_slice(simd, &v[0]),
        f32x16::from_slice(simd, &v[1]),
        f32x16::from_slice(simd, &v[2]),
    ]
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: &Triple<S>, b: &Triple<S>) -> f32x16<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}
