//! The cubic spline at a place: weights of four samples along each axis, and the sum over sixteen samples.
//!
//! A Gaussian of small variance needs no more samples than the spline itself: the spline plus half the variance times
//! its second derivatives, which are sums over the same sixteen.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8};

/// Weights of four samples around a place `t` past the second, and their first and second derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub(super) value: [f32; 4],
    slope: [f32; 4],
    bend: [f32; 4],
}

impl Axis {
    /// The cubic B-spline at `t` from 0 to 1.
    #[inline(always)]
    pub(super) fn new(t: f32) -> Self {
        let (t2, t3, s) = (t * t, t * t * t, 1.0 - t);
        let sixth = 1.0 / 6.0;
        Self {
            value: [
                sixth * s * s * s,
                sixth * (3.0 * t3 - 6.0 * t2 + 4.0),
                sixth * (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0),
                sixth * t3,
            ],
            slope: [
                -0.5 * s * s,
                1.5 * t2 - 2.0 * t,
                -1.5 * t2 + t + 0.5,
                0.5 * t2,
            ],
            bend: [s, 3.0 * t - 2.0, 1.0 - 3.0 * t, t],
        }
    }

    /// The weights with a Gaussian of this small variance, px^2.
    #[inline(always)]
    pub(super) fn widened(&self, variance: f32) -> [f32; 4] {
        let half = 0.5 * variance;
        let mut out = self.value;
        for (out, bend) in out.iter_mut().zip(self.bend) {
            *out += half * bend;
        }
        out
    }
}

/// Weights of sixteen samples: a product of two axes, and a small part that is turned.
pub(super) struct Weights {
    /// Along x and y.
    pub(super) axes: [[f32; 4]; 2],
    /// Slopes along x, and slopes along y times the covariance, px^2.
    turned: Option<[[f32; 4]; 2]>,
}

impl Weights {
    /// The spline alone.
    #[inline(always)]
    pub(super) fn plain(x: &Axis, y: &Axis) -> Self {
        Self {
            axes: [x.value, y.value],
            turned: None,
        }
    }

    /// The spline with a Gaussian of the small variance (xx, xy, yy), px^2.
    #[inline(always)]
    pub(super) fn widened(x: &Axis, y: &Axis, [xx, xy, yy]: [f32; 3]) -> Self {
        let mut slope = y.slope;
        for slope in &mut slope {
            *slope *= xy;
        }
        Self {
            axes: [x.widened(xx), y.widened(yy)],
            turned: (xy != 0.0).then_some([x.slope, slope]),
        }
    }

    /// The weighted sum of the sixteen samples whose first is `first`, in rows of `width`.
    #[inline(always)]
    pub(super) fn sum<S: Simd>(
        &self,
        simd: S,
        samples: &[[f32; 4]],
        first: usize,
        width: usize,
    ) -> f32x4<S> {
        let samples = samples.as_flattened();
        // Two samples a vector: the left and the right half of each row.
        let mut rows = [[f32x8::splat(simd, 0.0); 2]; 4];
        for (j, row) in rows.iter_mut().enumerate() {
            let from = 4 * (first + j * width);
            let sixteen = &samples[from..from + 16];
            *row = [
                f32x8::from_slice(simd, &sixteen[..8]),
                f32x8::from_slice(simd, &sixteen[8..]),
            ];
        }
        let mut sum = product(simd, &rows, &self.axes);
        if let Some(turned) = &self.turned {
            sum += product(simd, &rows, turned);
        }
        let (left, right) = sum.split();
        left + right
    }
}

/// The sum over four rows of four samples with the product of the weights `x` and `y`, in two halves.
#[inline(always)]
fn product<S: Simd>(simd: S, rows: &[[f32x8<S>; 2]; 4], [x, y]: &[[f32; 4]; 2]) -> f32x8<S> {
    let mut halves = [f32x8::splat(simd, 0.0); 2];
    for (row, &weight) in rows.iter().zip(y) {
        let weight = f32x8::splat(simd, weight);
        halves = [
            row[0].mul_add(weight, halves[0]),
            row[1].mul_add(weight, halves[1]),
        ];
    }
    let pair = |i: usize| f32x4::splat(simd, x[i]).combine(f32x4::splat(simd, x[i + 1]));
    halves[0].mul_add(pair(0), halves[1] * pair(2))
}
