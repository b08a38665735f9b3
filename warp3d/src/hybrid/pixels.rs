//! Pixels of a band.

use crate::raster::Vertex;

/// A pixel that no finer lattice belongs to.
pub(crate) const NO_SLOT: u32 = u32::MAX;

/// First and last column and row that a triangle's bounding box touches inside a band.
#[inline(always)]
pub(super) fn pixels_of(
    corners: [Vertex; 3],
    width: usize,
    rows: [usize; 2],
) -> Option<[[usize; 2]; 2]> {
    let [p, q, r] = corners;
    let range = |a: f32, b: f32, c: f32, first: usize, end: usize| {
        let low = a.min(b).min(c).floor().max(first as f32);
        let high = a.max(b).max(c).floor().min(end as f32 - 1.0);
        (low <= high).then_some([low as usize, high as usize])
    };
    Some([
        range(p.x, q.x, r.x, 0, width)?,
        range(p.y, q.y, r.y, rows[0], rows[1])?,
    ])
}
