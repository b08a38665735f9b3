//! A band drawn at the pixel centres: the nearest piece of each, and the rims that touch a pixel.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, mask32x8};

use super::pixels::pixels_of;
use crate::bands::RowRange;
use crate::raster::{EightCells, EightTriangles, Sink, Vertex, scan_triangle};

/// Triangles over more pixel centres than this along an axis are drawn one by one.
const MOST_STEPS: f32 = 3.0;

/// A place this close outside an edge counts, px.
const SLACK: f32 = 1e-3;

/// What the centres of a band see.
pub(super) struct Centres<'a> {
    pub(super) width: usize,
    pub(super) rows: [usize; 2],
    pub(super) nearness: &'a mut [f32],
    pub(super) patch: &'a mut [u32],
    pub(super) rim: &'a mut [f32],
}

/// Which of eight triangles cover a few pixel centres at most, and which those may be.
struct Small<S: Simd> {
    some: mask32x8<S>,
    area: f32x8<S>,
    /// Column and row of the first centre.
    first: [f32x8<S>; 2],
    /// From the first to the last.
    steps: [f32x8<S>; 2],
}

/// An edge function of eight triangles, above 0 inside and [`SLACK`] around.
struct Edges<S: Simd> {
    /// At each triangle's first centre.
    first: f32x8<S>,
    dx: f32x8<S>,
    dy: f32x8<S>,
    /// What the slack has taken away.
    least: f32x8<S>,
}

impl<S: Simd> Edges<S> {
    #[inline(always)]
    fn new(simd: S, a: [f32x8<S>; 3], b: [f32x8<S>; 3], [x, y]: [f32x8<S>; 2]) -> Self {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let least = f32x8::splat(simd, -SLACK) * (dx.abs() + dy.abs());
        Self {
            first: dx * (y - a[1]) - dy * (x - a[0]) - least,
            dx,
            dy,
            least,
        }
    }

    /// Some columns and rows further.
    #[inline(always)]
    fn at(&self, [columns, rows]: [f32x8<S>; 2]) -> f32x8<S> {
        self.first + self.dx * rows - self.dy * columns
    }
}

/// First and last centre between the corners of triangles along an axis, cut at `clip`.
#[inline(always)]
fn pixel_range<S: Simd>(
    simd: S,
    [p, q, r]: [f32x8<S>; 3],
    clip: [usize; 2],
) -> (f32x8<S>, f32x8<S>) {
    let constant = |v: f32| f32x8::splat(simd, v);
    let low = p.min(q).min(r) - constant(0.5 + SLACK);
    let high = p.max(q).max(r) - constant(0.5 - SLACK);
    (
        low.ceil().max(constant(clip[0] as f32)),
        high.floor().min(constant(clip[1] as f32 - 1.0)),
    )
}

