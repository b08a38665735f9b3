//! The profile of a Gaussian along a ray, cut off at three standard deviations, and its optical depth: polynomials for vectors.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

/// Where the profile ends, standard deviations. What lies beyond, 0.27 %, is spread over the rest.
pub(crate) const REACH: f32 = 3.0;

/// Share of the profile before x, less a half, over x: in powers of x^2. Least greatest error over the reach, scaled so that
/// the shares of both ends are 0 and 1: 3e-4.
const SHARE: [f32; 5] = [
    0.398_816_63,
    -0.064_121_55,
    0.008_174_415,
    -0.000_610_624_8,
    1.950_341_2e-5,
];

/// Integral of x over the profile before x, over x^2 - 9: in powers of x^2. Greatest error 3e-4.
const MOMENT: [f32; 5] = [
    0.043_918_233,
    -0.017_035_138,
    0.003_216_834_3,
    -0.000_323_341_92,
    1.344_628_6e-5,
];

/// ln(1 + t) / t for t between sqrt(1/2) - 1 and sqrt(2) - 1: greatest relative error 8e-6.
const LN1P: [f32; 6] = [
    1.000_005_6,
    -0.499_913_54,
    0.332_479_23,
    -0.253_599_1,
    0.221_714_64,
    -0.146_618_88,
];

#[inline(always)]
fn polynomial<S: Simd>(simd: S, x: f32x16<S>, coefficients: &[f32]) -> f32x16<S> {
    let (last, rest) = coefficients.split_last().expect("a polynomial");
    let mut sum = f32x16::splat(simd, *last);
    for c in rest.iter().rev() {
        sum = sum.mul_add(x, f32x16::splat(simd, *c));
    }
    sum
}

/// Share of the profile before `x` standard deviations, -3..3, and the integral of x over that part.
#[inline(always)]
pub(crate) fn share_and_moment<S: Simd>(simd: S, x: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
    let square = x * x;
    let share = polynomial(simd, square, &SHARE).mul_add(x, f32x16::splat(simd, 0.5));
    let moment = polynomial(simd, square, &MOMENT) * (square - REACH * REACH);
    (share, moment)
}

/// -ln(1 - opacity) for opacities of 0 to 1 - 2^-20, to 1e-5 relative and 1e-7.
#[inline(always)]
pub(crate) fn optical_depth<S: Simd>(simd: S, opacity: f32x16<S>) -> f32x16<S> {
    /// 1/sqrt(2): mantissas are brought to between it and its double.
    const LOWEST: u32 = 0x3f35_04f3;
    let y = f32x16::splat(simd, 1.0) - opacity;
    let bits = y.to_bits();
    let shifted = bits - LOWEST;
    // The exponent, as an arithmetic shift of a number that is at most 0.
    let exponent = shifted.bitcast::<fearless_simd::i32x16<S>>() >> 23;
    let mantissa = f32x16::from_bits(bits - (exponent << 23).bitcast::<fearless_simd::u32x16<S>>());
    let t = mantissa - 1.0;
    let ln_mantissa = polynomial(simd, t, &LN1P) * t;
    let exponent = f32x16::float_from(exponent);
    f32x16::splat(simd, 0.0)
        - exponent.mul_add(f32x16::splat(simd, std::f32::consts::LN_2), ln_mantissa)
}
