//! The volume: a lattice of scalars and where it lies in the world, in memory.

mod described;
mod extremes;
pub(crate) mod grid;
pub mod procedural;
mod voxel_type;
mod voxels;

pub use described::Described;
pub use voxel_type::{Endian, VoxelType};
pub use voxels::{Lattice, Modality, NanPolicy, Volume, Voxels};
#[cfg(feature = "input")]
pub(crate) use voxels::{map_voxels, voxel_count};
pub(crate) use voxels::{scalar, with_voxels};
