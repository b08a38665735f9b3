//! Joined cells, eight of a row at a time.
//!
//! At unit scale a cell holds about one pixel centre, so what a cell costs is what its set-up costs. Eight neighbours
//! share it: their corners are two rows of samples, loaded once and once more a sample further.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8, u32x8};

use crate::project::warped::{LANES, Vertex};
use crate::surfaces::surface::{ANTI, KINDS, patch_id};
use crate::view::layer::RowRange;

/// 0 to 7.
const NUMBERS: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7];

/// Eight cells of a row of which some are joined.
#[derive(Clone, Copy)]
pub(crate) struct EightCells<S: Simd> {
    /// Screen x, screen y and nearness of the corners: top left, top right, bottom left, bottom right.
    corners: [[f32x8<S>; 3]; 4],
    /// The joined cells.
    pub(crate) joined: u64,
    /// The cells that share the main diagonal.
    main: mask32x8<S>,
    /// The same, one bit each.
    main_bits: u64,
    /// The first cell.
    first: usize,
}

/// One triangle of each of eight cells: screen x, screen y and nearness of its three corners.
pub(crate) struct EightTriangles<S: Simd>(pub(crate) [[f32x8<S>; 3]; 3]);

impl<S: Simd> EightCells<S> {
    /// The cells from `cell` on, the first of which has its left corners `at` so many samples from the first of the two `rows`
    /// of samples; the bits say which cells are joined, and which of them along the main diagonal.
    #[inline(always)]
    pub(crate) fn load(
        simd: S,
        rows: &[[&[f32]; 3]; 2],
        at: usize,
        cell: usize,
        [joined, main]: [u32; 2],
    ) -> Self {
        let mut corners = [[f32x8::splat(simd, 0.0); 3]; 4];
        for (number, corner) in corners.iter_mut().enumerate() {
            let (row, from) = (&rows[number / 2], at + number % 2);
            for (values, plane) in corner.iter_mut().zip(row) {
                *values = f32x8::from_slice(simd, &plane[from..from + LANES]);
            }
        }
        let bits = |bits: u32| u64::from(bits & 0xff);
        Self {
            corners,
            joined: bits(joined),
            main: mask32x8::from_bitmask(simd, bits(main)),
            main_bits: bits(main),
            first: cell,
        }
    }

    /// The number of a piece.
    #[inline(always)]
    pub(crate) fn id(&self, lane: usize, triangle: usize) -> u32 {
        let other = ANTI * (1 - (self.main_bits >> lane & 1) as u32);
        patch_id(self.first + lane, other + triangle as u32)
    }

    /// The numbers of one piece of each cell: its first triangle or its second one.
    #[inline(always)]
    pub(crate) fn ids(&self, simd: S, on_first: mask32x8<S>) -> u32x8<S> {
        let constant = |v: u32| u32x8::splat(simd, v);
        let cells = constant(self.first as u32) + u32x8::simd_from(simd, NUMBERS);
        let other = self.main.select(constant(0), constant(ANTI));
        let triangle = on_first.select(constant(0), constant(1));
        cells * constant(KINDS) + other + triangle
    }

    /// Screen x, screen y and nearness of the corners: top left, top right, bottom left, bottom right.
    #[inline(always)]
    pub(crate) fn corners(&self) -> &[[f32x8<S>; 3]; 4] {
        &self.corners
    }

    /// Returns the cells that share the main diagonal.
    #[inline(always)]
    pub(crate) fn main(&self) -> mask32x8<S> {
        self.main
    }

    /// Corners of the cells that share the main diagonal from `on_main`, of the others from `on_other`.
    #[inline(always)]
    pub(crate) fn by_diagonal(
        &self,
        on_main: [f32x8<S>; 3],
        on_other: [f32x8<S>; 3],
    ) -> [f32x8<S>; 3] {
        let mut corner = on_main;
        for (to, other) in corner.iter_mut().zip(on_other) {
            *to = self.main.select(*to, other);
        }
        corner
    }

