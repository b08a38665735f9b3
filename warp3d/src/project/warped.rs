//! Samples warped to the screen, eight at a time, in f64.
//!
//! The homogeneous screen position is linear in (x, y, 1, d), so a row costs one product a coordinate and sample. What is
//! kept of it is f32.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f64x8, mask32x8, mask64x8};
use resample_core::Projection;

use super::vertex::LANES;
use crate::view::bands::RowRange;
use crate::view::warp::Warp;

/// 0.5 to 7.5.
const PLACES: [f64; LANES] = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5];

/// The terms of places on the screen.
#[derive(Clone, Debug)]
pub(crate) struct Terms {
    /// Constant, and what x, y and disparity add: screen x, screen y and their divisor, all scaled, and the numerator of
    /// depth.
    rows: [[f64; 4]; 4],
    /// Constant and slope in disparity of the divisor of depth.
    depth_divisor: [f64; 2],
    target: Projection,
    /// Largest nearness of anything in front.
    most: f64,
}

/// A sum of terms for eight places.
#[inline(always)]
fn along<S: Simd>(
    simd: S,
    [one, by_x, by_y, by_disparity]: [f64; 4],
    [x, y, disparity]: [f64x8<S>; 3],
) -> f64x8<S> {
    let constant = |v: f64| f64x8::splat(simd, v);
    let sum = y.mul_add(constant(by_y), constant(one));
    let sum = x.mul_add(constant(by_x), sum);
    disparity.mul_add(constant(by_disparity), sum)
}

impl Terms {
    pub(crate) fn new(warp: &Warp) -> Self {
        let ([by_x, by_y, one], by_disparity) = (warp.pixel_columns(), warp.disparity_column());
        let ([x, y, constant, disparity], depth_divisor) = warp.depth_terms();
        let row = |i: usize| [one[i], by_x[i], by_y[i], by_disparity[i]];
        let (target, near) = warp.target();
        Self {
            rows: [row(0), row(1), row(2), [constant, x, y, disparity]],
            depth_divisor,
            target,
            most: warp.nearness(near),
        }
    }

    /// Eight samples of row `y` from column `first` on, as [`Self::at`] gives them.
    #[inline(always)]
    pub(crate) fn warped<S: Simd>(
        &self,
        simd: S,
        [first, y]: [usize; 2],
        disparity: f32x8<S>,
    ) -> [f64x8<S>; 3] {
        let x = f64x8::from_slice(simd, &PLACES) + f64x8::splat(simd, first as f64);
        let y = f64x8::splat(simd, y as f64 + 0.5);
        self.at(simd, [x, y, widen(disparity)])
    }

    /// Eight places of the reference (x and y, px, and disparity): screen x, which is NaN where they are not in front,
    /// screen y and nearness.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, at: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        let constant = |v: f64| f64x8::splat(simd, v);
        let divisor = along(simd, self.rows[2], at);
        let inverse = constant(1.0) / divisor;
        let (nearness, before) = match self.target {
            Projection::Perspective => {
                let [one, by_disparity] = self.depth_divisor.map(constant);
                let nearness = at[2].mul_add(by_disparity, one) * inverse;
                (nearness, divisor.simd_gt(constant(0.0)))
            }
            Projection::Orthographic => (
                -(along(simd, self.rows[3], at) * inverse),
                divisor.simd_gt(constant(f64::NEG_INFINITY)),
            ),
        };
        let in_front = before
            & nearness.simd_le(constant(self.most))
            & divisor.simd_lt(constant(f64::INFINITY));
        let x = along(simd, self.rows[0], at) * inverse;
        let x = in_front.select(x, constant(f64::NAN));
        [x, along(simd, self.rows[1], at) * inverse, nearness]
    }

    /// Screen x and y of eight corners of boxes, and which of them are in front: between corners that are, no place is behind
    /// the eye or before the near plane.
    #[inline(always)]
    pub(crate) fn corner<S: Simd>(
        &self,
        simd: S,
        at: [f64x8<S>; 3],
    ) -> ([f64x8<S>; 2], mask64x8<S>) {
        let constant = |v: f64| f64x8::splat(simd, v);
        let [x, y, nearness] = self.at(simd, at);
        let before = along(simd, self.rows[2], at).simd_gt(constant(0.0));
        // Places between may round differently.
        let most = nearness.abs().mul_add(constant(1e-9), nearness);
        let in_front = before & most.simd_le(constant(self.most)) & x.simd_eq(x);
        ([x, y], in_front)
    }
}

/// Eight numbers of twice the width.
#[inline(always)]
pub(crate) fn widen<S: Simd>(value: f32x8<S>) -> f64x8<S> {
    let (low, high) = value.widen();
    low.combine(high)
}

/// Eight numbers of half the width.
#[inline(always)]
pub(crate) fn narrow<S: Simd>(value: f64x8<S>) -> f32x8<S> {
    let (low, high) = value.split();
    low.narrow(high)
}

/// Least and greatest screen x and y, by lanes.
pub(crate) struct Bounds<S: Simd> {
    low: [f32x8<S>; 2],
    high: [f32x8<S>; 2],
}

impl<S: Simd> Bounds<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        let constant = |v: f32| f32x8::splat(simd, v);
        Self {
            low: [constant(f32::INFINITY); 2],
            high: [constant(f32::NEG_INFINITY); 2],
        }
    }

    /// Widens the bounds to hold some of eight places.
    #[inline(always)]
    pub(crate) fn include(&mut self, at: [f32x8<S>; 2], some: mask32x8<S>) {
        for (axis, value) in at.into_iter().enumerate() {
            self.low[axis] = some.select(value.min(self.low[axis]), self.low[axis]);
            self.high[axis] = some.select(value.max(self.high[axis]), self.high[axis]);
        }
    }

    #[inline(always)]
    pub(crate) fn ranges(&self) -> [RowRange; 2] {
        let range = |i: usize| RowRange {
            low: self.low[i].reduce_min(),
            high: self.high[i].reduce_max(),
        };
        [range(0), range(1)]
    }
}
