//! Bricks: cubes of voxels or cells that are kept, culled and put in order together.
//!
//! In the order in which data flow: scalars are rescaled to f32 (`rescale`); `support` is the set of scalars that a look shows, `shown`
//! the cells in which they occur; `plan` decides which bricks are kept and `fill` makes them (`cells`, `scalars`, `gradients`; `all_bricks`
//! for a viewer); `visible` and `cull` select those in view.

pub(crate) mod rescale;
pub(crate) mod cells;
pub(crate) mod support;
pub(crate) mod fill;
pub(crate) mod cull;
