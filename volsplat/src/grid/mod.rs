//! Places in a grid of voxels: the boxes of its bricks, and the unit in which lengths are counted.

pub(crate) mod bounds;
pub(crate) mod units;
