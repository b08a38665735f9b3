//! Surfaces laid on the screen: which piece of a reference each place of a lattice of screen positions sees.
//!
//! Samples are warped once; their cells are scan-converted band by band. Joined cells share their corners, so there are
//! no cracks; cut cells give each corner its quarter on its own tangent plane. Turned-away pieces are dropped.
//!
//! Limits: a piece with a corner before the near plane is dropped whole; it is smaller than a sample's spacing.

use glam::DVec2;
use rayon::prelude::*;

use crate::bands::RowRange;
use crate::epipole::OcclusionOrder;
use crate::patch::patch_id;
use crate::rims::Rims;
use crate::surface::{Cell, Surfaces};
use crate::warp::Warp;

/// Cells of a row that share one entry in the table of screen rows.
const SEGMENT: usize = 32;

/// A sample or another corner on the screen; x is NaN where it is not in front of the near plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    /// Screen x, px.
    pub(crate) x: f32,
    /// Screen y, px.
    pub(crate) y: f32,
    /// Larger is nearer; linear over the screen on a plane.
    pub(crate) nearness: f32,
}

/// Samples warped to one screen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Projected {
    vertices: Vec<Vertex>,
    /// Screen columns and rows that each segment of each row of cells touches.
    segments: Vec<[RowRange; 2]>,
}

/// What receives the pieces of a band.
pub(crate) trait Sink {
    /// A triangle that faces the eye, in px; `is_rim` if it borders on a cut.
    fn triangle(&mut self, corners: [Vertex; 3], id: u32, rim: Rim);
    /// Whether anything within these columns and rows (px) can matter.
    fn wants(&self, columns: RowRange, rows: RowRange) -> bool;
    /// A triangle that is turned away.
    fn turned_away(&mut self, corners: [Vertex; 3]);
}

/// Whether a piece lies on the rim of its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rim {
    /// Inside the surface.
    Inside,
    /// The quarter of a sample at a cut.
    Rim,
}

