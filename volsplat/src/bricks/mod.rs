//! Bricks: cubes of voxels or cells that are kept, culled and put in order together.
//!
//! In the order in which data flow: scalars are rescaled to f32 (`rescale`) and stored with their gradients (of values that `smooth` blurs, where slices lie far apart) in bricks of `cells`; `support`
//! is the set of scalars that a look shows, and the cells in which they occur; `fill` decides which bricks are kept and makes them;
//! `cull` selects those in view.

pub(crate) mod rescale;
mod smooth;
pub(crate) mod cells;
pub(crate) mod support;
pub(crate) mod fill;
pub(crate) mod cull;
