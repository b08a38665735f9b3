//! What one pixel shows, triangle by triangle: the share of its filter that each has, and where that lies.

use crate::edges::Edges;
use crate::filter::{AROUND, PixelFilter, around};
use crate::span::{NONE, SPAN_PX};

/// One triangle in one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fragment {
    /// Place in the tile's list.
    pub(crate) id: u32,
    /// Share of the pixel's filter, 0..=1.
    pub(crate) weight: f32,
    /// Weighted mean of its sub-pixels' positions, px from the corner of the tile's border.
    pub(crate) at: [f32; 2],
}

/// Lists the triangles that `ids` (by sub-pixel of the tile) hold within the filter of pixel (x, y) of the tile.
pub(crate) fn collect(
    filter: &PixelFilter,
    ids: &[u32],
    edges: &Edges,
    [x, y]: [usize; 2],
    fragments: &mut Vec<Fragment>,
) {
    fragments.clear();
    for window in &filter.rows {
        let (column, row) = (x + window.column, y * filter.per_pixel + window.row);
        let ids = &ids[row * SPAN_PX + column..][..window.weights.len()];
        for (i, (&weight, &id)) in window.weights.iter().zip(ids).enumerate() {
            if id == NONE {
                continue;
            }
            add(fragments, id, weight, filter.position_px(column + i, row));
        }
    }
    for cell in (0..AROUND).map(|k| around([x, y], k)) {
        for edge in edges.of_cell(cell) {
            let [p, q] = edge.between.map(|at| at as usize);
            // What the first gains the second loses, and both are weighed where they are.
            let gain = edge.shares[0] * filter.weight([x, y], p)
                + edge.shares[1] * filter.weight([x, y], q);
            let [from, to] = [p, q].map(|at| filter.position_px(at % SPAN_PX, at / SPAN_PX));
            let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
            for (id, gain) in [(ids[p], gain), (ids[q], -gain)] {
                if id != NONE && gain != 0.0 {
                    add(fragments, id, gain, middle);
                }
            }
        }
    }
    fragments.retain(|fragment| fragment.weight > LEAST_WEIGHT);
    for fragment in fragments {
        let scale = 1.0 / fragment.weight;
        fragment.at = fragment.at.map(|sum| sum * scale);
    }
}

/// A triangle that has less than this of a pixel is left out: its mean position would be rounding.
const LEAST_WEIGHT: f32 = 1e-4;

fn add(fragments: &mut Vec<Fragment>, id: u32, weight: f32, at: [f32; 2]) {
    let place = match fragments.iter().rposition(|f| f.id == id) {
        Some(place) => place,
        None => {
            fragments.push(Fragment {
                id,
                weight: 0.0,
                at: [0.0; 2],
            });
            fragments.len() - 1
        }
    };
    let fragment = &mut fragments[place];
    fragment.weight += weight;
    fragment.at[0] += weight * at[0];
    fragment.at[1] += weight * at[1];
}
