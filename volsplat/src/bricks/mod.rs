//! Bricks: cubes of voxels or cells that are kept, culled and put in order together.

pub(crate) mod bounds;
pub(crate) mod cells;
pub(crate) mod cull;
pub(crate) mod fill;
pub(crate) mod gradients;
mod layout;
pub(crate) mod plan;
pub(crate) mod scalars;
mod shown;
pub(crate) mod support;
pub(crate) mod visible;
mod whole;
