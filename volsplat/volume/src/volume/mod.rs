//! The volume: a lattice of scalars and where it lies in the world, in memory.

//!
//! `voxels` of a `voxel_type` on a lattice (`grid`), described for callers (`described`) by their range (`extremes`) and their
//! `histogram`; `procedural` volumes for tests and examples.

mod voxels;
mod voxel_type;
pub mod grid;
mod extremes;
mod described;
pub mod histogram;
pub mod procedural;

pub use described::Described;
pub use histogram::Histogram;
pub use voxel_type::{Endian, VoxelType};
pub use voxels::{Lattice, Modality, NanPolicy, Volume, Voxels, scalar, with_voxels};
#[cfg(feature = "input")]
pub(crate) use voxels::{map_voxels, voxel_count};
