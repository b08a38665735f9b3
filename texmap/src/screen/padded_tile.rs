//! The size of a tile and of the border that its filter needs.

use resample_core::Camera;
use resample_core::tile::{TILE_PX, TileGrid};

/// A tile's width, px: a row is one vector.
pub(crate) const TILE_WIDTH: usize = TILE_PX;

/// A tile's height, px. Each tile computes its border, which neighbours compute too, so that high tiles compute less twice;
/// the storage of a tile grows with it, and is to stay in the second-level cache.
pub(crate) const TILE_HEIGHT: usize = 32;

/// A tile's sides with the border that its filter needs, px.
pub(crate) const SPAN_WIDTH: usize = TILE_WIDTH + 2 * BORDER_PX;
pub(crate) const SPAN_HEIGHT: usize = TILE_HEIGHT + 2 * BORDER_PX;

/// The tiles of a picture.
pub(crate) fn tile_grid(camera: &Camera) -> TileGrid {
    TileGrid {
        width: camera.width as usize,
        height: camera.height as usize,
        tile_height: TILE_HEIGHT,
    }
}

/// A sub-pixel that shows nothing.
pub(crate) const NONE: u32 = u32::MAX;

/// How far the filter reaches: 4 sigma. A Gaussian cut at 3 sigma has lost 5 % of its variance over the plane, which
/// limits a picture to some 55 dB; at 4 sigma it is 0.3 %.
pub(crate) const REACH_PX: f64 = 2.0;

/// Pixels around a tile whose sub-pixels its filter needs.
pub(crate) const BORDER_PX: usize = 2;

/// Columns of pixels that a filter reaches.
pub(crate) const WINDOW_PX: usize = 2 * BORDER_PX + 1;
