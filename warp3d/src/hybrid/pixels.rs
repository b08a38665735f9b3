//! Pixels of a band.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8};

use crate::project::LANES;

/// A pixel that no finer lattice belongs to.
pub(crate) const NO_SLOT: u32 = u32::MAX;

/// The pixels that the bounding boxes of eight pieces touch inside a band.
pub(super) struct Boxes<S: Simd> {
    /// The pieces that touch any.
    pub(super) some: mask32x8<S>,
    /// First and last column, first and last row.
    pub(super) ranges: [[f32; LANES]; 4],
}

/// The pixels between two corners.
#[derive(Clone, Copy)]
pub(super) struct PixelBox {
    /// First and last.
    pub(super) columns: [usize; 2],
    /// First and last.
    pub(super) rows: [usize; 2],
}

impl<S: Simd> Boxes<S> {
    /// Those of pieces of these least and greatest screen x and y, of which only `some` count.
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        some: mask32x8<S>,
        [x, y]: [[f32x8<S>; 2]; 2],
        width: usize,
        rows: [usize; 2],
    ) -> Self {
        let constant = |v: usize| f32x8::splat(simd, v as f32);
        let (left, right) = (
            x[0].floor().max(constant(0)),
            x[1].floor().min(constant(width - 1)),
        );
        let (top, bottom) = (
            y[0].floor().max(constant(rows[0])),
            y[1].floor().min(constant(rows[1] - 1)),
        );
        Self {
            some: some & left.simd_le(right) & top.simd_le(bottom),
            ranges: [
                left.to_array(),
                right.to_array(),
                top.to_array(),
                bottom.to_array(),
            ],
        }
    }

    /// One of the boxes, of those that touch any pixel.
    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> PixelBox {
        let number = |i: usize| self.ranges[i][lane] as usize;
        PixelBox {
            columns: [number(0), number(1)],
            rows: [number(2), number(3)],
        }
    }
}