impl Projected {
    /// Warps every sample.
    pub(crate) fn project(&mut self, surfaces: &Surfaces, warp: &Warp, cuts: &Rims) {
        let [width, height] = surfaces.size;
        self.vertices.resize(width * height, Vertex::NOWHERE);
        self.vertices.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            let mut along = warp.row(y as u32);
            for (vertex, &disparity) in row.iter_mut().zip(&surfaces.disparity[y * width..]) {
                let known = !disparity.is_nan();
                let warped = along.next(if known { f64::from(disparity) } else { 0.0 });
                *vertex = if known { Vertex::of(warp, &warped) } else { Vertex::NOWHERE };
            }
        });
        let per_row = (width + 1).div_ceil(SEGMENT);
        self.segments.resize(per_row * (height + 1), [RowRange::EMPTY; 2]);
        let vertices = &self.vertices;
        self.segments.par_iter_mut().enumerate().for_each(|(index, range)| {
            *range = [RowRange::EMPTY; 2];
            let (cy, first) = (index / per_row, index % per_row * SEGMENT);
            for cx in first..(first + SEGMENT).min(width + 1) {
                each_corner(surfaces, vertices, warp, (cx, cy), cuts, &mut |v| {
                    range[0].include(v.x);
                    range[1].include(v.y);
                });
            }
        });
    }

    /// Number of warped samples that are in front of the near plane.
    pub(crate) fn in_front(&self) -> u64 {
        self.vertices.iter().filter(|v| !v.x.is_nan()).count() as u64
    }

    /// Gives the pieces that touch the screen rows `rows` to `sink`, in reference order or in `order`.
    pub(crate) fn visit(
        &self,
        scene: &Scene<'_>,
        rows: [usize; 2],
        order: Option<OcclusionOrder>,
        sink: &mut impl Sink,
    ) {
        let [width, height] = scene.surfaces.size;
        let per_row = (width + 1).div_ceil(SEGMENT);
        let touches = |cx: usize, cy: usize, sink: &mut dyn FnMut(RowRange, RowRange) -> bool| {
            let [columns, along] = self.segments[cy * per_row + cx / SEGMENT];
            along.touches(rows[0], rows[1]) && sink(columns, along)
        };
        match order {
            None => {
                for cy in 0..=height {
                    for segment in 0..per_row {
                        if !touches(segment * SEGMENT, cy, &mut |c, r| sink.wants(c, r)) {
                            continue;
                        }
                        for cx in segment * SEGMENT..((segment + 1) * SEGMENT).min(width + 1) {
                            self.visit_cell(scene, (cx, cy), sink);
                        }
                    }
                }
            }
            Some(order) => {
                for cy in order.rows.indices() {
                    for cx in order.columns.indices() {
                        if touches(cx as usize, cy as usize, &mut |_, _| true) {
                            self.visit_cell(scene, (cx as usize, cy as usize), sink);
                        }
                    }
                }
            }
        }
    }

    fn visit_cell(&self, scene: &Scene<'_>, (cx, cy): (usize, usize), sink: &mut impl Sink) {
        let width = scene.surfaces.size[0];
        let cell = cy * (width + 1) + cx;
        let kind = scene.surfaces.cells[cell];
        let mut emit = |corners: [Vertex; 3], id: u32, rim: Rim| {
            let [p, q, r] = corners;
            let area = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
            if area > 0.0 {
                sink.triangle(corners, id, rim);
            } else if area <= 0.0 {
                sink.turned_away(corners);
            }
        };
        match kind {
            Cell::Empty => {}
            Cell::Cut => {
                for corner in 0..4 {
                    if let Some([p, q, r, s]) =
                        quarter(scene.surfaces, scene.warp, (cx, cy), corner, scene.cuts)
                    {
                        let id = patch_id(cell, corner as u32 + 2);
                        emit([p, q, r], id, Rim::Rim);
                        emit([p, r, s], id, Rim::Rim);
                    }
                }
            }
            Cell::MainDiagonal | Cell::AntiDiagonal => {
                let first = (cy - 1) * width + cx - 1;
                let [a, b, c, d] =
                    [first, first + 1, first + width, first + width + 1].map(|i| self.vertices[i]);
                let triangles =
                    if kind == Cell::MainDiagonal { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] };
                emit(triangles[0], patch_id(cell, 0), Rim::Inside);
                emit(triangles[1], patch_id(cell, 1), Rim::Inside);
            }
        }
    }
}

/// What a band is drawn from.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    /// The surfaces.
    pub(crate) surfaces: &'a Surfaces,
    /// The warp to the screen.
    pub(crate) warp: &'a Warp,
    /// How far the quarters of cut cells reach.
    pub(crate) cuts: &'a Rims,
}

impl Vertex {
    /// Behind the near plane, or unknown.
    pub(crate) const NOWHERE: Self = Self { x: f32::NAN, y: f32::NAN, nearness: f32::NAN };

    /// A sample on the screen.
    pub(crate) fn of_sample(surfaces: &Surfaces, warp: &Warp, index: usize) -> Self {
        let disparity = surfaces.disparity[index];
        if disparity.is_nan() {
            return Self::NOWHERE;
        }
        let width = surfaces.size[0];
        let place = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        Self::of(warp, &warp.at(place, f64::from(disparity)))
    }

    fn of(warp: &Warp, warped: &crate::warp::Warped) -> Self {
        if !warp.in_front(warped) {
            return Self::NOWHERE;
        }
        let at = warped.pos_in_screen();
        Self { x: at.x as f32, y: at.y as f32, nearness: warp.nearness(warped.depth) as f32 }
    }
}

/// Calls `visit` with every corner on the screen of a cell's pieces.
fn each_corner(
    surfaces: &Surfaces,
    vertices: &[Vertex],
    warp: &Warp,
    (cx, cy): (usize, usize),
    cuts: &Rims,
    visit: &mut impl FnMut(Vertex),
) {
    match surfaces.cells[cy * (surfaces.size[0] + 1) + cx] {
        Cell::Empty => {}
        Cell::Cut => (0..4)
            .filter_map(|corner| quarter(surfaces, warp, (cx, cy), corner, cuts))
            .flatten()
            .for_each(visit),
        Cell::MainDiagonal | Cell::AntiDiagonal => {
            surfaces.corners(cx, cy).into_iter().flatten().for_each(|i| visit(vertices[i]));
        }
    }
}

