//! Translucent layers before their colours lie over those behind: the n-th farthest of each sub-pixel are rows, as
//! sub-pixels are.

use glam::Vec4;

use crate::screen::padded_tile::{NONE, SPAN_WIDTH};
use crate::visibility::Layer;

/// The layers of some rows of sub-pixels.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layers {
    /// Row by row, the farthest layers first.
    pub(crate) rows: Vec<LayerRow>,
    /// Premultiplied, a span for each of the rows.
    pub(crate) colours: Vec<[f32; 4]>,
}

/// Layers of one rank.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerRow {
    /// The first sub-pixel of the row.
    pub(crate) first: usize,
    /// Triangles, by their places in the tile's list.
    pub(crate) ids: [u32; SPAN_WIDTH],
}

impl Layers {
    /// Forgets all layers.
    pub(crate) fn clear(&mut self) {
        self.rows.clear();
        self.colours.clear();
    }

    /// Adds the layers of the row whose first sub-pixel is `first`, sorted by sub-pixel, the farthest first.
    pub(crate) fn add_row(&mut self, first: usize, layers: &[Layer]) {
        let start = self.rows.len();
        for layers in layers.chunk_by(|a, b| a.subpixel == b.subpixel) {
            for (rank, layer) in layers.iter().enumerate() {
                if start + rank == self.rows.len() {
                    self.rows.push(LayerRow {
                        first,
                        ids: [NONE; SPAN_WIDTH],
                    });
                }
                self.rows[start + rank].ids[layer.subpixel as usize - first] = layer.id;
            }
        }
    }

    /// Lays the layers over what lies behind; those that were not computed are transparent.
    pub(crate) fn blend(&self, behind: &mut [[f32; 4]]) {
        for (row, fronts) in self.rows.iter().zip(self.colours.chunks_exact(SPAN_WIDTH)) {
            let behind = &mut behind[row.first..row.first + SPAN_WIDTH];
            for (behind, front) in behind.iter_mut().zip(fronts) {
                let front = Vec4::from(*front);
                *behind = (front + (1.0 - front.w) * Vec4::from(*behind)).to_array();
            }
        }
    }
}
