//! Powers of two of numbers that are not positive, in vectors.

use fearless_simd::prelude::*;

/// Adding this rounds a float of magnitude under 2^22 to an integer and leaves that integer in the low bits.
const ROUND_MAGIC: f32 = 12_582_912.0;

/// 2^f - 1 = f (c0 + c1 f + ... + c4 f^4) for |f| <= 1/2, fitted for the smallest relative error: 4.3e-7.
const EXP2M1: [f32; 5] = [
    std::f32::consts::LN_2,
    0.240_223_5,
    0.055_505,
    0.009_666_245,
    0.001_333_353_3,
];

/// 2^x for x <= 0, as 2^-126 below that.
#[inline(always)]
pub(crate) fn exp2<S, F>(simd: S, x: F) -> F
where
    S: Simd,
    F: SimdFloat<S, Element = f32>,
    F::Bits: SimdInt<S, Element = u32>,
{
    let splat = |x: f32| F::splat(simd, x);
    let x = x.max(splat(-126.0));
    let rounded = x + splat(ROUND_MAGIC);
    let f = x - (rounded - splat(ROUND_MAGIC));
    let [c0, c1, c2, c3, c4] = EXP2M1;
    let mut poly = f * c4 + splat(c3);
    poly = poly * f + splat(c2);
    poly = poly * f + splat(c1);
    poly = poly * f + splat(c0);
    let scale = F::from_bits((rounded.to_bits() << 23) + F::Bits::splat(simd, 1f32.to_bits()));
    scale + scale * (f * poly)
}
