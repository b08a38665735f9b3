//! Bricks: cubes of voxels or cells that are kept, culled and put in order together.

pub(crate) mod all_bricks;
pub(crate) mod rescale;

pub(crate) mod cells;
pub(crate) mod cull;
mod faces;
pub(crate) mod fill;
mod gradients;
pub(crate) mod plan;
mod shown;
pub(crate) mod support;
pub(crate) mod visible;
