//! A row of samples warped to the screen, eight at a time, in f64.
//!
//! The homogeneous screen position is linear in (x, y, 1, d), so a row costs one product a coordinate and sample. What is
//! kept of it is f32.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f64x8, mask32x8};
use fearless_simd_macros::simd;
use resample_core::Projection;

use super::vertex::{LANES, SEGMENT};
use crate::bands::RowRange;
use crate::warp::Warp;

/// 0.5 to 7.5.
const PLACES: [f64; LANES] = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5];

/// A row of samples on the screen.
pub(super) struct ProjectedRow<'a> {
    /// Screen x, screen y and nearness of each sample.
    pub(super) planes: [&'a mut [f32]; 3],
    /// Screen columns and rows of each block of samples.
    pub(super) blocks: &'a mut [[RowRange; 2]],
}

/// What a row's samples are computed from.
pub(crate) struct Terms {
    /// Constant, and what x and disparity add: screen x, screen y and their divisor, all scaled, and the numerator of depth.
    rows: [[f64; 3]; 4],
    /// Constant and slope in disparity of the divisor of depth.
    depth_divisor: [f64; 2],
    target: Projection,
    /// Largest nearness of anything in front.
    most: f64,
}

impl Terms {
    /// For the samples of row `y`.
    pub(crate) fn new(warp: &Warp, y: usize) -> Self {
        let y = y as f64 + 0.5;
        let ([by_x, by_y, one], by_disparity) = (warp.pixel_columns(), warp.disparity_column());
        let (depth, depth_divisor) = warp.depth_terms();
        let row = |i: usize| [by_y[i] * y + one[i], by_x[i], by_disparity[i]];
        let depth = [depth[1] * y + depth[2], depth[0], depth[3]];
        let (target, near) = warp.target();
        Self {
            rows: [row(0), row(1), row(2), depth],
            depth_divisor,
            target,
            most: warp.nearness(near),
        }
    }

    /// Eight samples from column `first` on: screen x, which is NaN where they are not in front, screen y and nearness.
    #[inline(always)]
    pub(crate) fn warped<S: Simd>(
        &self,
        simd: S,
        first: usize,
        disparity: f32x8<S>,
    ) -> [f64x8<S>; 3] {
        let constant = |v: f64| f64x8::splat(simd, v);
        let x = f64x8::from_slice(simd, &PLACES) + constant(first as f64);
        let (low, high) = disparity.widen();
        let disparity = low.combine(high);
        let along = |[one, by_x, by_disparity]: [f64; 3]| {
            disparity.mul_add(
                constant(by_disparity),
                x.mul_add(constant(by_x), constant(one)),
            )
        };
        let divisor = along(self.rows[2]);
        let inverse = constant(1.0) / divisor;
        let (nearness, before) = match self.target {
            Projection::Perspective => {
                let depth_divisor = disparity.mul_add(
                    constant(self.depth_divisor[1]),
                    constant(self.depth_divisor[0]),
                );
                (depth_divisor * inverse, divisor.simd_gt(constant(0.0)))
            }
            Projection::Orthographic => (
                -(along(self.rows[3]) * inverse),
                divisor.simd_gt(constant(f64::NEG_INFINITY)),
            ),
        };
        let in_front = before
            & nearness.simd_le(constant(self.most))
            & divisor.simd_lt(constant(f64::INFINITY));
        let x = in_front.select(along(self.rows[0]) * inverse, constant(f64::NAN));
        [x, along(self.rows[1]) * inverse, nearness]
    }
}

/// Warps the samples of row `y`, and finds what each of its blocks touches.
#[simd]
pub(super) fn project_row<S: Simd>(
    simd: S,
    warp: &Warp,
    y: usize,
    disparity: &[f32],
    row: ProjectedRow<'_>,
) {
    let terms = Terms::new(warp, y);
    let [xs, ys, nearness] = row.planes;
    for (block, ranges) in row.blocks.iter_mut().enumerate() {
        let mut bounds = Bounds::new(simd);
        let end = ((block + 1) * SEGMENT).min(disparity.len());
        for first in (block * SEGMENT..end).step_by(LANES) {
            let count = LANES.min(end - first);
            let mut known = [f32::NAN; LANES];
            known[..count].copy_from_slice(&disparity[first..first + count]);
            let known = f32x8::simd_from(simd, known);
            let [x, y, near] = terms.warped(simd, first, known);
            let [x, y, near] = [narrow(x), narrow(y), narrow(near)];
            bounds.include([x, y]);
            for (to, from) in [(&mut *xs, x), (&mut *ys, y), (&mut *nearness, near)] {
                to[first..first + count].copy_from_slice(&from.to_array()[..count]);
            }
        }
        *ranges = bounds.ranges();
    }
}

/// Eight numbers of half the width.
#[inline(always)]
pub(crate) fn narrow<S: Simd>(value: f64x8<S>) -> f32x8<S> {
    let (low, high) = value.split();
    low.narrow(high)
}

/// Least and greatest screen x and y of what is in front, by lanes.
struct Bounds<S: Simd> {
    low: [f32x8<S>; 2],
    high: [f32x8<S>; 2],
}

impl<S: Simd> Bounds<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let constant = |v: f32| f32x8::splat(simd, v);
        Self {
            low: [constant(f32::INFINITY); 2],
            high: [constant(f32::NEG_INFINITY); 2],
        }
    }

    #[inline(always)]
    fn include(&mut self, at: [f32x8<S>; 2]) {
        // NaN is no x of a sample in front.
        let in_front: mask32x8<S> = at[0].simd_eq(at[0]);
        for (axis, value) in at.into_iter().enumerate() {
            self.low[axis] = in_front.select(value.min(self.low[axis]), self.low[axis]);
            self.high[axis] = in_front.select(value.max(self.high[axis]), self.high[axis]);
        }
    }

    #[inline(always)]
    fn ranges(&self) -> [RowRange; 2] {
        let range = |i: usize| RowRange {
            low: self.low[i].reduce_min(),
            high: self.high[i].reduce_max(),
        };
        [range(0), range(1)]
    }
}
