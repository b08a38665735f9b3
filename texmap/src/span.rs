//! The size of a tile and of the border that its filter needs.

/// A tile's side, px.
pub(crate) const TILE_PX: usize = resample_core::tile::TILE_PX;

/// A tile's side with the border that its filter needs, px.
pub(crate) const SPAN_PX: usize = TILE_PX + 2 * BORDER_PX;

/// A sub-pixel that shows nothing.
pub(crate) const NONE: u32 = u32::MAX;

/// How far the filter reaches: 4 sigma. A Gaussian cut at 3 sigma has lost 5 % of its variance over the plane, which
/// limits a picture to some 55 dB; at 4 sigma it is 0.3 %.
pub(crate) const REACH_PX: f64 = 2.0;

/// Pixels around a tile whose sub-pixels its filter needs.
pub(crate) const BORDER_PX: usize = 2;

/// Columns of pixels that a filter reaches.
pub(crate) const WINDOW_PX: usize = 2 * BORDER_PX + 1;
