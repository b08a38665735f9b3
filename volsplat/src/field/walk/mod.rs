//! Walks along rays over one brick in one tile, and the parts that they share with `batch`: they take samples front to back and composite
//! them into the tile's pixels.
//!
//! `lists` and `scratch` are the storage of a task, with the pixels. `corners` and `cell_sample` interpolate the field, `gradient` its
//! gradient. The walks: rays through a far brick of one colour (`constant_walk`), an isosurface (`rays`, `isosurface`), and narrow peaks
//! by ray segments (`segments`).

pub(crate) mod lists;
pub(crate) mod scratch;
pub(crate) mod corners;
pub(crate) mod cell_sample;
pub(crate) mod gradient;
pub(crate) mod rays;
pub(crate) mod constant_walk;
pub(crate) mod isosurface;
pub(crate) mod segments;
