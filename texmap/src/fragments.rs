//! What one pixel shows, triangle by triangle: the share of its filter that each has, and where that lies.

use crate::filter::PixelFilter;
use crate::visibility::{NONE, SPAN_PX};

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
pub(crate) fn collect(filter: &PixelFilter, ids: &[u32], [x, y]: [usize; 2], fragments: &mut Vec<Fragment>) {
    fragments.clear();
    for window in &filter.rows {
        let (column, row) = (x + window.column, y * filter.per_pixel + window.row);
        let ids = &ids[row * SPAN_PX + column..][..window.weights.len()];
        for (i, (&weight, &id)) in window.weights.iter().zip(ids).enumerate() {
            if id == NONE {
                continue;
            }
            let at = filter.position_px(column + i, row);
            let place = match fragments.iter().rposition(|f| f.id == id) {
                Some(place) => place,
                None => {
                    fragments.push(Fragment { id, weight: 0.0, at: [0.0; 2] });
                    fragments.len() - 1
                }
            };
            let fragment = &mut fragments[place];
            fragment.weight += weight;
            fragment.at[0] += weight * at[0];
            fragment.at[1] += weight * at[1];
        }
    }
    for fragment in fragments {
        let scale = 1.0 / fragment.weight;
        fragment.at = fragment.at.map(|sum| sum * scale);
    }
}
