//! The volume: a lattice of scalars and where it lies in the world, in memory.

mod described;
pub(crate) mod grid;
pub mod procedural;
mod voxel_type;
mod voxels;

pub use described::Described;
pub use voxel_type::{Endian, VoxelType};
#[cfg(feature = "input")]
pub(crate) use voxels::voxel_count;
pub use voxels::{Lattice, NanPolicy, Volume, Voxels};
pub(crate) use voxels::{scalar, with_voxels};
