//! A band drawn at the pixel centres: the nearest piece of each, and the rims that touch a pixel.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, mask32x8};

use crate::project::{
    EightCells, EightQuads, EightTriangles, HALVES, LANES, Sink, Vertex, scan_triangle,
};
use crate::view::layer::RowRange;

/// Triangles over more pixel centres than this along an axis are drawn one by one.
const MOST_STEPS: f32 = 3.0;

/// A place this close outside an edge counts, px.
const SLACK: f32 = 1e-3;

/// The pieces at the centres of a band.
pub(super) struct Centres<'a> {
    pub(super) width: usize,
    pub(super) rows: [usize; 2],
    pub(super) nearness: &'a mut [f32],
    pub(super) patch: &'a mut [u32],
    pub(super) rim: &'a mut [f32],
}

/// The pieces, of eight, that cover a few pixel centres at most, and those centres.
pub(super) struct Small<S: Simd> {
    pub(super) some: mask32x8<S>,
    /// Column and row of the first centre.
    pub(super) first: [f32x8<S>; 2],
    /// From the first to the last.
    pub(super) steps: [f32x8<S>; 2],
}

/// Nearness over eight pieces.
pub(super) struct Near<S: Simd> {
    /// Twice the area of a triangle, and its corners: the plane is that of these.
    pub(super) triangle: [[f32x8<S>; 3]; 3],
    pub(super) area: f32x8<S>,
    /// Slivers extrapolate without bound inside the slack: the least and the greatest of the corners.
    pub(super) bounds: [f32x8<S>; 2],
}

/// An edge function of eight pieces, above 0 inside and [`SLACK`] around.
#[derive(Clone, Copy)]
pub(super) struct Edges<S: Simd> {
    /// At each piece's first centre.
    first: f32x8<S>,
    dx: f32x8<S>,
    dy: f32x8<S>,
}

impl<S: Simd> Small<S> {
    /// Most steps to the last centre, along columns and rows, of any piece that counts.
    #[inline(always)]
    pub(super) fn most_steps(&self, simd: S) -> [usize; 2] {
        let none = f32x8::splat(simd, -1.0);
        let [columns, rows] = self.steps;
        let most_columns = self.some.select(columns, none).reduce_max() as usize;
        let most_rows = self.some.select(rows, none).reduce_max() as usize;
        [most_columns, most_rows]
    }
}

impl<S: Simd> Near<S> {
    /// Nearness at a place, and what a step along x and along y adds.
    #[inline(always)]
    pub(super) fn plane(&self, simd: S, at: [f32x8<S>; 2]) -> [f32x8<S>; 3] {
        let [p, q, r] = self.triangle;
        let scale = f32x8::splat(simd, 1.0) / self.area;
        let mut plane = [f32x8::splat(simd, 0.0); 3];
        for (over, a, b) in [(p, q, r), (q, r, p), (r, p, q)] {
            let share = over[2] * scale;
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            plane[0] += share * (dx * (at[1] - a[1]) - dy * (at[0] - a[0]));
            plane[1] -= share * dy;
            plane[2] += share * dx;
        }
        plane
    }
}

impl<S: Simd> Edges<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, a: [f32x8<S>; 3], b: [f32x8<S>; 3], [x, y]: [f32x8<S>; 2]) -> Self {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let least = f32x8::splat(simd, -SLACK) * (dx.abs() + dy.abs());
        Self {
            first: dx * (y - a[1]) - dy * (x - a[0]) - least,
            dx,
            dy,
        }
    }

    /// The same without the slack: 0 on the edge itself.
    #[inline(always)]
    pub(super) fn without_slack(&self, simd: S) -> Self {
        let slack = f32x8::splat(simd, SLACK) * (self.dx.abs() + self.dy.abs());
        Self {
            first: self.first - slack,
            ..*self
        }
    }

    /// Of each piece this edge where `this` holds, else the other one.
    #[inline(always)]
    pub(super) fn or(&self, other: &Self, this: mask32x8<S>) -> Self {
        Self {
            first: this.select(self.first, other.first),
            dx: this.select(self.dx, other.dx),
            dy: this.select(self.dy, other.dy),
        }
    }

    /// Some columns and rows further.
    #[inline(always)]
    pub(super) fn at(&self, [columns, rows]: [f32x8<S>; 2]) -> f32x8<S> {
        self.first + self.dx * rows - self.dy * columns
    }
}

