//! Walks over one brick in one tile: takes its samples front to back, composites them into the tile's pixels.
//!
//! `gather` walks planes and hands vectors of samples to a rule. `cell_sample` interpolates the field, `gradient` its gradient, `clipped` hides samples, `lit` lights them.
//! The rules: several channels (`mixed`), projections (`statistic`), rays through a far brick of one colour (`constant_walk`), an
//! isosurface (`rays`, `isosurface`), and narrow peaks by ray segments (`segments`, `segment_list`, `segment_flush`). `samples` is the
//! list that `batch` fills.

pub(crate) mod lists;
pub(crate) mod cell_sample;
pub(crate) mod gradient;
pub(crate) mod clipped;
pub(crate) mod lit;
pub(crate) mod rays;
pub(crate) mod gather;
pub(crate) mod mixed;
pub(crate) mod statistic;
pub(crate) mod constant_walk;
pub(crate) mod isosurface;
pub(crate) mod segments;
