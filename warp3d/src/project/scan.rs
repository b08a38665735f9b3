//! Triangles on a lattice of screen positions: which places lie inside, and how near the triangle is there.
//!
//! Edge functions and nearness are linear over the screen, so eight places of a row are asked at once. A place on an
//! edge counts for both sides, and a little beyond it, so that rounding opens no crack between neighbours.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::vertex::Vertex;

/// A place this close outside an edge counts, px.
pub(crate) const SLACK: f32 = 1e-3;

/// Places that are asked at once.
const LANES: usize = 8;

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
