//! Whole cells at the pixel centres: both triangles of eight cells together.
//!
//! The triangles share their bounds, and a centre lies on the one side of the diagonal or on the other, so that four
//! outer edges and the diagonal are asked instead of twice three edges.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, mask32x8, u32x8};

use crate::hybrid::centres::{Centres, Edges, Near, Small};
use crate::project::{EightCells, EightTriangles, LANES};

/// 0 to 7.
const NUMBERS: [i32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7];

/// Eight cells whose two triangles face the eye, from the first centre of each on.
struct Halves<S: Simd> {
    /// Above 0 on the side of the first triangle.
    diagonal: Edges<S>,
    /// The other two edges of each triangle.
    outer: [[Edges<S>; 2]; 2],
    /// Nearness of each triangle, and its change along x and y.
    planes: [[f32x8<S>; 3]; 2],
    /// Least and greatest nearness of the corners.
    bounds: [f32x8<S>; 2],
}

impl<S: Simd> Halves<S> {
    #[inline(always)]
    fn new(
        simd: S,
        cells: &EightCells<S>,
        (triangles, areas): (&[EightTriangles<S>; 2], [f32x8<S>; 2]),
        centre: [f32x8<S>; 2],
    ) -> Self {
        let [a, b, c, d] = *cells.corners();
        let right = Edges::new(simd, b, d, centre);
        let left = Edges::new(simd, c, a, centre);
        let bounds = [
            a[2].min(b[2]).min(c[2].min(d[2])),
            a[2].max(b[2]).max(c[2].max(d[2])),
        ];
        let mut planes = [[a[0]; 3]; 2];
        for k in 0..2 {
            let near = Near {
                triangle: triangles[k].0,
                area: areas[k],
                bounds,
            };
            planes[k] = near.plane(simd, centre);
        }
        // The first triangle has the right edge if the cell shares the main diagonal, else the left one.
        let (from, to) = (cells.by_diagonal(d, b), cells.by_diagonal(a, c));
        Self {
            diagonal: Edges::new(simd, from, to, centre).without_slack(simd),
            outer: [
                [
                    Edges::new(simd, a, b, centre),
                    right.or(&left, cells.main()),
                ],
                [
                    Edges::new(simd, d, c, centre),
                    left.or(&right, cells.main()),
                ],
            ],
            planes,
            bounds,
        }
    }

    /// The centres in the cells some steps further, and those on the first triangle.
    #[inline(always)]
    fn inside(&self, simd: S, step: [f32x8<S>; 2]) -> (mask32x8<S>, mask32x8<S>) {
        let zero = f32x8::splat(simd, 0.0);
        let on_first = self.diagonal.at(step).simd_ge(zero);
        let [[a, b], [c, d]] = &self.outer;
        let (first, second) = (a.at(step).min(b.at(step)), c.at(step).min(d.at(step)));
        (on_first.select(first, second).simd_ge(zero), on_first)
    }

    /// Nearness there.
    #[inline(always)]
    fn nearness(&self, on_first: mask32x8<S>, [x, y]: [f32x8<S>; 2]) -> f32x8<S> {
        let [p, q] = &self.planes;
        let (first, second) = (p[0] + p[1] * x + p[2] * y, q[0] + q[1] * x + q[2] * y);
        let found = on_first.select(first, second);
        found.max(self.bounds[0]).min(self.bounds[1])
    }
}

/// Those of eight cells whose first centres lie side by side as the cells do.
struct CentreRow<S: Simd> {
    /// The first centre of the first cell.
    first: usize,
    cells: mask32x8<S>,
}

