//! Light at vertices, sharpened: between vertices straight lines lie above a curve by a twelfth of its second difference in the mean.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::shadow::vertices::{LANES, PaddedRow, Vertices, lanes};

/// The square roots of shares at the vertices, less a twelfth of their second differences along the three axes.
pub(super) fn sharpened_roots(vertices: &Vertices, shares: &[f32], level: Vectors) -> Vec<f32> {
    let mut roots = vec![0.0; shares.len()];
    let width = vertices.sides()[0];
    let lines = || {
        (
            [(); 5].map(|()| PaddedRow::new(width)),
            PaddedRow::new(width),
        )
    };
    vertices.change_rows(&mut roots, lines, |(around, found), row, roots| {
        let places = [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]];
        for (line, place) in around.iter_mut().zip(places) {
            vertices.fill(vertices.beside(row, place), shares, line.inner());
        }
        for run in vertices.runs(row) {
            let ends = [run.first, run.first + run.len];
            dispatch!(level, simd => sharpen(simd, around, (ends, found)));
            roots[vertices.in_row(row, run)].copy_from_slice(&found.inner()[ends[0]..ends[1]]);
        }
    });
    roots
}

/// Sharpens the roots of a run, from those of its row and of the four rows around it.
#[simd]
fn sharpen<S: Simd>(
    simd: S,
    around: &[PaddedRow; 5],
    ([first, end], found): ([usize; 2], &mut PaddedRow),
) {
    let zero = f32x16::splat(simd, 0.0);
    let [own, y_before, y_after, z_before, z_after] = around;
    let beside = [
        [(own, LANES - 1), (own, LANES + 1)],
        [(y_before, LANES), (y_after, LANES)],
        [(z_before, LANES), (z_after, LANES)],
    ];
    for place in (first..end).step_by(LANES) {
        let at = place + LANES;
        let centre = lanes(simd, &own.0, at).sqrt();
        let mut bends = zero;
        for [(before, from), (after, to)] in beside {
            let ends = lanes(simd, &before.0, from + place).sqrt()
                + lanes(simd, &after.0, to + place).sqrt();
            let bend = ends - centre * 2.0;
            // NaN, where nothing is shown beside the vertex, counts as none.
            bends += bend.simd_eq(bend).select(bend, zero);
        }
        let sharp = centre - bends * (1.0 / 12.0);
        let sharp = sharp.max(zero).min(f32x16::splat(simd, 1.0));
        sharp.store_slice(&mut found.0[at..][..LANES]);
    }
}