/// The quarter of a cut cell that belongs to one corner, wound like the reference's own triangles.
fn quarter(
    surfaces: &Surfaces,
    warp: &Warp,
    (cx, cy): (usize, usize),
    corner: usize,
    cuts: &Rims,
) -> Option<[Vertex; 4]> {
    let index = surfaces.corners(cx, cy)[corner].filter(|&i| !surfaces.disparity[i].is_nan())?;
    let towards = [1 - 2 * (corner as i32 % 2), 1 - 2 * (corner as i32 / 2)];
    let reach = cuts.reach(surfaces, index, towards);
    let (dx, dy) = (f64::from(towards[0]) * reach[0], f64::from(towards[1]) * reach[1]);
    let width = surfaces.size[0];
    let centre = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
    let [slope_x, slope_y] = surfaces.slope[index].map(f64::from);
    let here = f64::from(surfaces.disparity[index]);
    let at = |x: f64, y: f64| {
        // The tangent plane may reach its horizon within a steep quarter: it stays in front of it.
        let disparity = (here + slope_x * x + slope_y * y).max(0.25 * here);
        Vertex::of(warp, &warp.at(centre + DVec2::new(x, y), disparity))
    };
    let around = [at(0.0, 0.0), at(dx, 0.0), at(dx, dy), at(0.0, dy)];
    // Mirrored quarters are wound the other way.
    let [p, q, r, s] = around;
    Some(if dx * dy > 0.0 { around } else { [p, s, r, q] })
}

/// Calls `put(column, row, nearness)` for the places of a lattice inside a triangle. Coordinates are in places, whole
/// numbers at the places themselves; `clip` is the first and end column and row.
pub(crate) fn scan_triangle(corners: [Vertex; 3], clip: [[i32; 2]; 2], mut put: impl FnMut(i32, i32, f32)) {
    // A place this close outside an edge counts, so that rounding opens no crack between neighbours.
    const SLACK: f32 = 1e-3;
    let [p, q, r] = corners;
    let low = |a: f32, b: f32, c: f32| (a.min(b).min(c) - SLACK).ceil();
    let high = |a: f32, b: f32, c: f32| (a.max(b).max(c) + SLACK).floor();
    let columns = [
        (low(p.x, q.x, r.x).max(clip[0][0] as f32)) as i32,
        (high(p.x, q.x, r.x).min(clip[0][1] as f32 - 1.0)) as i32,
    ];
    let rows = [
        (low(p.y, q.y, r.y).max(clip[1][0] as f32)) as i32,
        (high(p.y, q.y, r.y).min(clip[1][1] as f32 - 1.0)) as i32,
    ];
    if columns[0] > columns[1] || rows[0] > rows[1] {
        return;
    }
    let area = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    let edge = |a: Vertex, b: Vertex, x: f32, y: f32| (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
    let slack = |a: Vertex, b: Vertex| -SLACK * ((b.x - a.x).abs() + (b.y - a.y).abs());
    let slacks = [slack(q, r), slack(r, p), slack(p, q)];
    // Slivers extrapolate without bound inside the slack.
    let nearest = p.nearness.max(q.nearness).max(r.nearness);
    let farthest = p.nearness.min(q.nearness).min(r.nearness);
    for row in rows[0]..=rows[1] {
        for column in columns[0]..=columns[1] {
            let (x, y) = (column as f32, row as f32);
            let [u, v, w] = [edge(q, r, x, y), edge(r, p, x, y), edge(p, q, x, y)];
            if u >= slacks[0] && v >= slacks[1] && w >= slacks[2] {
                let nearness = (u * p.nearness + v * q.nearness + w * r.nearness) / area;
                put(column, row, nearness.clamp(farthest, nearest));
            }
        }
    }
}