impl Centres<'_> {
    /// Those of the cells in `some` whose first centres `base` follow each other: where a reference is seen at about its own
    /// scale, most of them, so that they are drawn without a look at each.
    #[inline(always)]
    fn row_of<S: Simd>(&self, simd: S, base: i32x8<S>, some: mask32x8<S>) -> CentreRow<S> {
        let lane = some.to_bitmask().trailing_zeros() as i32;
        let first = base.to_array()[lane as usize] - lane;
        let expected = i32x8::simd_from(simd, NUMBERS) + i32x8::splat(simd, first);
        let cells = base.simd_eq(expected) & some & expected.simd_ge(i32x8::splat(simd, 0));
        // A row that begins before the band is taken cell by cell.
        CentreRow {
            first: if first < 0 {
                usize::MAX / 2
            } else {
                first as usize
            },
            cells,
        }
    }

    /// As [`Self::put`], for centres side by side from `at` on, of which some are `seen`.
    #[inline(always)]
    fn put_row<S: Simd>(
        &mut self,
        simd: S,
        at: usize,
        seen: mask32x8<S>,
        (found, ids): (f32x8<S>, u32x8<S>),
    ) {
        let nearness = &mut self.nearness[at..at + LANES];
        let before = f32x8::from_slice(simd, nearness);
        let nearer = seen & found.simd_gt(before);
        nearer.select(found, before).store_slice(nearness);
        let patch = &mut self.patch[at..at + LANES];
        let before = u32x8::from_slice(simd, patch);
        nearer.select(ids, before).store_slice(patch);
    }

    /// Draws those of eight cells in `fronts`, whose two triangles face the eye, that cover a few centres at most; which
    /// these are, and those that cover none.
    #[inline(always)]
    pub(super) fn eight_cells<S: Simd>(
        &mut self,
        simd: S,
        cells: &EightCells<S>,
        triangles: &[EightTriangles<S>; 2],
        (fronts, areas): (mask32x8<S>, [f32x8<S>; 2]),
    ) -> mask32x8<S> {
        let [a, b, c, d] = cells.corners();
        let mut bounds = [[a[0]; 2]; 2];
        for (i, bounds) in bounds.iter_mut().enumerate() {
            *bounds = [
                a[i].min(b[i]).min(c[i].min(d[i])),
                a[i].max(b[i]).max(c[i].max(d[i])),
            ];
        }
        let (small, large) = self.small_ones(simd, fronts, bounds);
        if small.some.any_true() {
            let half = f32x8::splat(simd, 0.5);
            let centre = [small.first[0] + half, small.first[1] + half];
            let halves = Halves::new(simd, cells, (triangles, areas), centre);
            self.small_cells(simd, cells, &halves, &small);
        }
        fronts & !mask32x8::from_bitmask(simd, large)
    }

    /// The first centre of each cell, then the second, and so on.
    #[inline(always)]
    fn small_cells<S: Simd>(
        &mut self,
        simd: S,
        cells: &EightCells<S>,
        halves: &Halves<S>,
        small: &Small<S>,
    ) {
        let constant = |v: f32| f32x8::splat(simd, v);
        let base = self.first_centres(simd, small);
        let row = self.row_of(simd, base, small.some);
        let base = base.to_array();
        let [columns, rows] = small.steps;
        let [most_columns, most_rows] = small.most_steps(simd);
        for j in 0..=most_rows {
            for i in 0..=most_columns {
                let step = [constant(i as f32), constant(j as f32)];
                let within = columns.simd_ge(step[0]) & rows.simd_ge(step[1]) & small.some;
                let (inside, on_first) = halves.inside(simd, step);
                let inside = inside & within;
                if !inside.any_true() {
                    continue;
                }
                let found = halves.nearness(on_first, step);
                let at = row.first + j * self.width + i;
                let mut bits = (inside & !row.cells).to_bitmask();
                if at + LANES <= self.nearness.len() {
                    let seen = inside & row.cells;
                    self.put_row(simd, at, seen, (found, cells.ids(simd, on_first)));
                } else {
                    bits = inside.to_bitmask();
                }
                if bits == 0 {
                    continue;
                }
                let found = found.to_array();
                let on_first = on_first.to_bitmask();
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize;
                    let at = base[lane] as usize + j * self.width + i;
                    let triangle = 1 - (on_first >> lane & 1) as usize;
                    self.put(at, found[lane], cells.id(lane, triangle));
                    bits &= bits - 1;
                }
            }
        }
    }
}