    /// Screen columns and rows of those of the cells in `some`. A corner that is nowhere is left out.
    #[inline(always)]
    pub(crate) fn bounds(&self, simd: S, some: mask32x8<S>) -> [RowRange; 2] {
        let mut ranges = [RowRange::EMPTY; 2];
        for (axis, range) in ranges.iter_mut().enumerate() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| self.corners[corner][axis]);
            let constant = |v: f32| f32x8::splat(simd, v);
            let low = a.min_precise(b).min_precise(c.min_precise(d));
            let high = a.max_precise(b).max_precise(c.max_precise(d));
            let some = some & low.simd_eq(low);
            let low = some.select(low, constant(f32::INFINITY));
            let high = some.select(high, constant(f32::NEG_INFINITY));
            *range = RowRange {
                low: low.reduce_min(),
                high: high.reduce_max(),
            };
        }
        ranges
    }

    /// One of the two triangles of each cell.
    #[inline(always)]
    pub(crate) fn triangles(&self, triangle: usize) -> EightTriangles<S> {
        let [a, b, c, d] = self.corners;
        EightTriangles(if triangle == 0 {
            [a, b, self.by_diagonal(d, c)]
        } else {
            [self.by_diagonal(a, b), d, c]
        })
    }
}

impl<S: Simd> EightTriangles<S> {
    /// Twice the area, px^2: above 0 where the triangle faces the eye.
    #[inline(always)]
    pub(crate) fn area(&self) -> f32x8<S> {
        let [p, q, r] = self.0;
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    }

    /// Least and greatest screen x and y of each.
    #[inline(always)]
    pub(crate) fn bounds(&self) -> [[f32x8<S>; 2]; 2] {
        let [p, q, r] = self.0;
        let of = |i: usize| [p[i].min(q[i]).min(r[i]), p[i].max(q[i]).max(r[i])];
        [of(0), of(1)]
    }

    /// One of the triangles.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> [Vertex; 3] {
        let corner = |v: &[f32x8<S>; 3]| Vertex {
            x: v[0][lane],
            y: v[1][lane],
            nearness: v[2][lane],
        };
        let [p, q, r] = &self.0;
        [corner(p), corner(q), corner(r)]
    }
}

/// Screen x, screen y and nearness of the four corners of eight quarters at cuts.
pub(crate) type QuadBlock = [[[f32; LANES]; 3]; 4];

/// Eight quarters of which some are at hand.
#[derive(Clone, Copy)]
pub(crate) struct EightQuads<S: Simd> {
    /// Screen x, screen y and nearness of the corners, around.
    pub(crate) corners: [[f32x8<S>; 3]; 4],
    /// Convex ones that face the eye, whole.
    pub(crate) whole: mask32x8<S>,
    /// Those of which the two triangles are to be taken one by one.
    pub(crate) halves: mask32x8<S>,
}

impl<S: Simd> EightQuads<S> {
    /// The quarters of a block, those of `some` bits.
    #[inline(always)]
    pub(crate) fn load(simd: S, block: &QuadBlock, some: u64) -> Self {
        let mut corners = [[f32x8::splat(simd, 0.0); 3]; 4];
        for (corner, from) in corners.iter_mut().zip(block) {
            for (values, from) in corner.iter_mut().zip(from) {
                *values = f32x8::from_slice(simd, from);
            }
        }
        let [p, q, r, s] = corners;
        let some = mask32x8::from_bitmask(simd, some);
        let area = |a: usize, b: usize, c: usize| {
            EightTriangles([corners[a], corners[b], corners[c]]).area()
        };
        let least = area(0, 1, 2).min(area(0, 2, 3));
        let least = least.min(area(0, 1, 3)).min(area(1, 2, 3));
        let seen =
            p[0].simd_eq(p[0]) & q[0].simd_eq(q[0]) & r[0].simd_eq(r[0]) & s[0].simd_eq(s[0]);
        let whole = some & seen & least.simd_gt(f32x8::splat(simd, 0.0));
        Self {
            corners,
            whole,
            halves: some & !whole,
        }
    }

    /// One of the two triangles of each.
    #[inline(always)]
    pub(crate) fn half(&self, [a, b, c]: [usize; 3]) -> EightTriangles<S> {
        EightTriangles([self.corners[a], self.corners[b], self.corners[c]])
    }

