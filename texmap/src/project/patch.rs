//! The patches of a tile: pixels that see several triangles of one smooth surface.

use crate::project::surface::UvAt;
use crate::screen::padded_tile::TILE_WIDTH;

/// A pixel on a smooth surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// The triangle at the pixel's centre, by its place in the tile's list.
    pub(crate) id: u32,
    pub(crate) at: UvAt,
    /// Mean light, as a factor of colour.
    pub(crate) light: f32,
}

/// The patches of a tile and the storage to find them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patches {
    /// By pixel of the tile; empty if there are none.
    pub(crate) found: Vec<Option<Patch>>,
    pub(crate) candidates: Vec<bool>,
    /// By pixel of the span: the mesh that all its sub-pixels show, or [`NONE`](crate::screen::padded_tile::NONE).
    pub(crate) meshes: Vec<u32>,
    /// By sub-pixel: texture coordinates less those of the first plane, and light. Not a number elsewhere.
    pub(crate) u: Vec<f32>,
    pub(crate) v: Vec<f32>,
    pub(crate) light: Vec<f32>,
}

impl Patches {
    /// The patch at a pixel of the tile.
    pub(crate) fn at(&self, [x, y]: [usize; 2]) -> Option<Patch> {
        self.found.get(y * TILE_WIDTH + x).copied().flatten()
    }
}
