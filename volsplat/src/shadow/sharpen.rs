//! Light at vertices, sharpened: straight lines between vertices lie above a curve, by parts of its second differences in the mean.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::shadow::vertices::{LANES, PaddedRow, Vertices, lanes};

/// The part between whole vertices.
pub(super) const MEAN: f32 = 1.0 / 12.0;

/// A row of square roots of light, and the factors of their second differences, which sharpening subtracts.
pub(super) struct Sharpening<'a> {
    /// The row, those before and after it in its slice, and those in the slices beside it.
    pub(super) lines: [&'a PaddedRow; 5],
    /// Along the row, from row to row and from slice to slice.
    pub(super) bends: [f32; 3],
}

impl Sharpening<'_> {
    /// Sharpens the roots from a first to an end.
    #[simd]
    pub(super) fn roots<S: Simd>(&self, simd: S, [first, end]: [usize; 2], found: &mut PaddedRow) {
        for place in (first..end).step_by(LANES) {
            let root = self.lanes(simd, place + LANES);
            root.store_slice(&mut found.0[place + LANES..][..LANES]);
        }
    }

    /// Adds the light from a first to an end, times a weight.
    #[simd]
    pub(super) fn add<S: Simd>(
        &self,
        simd: S,
        [first, end]: [usize; 2],
        (found, shares, weight): (&mut PaddedRow, &mut [f32], f32),
    ) {
        for place in (first..end).step_by(LANES) {
            let root = self.lanes(simd, place + LANES);
            (root * root * weight).store_slice(&mut found.0[place + LANES..][..LANES]);
        }
        for (share, found) in shares.iter_mut().zip(&found.0[first + LANES..]) {
            *share += found;
        }
    }

    /// The sharpened roots from a place of the lines on.
    #[inline(always)]
    fn lanes<S: Simd>(&self, simd: S, at: usize) -> f32x16<S> {
        let zero = f32x16::splat(simd, 0.0);
        let [own, y_before, y_after, z_before, z_after] = self.lines;
        let beside = [
            [(own, at - 1), (own, at + 1)],
            [(y_before, at), (y_after, at)],
            [(z_before, at), (z_after, at)],
        ];
        let root = lanes(simd, &own.0, at);
        let mut sharp = root;
        for ([before, after], part) in beside.into_iter().zip(self.bends) {
            let ends = lanes(simd, &before.0.0, before.1) + lanes(simd, &after.0.0, after.1);
            let bend = ends - root * 2.0;
            // NaN, where nothing is shown beside the vertex, counts as none.
            sharp -= bend.simd_eq(bend).select(bend, zero) * part;
        }
        sharp.max(zero).min(f32x16::splat(simd, 1.0))
    }
}

/// The square roots of shares at the vertices, sharpened.
pub(super) fn sharpened_roots(vertices: &Vertices, shares: &[f32], level: Vectors) -> Vec<f32> {
    let roots: Vec<f32> = shares.iter().map(|share| share.sqrt()).collect();
    let mut sharp = vec![0.0; roots.len()];
    let width = vertices.sides()[0];
    let lines = || {
        let around = [(); 5].map(|()| PaddedRow::new(width));
        (around, PaddedRow::new(width))
    };
    vertices.change_rows(&mut sharp, lines, |(around, found), row, sharp| {
        vertices.fill_around(row, &roots, around);
        let sharpening = Sharpening {
            lines: around.each_ref(),
            bends: [MEAN; 3],
        };
        for run in vertices.runs(row) {
            let ends = [run.first, run.first + run.len];
            dispatch!(level, simd => sharpening.roots(simd, ends, found));
            sharp[vertices.in_row(row, run)].copy_from_slice(&found.inner()[ends[0]..ends[1]]);
        }
    });
    sharp
}