/// First centre and the steps to the last one within some range along an axis, cut at `clip`.
#[inline(always)]
fn centres_of<S: Simd>(simd: S, [low, high]: [f32x8<S>; 2], clip: [usize; 2]) -> [f32x8<S>; 2] {
    let constant = |v: f32| f32x8::splat(simd, v);
    let first = (low - constant(0.5 + SLACK)).ceil();
    let last = (high - constant(0.5 - SLACK)).floor();
    let first = first.max(constant(clip[0] as f32));
    [first, last.min(constant(clip[1] as f32 - 1.0)) - first]
}

impl Centres<'_> {
    /// Marks the pixels of a box that a rim of this nearness touches.
    #[inline(always)]
    fn mark(&mut self, PixelBox { columns, rows }: PixelBox, nearness: f32) {
        for row in rows[0]..=rows[1] {
            let first = (row - self.rows[0]) * self.width;
            for rim in &mut self.rim[first + columns[0]..=first + columns[1]] {
                *rim = rim.max(nearness);
            }
        }
    }

    /// Marks what the triangles in `some` touch.
    #[inline(always)]
    fn mark_all<S: Simd>(&mut self, simd: S, some: mask32x8<S>, triangles: &EightTriangles<S>) {
        if !some.any_true() {
            return;
        }
        let boxes = Boxes::new(simd, some, triangles.bounds(), self.width, self.rows);
        let [p, q, r] = triangles.0;
        self.mark_boxes(&boxes, p[2].max(q[2]).max(r[2]));
    }

    #[inline(always)]
    fn mark_boxes<S: Simd>(&mut self, boxes: &Boxes<S>, nearness: f32x8<S>) {
        let mut bits = boxes.some.to_bitmask();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            self.mark(boxes.lane(lane), nearness[lane]);
            bits &= bits - 1;
        }
    }

    /// Those of eight pieces that hold a few centres at most, and a bit for each that holds more.
    #[inline(always)]
    pub(super) fn small_ones<S: Simd>(
        &self,
        simd: S,
        some: mask32x8<S>,
        [x, y]: [[f32x8<S>; 2]; 2],
    ) -> (Small<S>, u64) {
        let constant = |v: f32| f32x8::splat(simd, v);
        let [left, columns] = centres_of(simd, x, [0, self.width]);
        let [top, rows] = centres_of(simd, y, self.rows);
        let some = some & columns.min(rows).simd_ge(constant(0.0));
        let large = some & columns.max(rows).simd_gt(constant(MOST_STEPS));
        let small = Small {
            some: some & !large,
            first: [left, top],
            steps: [columns, rows],
        };
        (small, large.to_bitmask())
    }

    /// Where the first centre of each piece lies in the band.
    #[inline(always)]
    pub(super) fn first_centres<S: Simd>(&self, simd: S, small: &Small<S>) -> i32x8<S> {
        let [left, top] = small.first;
        let above = f32x8::splat(simd, self.rows[0] as f32);
        let first = (top - above) * f32x8::splat(simd, self.width as f32) + left;
        first.to_int()
    }

    /// The triangles of `front`, which face the eye.
    #[inline(always)]
    fn eight_triangles<S: Simd>(
        &mut self,
        simd: S,
        triangles: &EightTriangles<S>,
        (front, area): (mask32x8<S>, f32x8<S>),
        id: impl Fn(usize) -> u32,
    ) {
        let (small, mut large) = self.small_ones(simd, front, triangles.bounds());
        while large != 0 {
            let lane = large.trailing_zeros() as usize;
            self.draw(simd, triangles.lane(lane), id(lane));
            large &= large - 1;
        }
        if small.some.any_true() {
            let [p, q, r] = triangles.0;
            let near = Near {
                triangle: [p, q, r],
                area,
                bounds: [p[2].min(q[2]).min(r[2]), p[2].max(q[2]).max(r[2])],
            };
            self.small(simd, &[p, q, r], &near, &small, id);
        }
    }

    /// Convex pieces with these corners over a few centres: the first centre of each, then the second, and so on.
    #[inline(always)]
    fn small<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        corners: &[[f32x8<S>; 3]; N],
        near: &Near<S>,
        small: &Small<S>,
        id: impl Fn(usize) -> u32,
    ) {
        let constant = |v: f32| f32x8::splat(simd, v);
        let [left, top] = small.first;
        let centre = [left + constant(0.5), top + constant(0.5)];
        let mut edges = [Edges::new(simd, corners[0], corners[1], centre); N];
        for k in 1..N {
            edges[k] = Edges::new(simd, corners[k], corners[(k + 1) % N], centre);
        }
        let plane = near.plane(simd, centre);
        let base = self.first_centres(simd, small).to_array();
        let [columns, rows] = small.steps;
        let [most_columns, most_rows] = small.most_steps(simd);
        for j in 0..=most_rows {
            for i in 0..=most_columns {
                let step = [constant(i as f32), constant(j as f32)];
                let mut least = edges[0].at(step);
                for edge in &edges[1..] {
                    least = least.min(edge.at(step));
                }
                let within = columns.simd_ge(step[0]) & rows.simd_ge(step[1]) & small.some;
                let inside = least.simd_ge(constant(0.0)) & within;
                let mut bits = inside.to_bitmask();
                if bits == 0 {
                    continue;
                }
                let found = plane[0] + plane[1] * step[0] + plane[2] * step[1];
                let found = found.max(near.bounds[0]).min(near.bounds[1]).to_array();
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize;
                    let at = base[lane] as usize + j * self.width + i;
                    self.put(at, found[lane], id(lane));
                    bits &= bits - 1;
                }
            }
        }
    }

    #[inline(always)]
    pub(super) fn put(&mut self, at: usize, nearness: f32, id: u32) {
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
        let triangles = [cells.triangles(0), cells.triangles(1)];
        let areas = [triangles[0].area(), triangles[1].area()];
        let fronts = [
            areas[0].simd_gt(zero) & joined,
            areas[1].simd_gt(zero) & joined,
        ];
        let whole = self.eight_cells(simd, cells, &triangles, (fronts[0] & fronts[1], areas));
        // Cells that are turned in part, or drawn large, are taken by triangles.
        let rest = joined & !whole;
        if !rest.any_true() {
            return;
        }
        for k in 0..2 {
            let turned = areas[k].simd_le(zero) & rest;
            self.mark_all(simd, turned, &triangles[k]);
            let front = (fronts[k] & rest, areas[k]);
            self.eight_triangles(simd, &triangles[k], front, |lane| cells.id(lane, k));
        }
    }

    #[inline(always)]
    fn quads<S: Simd>(&mut self, simd: S, quads: &EightQuads<S>, id: impl Fn(usize) -> u32) {
        if quads.halves.any_true() {
            let zero = f32x8::splat(simd, 0.0);
            for half in HALVES {
                let triangles = quads.half(half);
                let area = triangles.area();
                let known = area.simd_eq(area) & quads.halves;
                self.mark_all(simd, known, &triangles);
                let front = area.simd_gt(zero) & quads.halves;
                self.eight_triangles(simd, &triangles, (front, area), &id);
            }
        }
        if !quads.whole.any_true() {
            return;
        }
        let [p, q, r, s] = quads.corners;
        let bounds = [
            p[2].min(q[2]).min(r[2].min(s[2])),
            p[2].max(q[2]).max(r[2].max(s[2])),
        ];
        let on_screen = quads.bounds();
        let boxes = Boxes::new(simd, quads.whole, on_screen, self.width, self.rows);
        self.mark_boxes(&boxes, bounds[1]);
        let (small, mut large) = self.small_ones(simd, quads.whole, on_screen);
        while large != 0 {
            let lane = large.trailing_zeros() as usize;
            for half in HALVES {
                self.draw(simd, quads.half(half).lane(lane), id(lane));
            }
            large &= large - 1;
        }
        if small.some.any_true() {
            let near = Near {
                triangle: [p, q, r],
                area: EightTriangles([p, q, r]).area(),
                bounds,
            };
            self.small(simd, &quads.corners, &near, &small, id);
        }
    }

    fn wants(&self, _columns: RowRange, _rows: RowRange) -> bool {
        true
    }
}

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