    /// The corners of one of the quarters.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> [Vertex; 4] {
        let [p, q, r] = self.half(HALVES[0]).lane(lane);
        let [_, _, s] = self.half(HALVES[1]).lane(lane);
        [p, q, r, s]
    }

    /// Least and greatest screen x and y of each.
    #[inline(always)]
    pub(crate) fn bounds(&self) -> [[f32x8<S>; 2]; 2] {
        let [p, q, r, s] = self.corners;
        let of = |i: usize| {
            let low = p[i].min(q[i]).min(r[i].min(s[i]));
            let high = p[i].max(q[i]).max(r[i].max(s[i]));
            [low, high]
        };
        [of(0), of(1)]
    }
}

/// The two triangles of a quarter.
pub(crate) const HALVES: [[usize; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

// Triangles on a lattice of screen positions: which places lie inside, and how near the triangle is there.
//
// Edge functions and nearness are linear over the screen, so eight places of a row are asked at once. A place on an
// edge counts for both sides, and a little beyond it, so that rounding opens no crack between neighbours.

/// A place this close outside an edge counts, px.
pub(crate) const SLACK: f32 = 1e-3;

/// 0 to 7.
const STEPS: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// An edge function along a row.
#[derive(Clone, Copy)]
struct Edge {
    from: Vertex,
    dx: f32,
    dy: f32,
    least: f32,
}

impl Edge {
    fn new(from: Vertex, to: Vertex) -> Self {
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        Self {
            from,
            dx,
            dy,
            least: -SLACK * (dx.abs() + dy.abs()),
        }
    }

    #[inline(always)]
    fn along<S: Simd>(&self, simd: S, x: f32x8<S>, y: f32) -> f32x8<S> {
        let constant = |v: f32| f32x8::splat(simd, v);
        constant(self.dx * (y - self.from.y)) - constant(self.dy) * (x - constant(self.from.x))
    }
}

/// Calls `put(column, row, nearness)` for the places of a lattice inside a triangle that faces the eye. Coordinates are
/// in places, whole numbers at the places themselves; `clip` is the first and end column and row.
#[inline(always)]
pub(crate) fn scan_triangle<S: Simd>(
    simd: S,
    corners: [Vertex; 3],
    clip: [[i32; 2]; 2],
    mut put: impl FnMut(i32, i32, f32),
) {
    let [p, q, r] = corners;
    let Some([columns, rows]) = places_of(corners, clip) else {
        return;
    };
    let area = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    let edges = [Edge::new(q, r), Edge::new(r, p), Edge::new(p, q)];
    let constant = |v: f32| f32x8::splat(simd, v);
    let [near_p, near_q, near_r] = [
        constant(p.nearness / area),
        constant(q.nearness / area),
        constant(r.nearness / area),
    ];
    // Slivers extrapolate without bound inside the slack.
    let nearest = constant(p.nearness.max(q.nearness).max(r.nearness));
    let farthest = constant(p.nearness.min(q.nearness).min(r.nearness));
    for row in rows[0]..=rows[1] {
        for first in (columns[0]..=columns[1]).step_by(LANES) {
            let x = constant(first as f32) + f32x8::from_slice(simd, &STEPS);
            let u = edges[0].along(simd, x, row as f32);
            let v = edges[1].along(simd, x, row as f32);
            let w = edges[2].along(simd, x, row as f32);
            let inside = u.simd_ge(constant(edges[0].least))
                & v.simd_ge(constant(edges[1].least))
                & w.simd_ge(constant(edges[2].least));
            let left = (columns[1] - first + 1).min(LANES as i32) as u32;
            let mut bits = inside.to_bitmask() & ((1 << left) - 1);
            if bits == 0 {
                continue;
            }
            let near = u * near_p + v * near_q + w * near_r;
            let near = near.max(farthest).min(nearest).to_array();
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                put(first + lane as i32, row, near[lane]);
                bits &= bits - 1;
            }
        }
    }
}

/// First and last column and row of the places that a triangle may hold.
#[inline(always)]
fn places_of(corners: [Vertex; 3], clip: [[i32; 2]; 2]) -> Option<[[i32; 2]; 2]> {
    let [p, q, r] = corners;
    let range = |a: f32, b: f32, c: f32, clip: [i32; 2]| {
        let low = (a.min(b).min(c) - SLACK).ceil().max(clip[0] as f32);
        let high = (a.max(b).max(c) + SLACK).floor().min(clip[1] as f32 - 1.0);
        (low <= high).then_some([low as i32, high as i32])
    };
    Some([
        range(p.x, q.x, r.x, clip[0])?,
        range(p.y, q.y, r.y, clip[1])?,
    ])
}