impl Centres<'_> {
    #[inline(always)]
    fn mark(&mut self, corners: [Vertex; 3]) {
        let Some([columns, rows]) = pixels_of(corners, self.width, self.rows) else {
            return;
        };
        let nearness = corners
            .iter()
            .fold(f32::NEG_INFINITY, |n, v| n.max(v.nearness));
        for row in rows[0]..=rows[1] {
            let first = (row - self.rows[0]) * self.width;
            for rim in &mut self.rim[first + columns[0]..=first + columns[1]] {
                *rim = rim.max(nearness);
            }
        }
    }

    /// The triangles of `front`, which face the eye.
    #[inline(always)]
    fn eight_triangles<S: Simd>(
        &mut self,
        simd: S,
        triangles: &EightTriangles<S>,
        front: mask32x8<S>,
        area: f32x8<S>,
        id: impl Fn(usize) -> u32,
    ) {
        let constant = |v: f32| f32x8::splat(simd, v);
        let [p, q, r] = triangles.0;
        let (left, right) = pixel_range(simd, [p[0], q[0], r[0]], [0, self.width]);
        let (top, bottom) = pixel_range(simd, [p[1], q[1], r[1]], self.rows);
        let steps = [right - left, bottom - top];
        let some = front & steps[0].min(steps[1]).simd_ge(constant(0.0));
        let large = some & steps[0].max(steps[1]).simd_gt(constant(MOST_STEPS));
        let mut bits = large.to_bitmask();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            self.draw(simd, triangles.lane(lane), id(lane));
            bits &= bits - 1;
        }
        let some = some & !large;
        if some.any_true() {
            self.small(
                simd,
                triangles,
                &Small {
                    some,
                    area,
                    first: [left, top],
                    steps,
                },
                id,
            );
        }
    }

    /// Triangles over a few centres: the first centre of each, then the second, and so on.
    #[inline(always)]
    fn small<S: Simd>(
        &mut self,
        simd: S,
        triangles: &EightTriangles<S>,
        small: &Small<S>,
        id: impl Fn(usize) -> u32,
    ) {
        let constant = |v: f32| f32x8::splat(simd, v);
        let [p, q, r] = triangles.0;
        let [left, top] = small.first;
        let centre = [left + constant(0.5), top + constant(0.5)];
        let (u, v, w) = (
            Edges::new(simd, q, r, centre),
            Edges::new(simd, r, p, centre),
            Edges::new(simd, p, q, centre),
        );
        let scale = constant(1.0) / small.area;
        let (near_p, near_q, near_r) = (p[2] * scale, q[2] * scale, r[2] * scale);
        // Slivers extrapolate without bound inside the slack.
        let (nearest, farthest) = (p[2].max(q[2]).max(r[2]), p[2].min(q[2]).min(r[2]));
        let base = (top - constant(self.rows[0] as f32)) * constant(self.width as f32) + left;
        let base = base.to_int::<i32x8<S>>().to_array();
        let [columns, rows] = small.steps;
        let none = constant(-1.0);
        let most_columns = small.some.select(columns, none).reduce_max() as usize;
        let most_rows = small.some.select(rows, none).reduce_max() as usize;
        for j in 0..=most_rows {
            for i in 0..=most_columns {
                let step = [constant(i as f32), constant(j as f32)];
                let (u_at, v_at, w_at) = (u.at(step), v.at(step), w.at(step));
                let within = columns.simd_ge(step[0]) & rows.simd_ge(step[1]) & small.some;
                let inside = u_at.min(v_at).min(w_at).simd_ge(constant(0.0)) & within;
                let mut bits = inside.to_bitmask();
                if bits == 0 {
                    continue;
                }
                let near = (u_at + u.least) * near_p
                    + (v_at + v.least) * near_q
                    + (w_at + w.least) * near_r;
                let near = near.max(farthest).min(nearest).to_array();
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize;
                    self.put(
                        base[lane] as usize + j * self.width + i,
                        near[lane],
                        id(lane),
                    );
                    bits &= bits - 1;
                }
            }
        }
    }

    #[inline(always)]
    fn put(&mut self, at: usize, nearness: f32, id: u32) {
        if nearness > self.nearness[at] {
            self.nearness[at] = nearness;
            self.patch[at] = id;
        }
    }

    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, corners: [Vertex; 3], id: u32) {
        let clip = [
            [0, self.width as i32],
            [self.rows[0] as i32, self.rows[1] as i32],
        ];
        let [p, q, r] = corners;
        let centred = |v: Vertex| Vertex {
            x: v.x - 0.5,
            y: v.y - 0.5,
            ..v
        };
        scan_triangle(
            simd,
            [centred(p), centred(q), centred(r)],
            clip,
            |column, row, nearness| {
                self.put(
                    (row - clip[1][0]) as usize * self.width + column as usize,
                    nearness,
                    id,
                );
            },
        );
    }
}

impl Sink for Centres<'_> {
    #[inline(always)]
    fn eight<S: Simd>(&mut self, simd: S, cells: &EightCells<S>) {
        let zero = f32x8::splat(simd, 0.0);
        let joined = mask32x8::from_bitmask(simd, cells.joined);
        for k in 0..2 {
            let triangles = cells.triangles(k);
            let area = triangles.area();
            let mut back = (area.simd_le(zero) & joined).to_bitmask();
            while back != 0 {
                self.mark(triangles.lane(back.trailing_zeros() as usize));
                back &= back - 1;
            }
            let front = area.simd_gt(zero) & joined;
            self.eight_triangles(simd, &triangles, front, area, |lane| cells.id(lane, k));
        }
    }

    #[inline(always)]
    fn rim<S: Simd>(&mut self, simd: S, corners: [Vertex; 3], id: u32) {
        self.mark(corners);
        self.draw(simd, corners, id);
    }

    fn wants(&self, _columns: RowRange, _rows: RowRange) -> bool {
        true
    }

    fn turned_away(&mut self, corners: [Vertex; 3]) {
        self.mark(corners);
    }
}
