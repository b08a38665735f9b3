//! Sizes that the steps of the drawing agree on.

/// Footprints of the blend end at this many standard deviations, where a weight is 1/50 of that in the middle.
pub(crate) const REACH_SIGMAS: f64 = 2.8;

/// Side of a tile, px. Half of the discs near a tile of 16 px lie in its neighbours, too; a larger one looks farther for what hides a disc.
pub(crate) const TILE_PX: usize = 32;

/// A tile also needs the pixels around it: the pixel's Gaussian reaches 1.5 px.
pub(crate) const APRON_PX: usize = 1;

/// Side of a block, px.
pub(crate) const BLOCK_PX: usize = 4;

/// Least half axis of a disc that is seen edge-on, px: keeps its form finite. An eighth of a subpixel of coverage.
pub(crate) const LEAST_HALF_AXIS_PX: f32 = 1.0 / 32.0;

/// Largest reach of a disc from its middle, px: one that the eye stands on would cover the picture in every tile. A guess.
pub(crate) const MOST_REACH_PX: f32 = 512.0;

/// Drawn discs of a block; neighbours, since discs are in the order of a tree.
pub(crate) const BLOCK_DISCS: usize = 256;
