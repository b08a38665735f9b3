//! Half a row of rays through a brick, and where they enter and leave it.
//!
//! Rays run in the grid, relative to the anchor; their parameter is camera z relative to the anchor's. Neighbouring
//! bricks find the same numbers for the face that they share, so that together they miss nothing and count nothing twice.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::maps::TilePlane;

use crate::field::settings::{AnchoredRays, TileContext};
use crate::field::walk::cell_sample::CellBox;
use crate::slabs::view::{HalfRow, LANES};

/// Components of a direction below this count as this: a ray along a face.
const LEAST_DIRECTION: f32 = 1e-30;

/// Half a row of rays through a brick.
#[derive(Clone, Copy)]
pub(crate) struct Rays<'a, S: Simd> {
    pub(crate) cells: &'a CellBox,
    pub(crate) at: HalfRow,
    pub(crate) start: [f32x8<S>; 3],
    pub(crate) direction: [f32x8<S>; 3],
    /// Of the near plane.
    near: f32,
}

impl<'a, S: Simd> Rays<'a, S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, rays: &'a AnchoredRays, cells: &'a CellBox, at: HalfRow) -> Self {
        let range = at.first..at.first + LANES;
        let load = |plane: &TilePlane| f32x8::from_slice(simd, &plane[at.row][range.clone()]);
        Self {
            cells,
            at,
            start: [
                load(&rays.start[0]),
                load(&rays.start[1]),
                load(&rays.start[2]),
            ],
            direction: [
                load(&rays.direction[0]),
                load(&rays.direction[1]),
                load(&rays.direction[2]),
            ],
            near: rays.near,
        }
    }

    /// One over the direction along an axis.
    #[inline(always)]
    pub(crate) fn inverse(&self, simd: S, axis: usize) -> f32x8<S> {
        f32x8::splat(simd, 1.0) / not_zero(simd, self.direction[axis])
    }

    /// Where rays enter and leave what is kept of the brick's box, `overlap` voxels wider, behind the near plane.
    #[inline(always)]
    pub(crate) fn inside_brick(
        &self,
        simd: S,
        job: &TileContext,
        overlap: f32,
    ) -> (f32x8<S>, f32x8<S>) {
        let constant = |v: f32| f32x8::splat(simd, v);
        let (mut first, mut last) = (constant(self.near), constant(f32::MAX));
        for axis in 0..3 {
            let inverse = self.inverse(simd, axis);
            let a = (constant(self.cells.low[axis] - overlap) - self.start[axis]) * inverse;
            let b = (constant(self.cells.high[axis] + overlap) - self.start[axis]) * inverse;
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
        for (number, half) in job.settings.clip.iter().enumerate() {
            if job.placed.cuts >> number & 1 == 1 {
                let dot = |v: &[f32x8<S>; 3], end: f32| {
                    let [x, y, z] = half.normal;
                    v[0].mul_add(
                        constant(x),
                        v[1].mul_add(constant(y), v[2].mul_add(constant(z), constant(end))),
                    )
                };
                let rise = not_zero(simd, dot(&self.direction, 0.0));
                let bound = -dot(&self.start, half.offset) / rise;
                let rises = rise.simd_gt(constant(0.0));
                first = rises.select(first.max(bound), first);
                last = rises.select(last, last.min(bound));
            }
        }
        if let Some(spans) = job.spans {
            let [near, far] = spans.ends(simd, self.at);
            last = last.min(far);
            first = first.max(near.min(last));
        }
        (first, last)
    }
}

#[inline(always)]
fn not_zero<S: Simd>(simd: S, v: f32x8<S>) -> f32x8<S> {
    let least = f32x8::splat(simd, LEAST_DIRECTION);
    let small = v.simd_lt(least) & v.simd_gt(-least);
    small.select(least, v)
}
