//! The facts of a volume that a transfer function and a camera need, wherever its voxels are.

use super::{Lattice, Volume, VoxelType};
use crate::volume::Histogram;

/// A volume as those see it who need no single voxel, wherever its voxels are.
pub trait Described {
    /// Where it lies and how large it is.
    fn lattice(&self) -> Lattice;

    /// The type in which its voxels are held.
    fn voxel_type(&self) -> VoxelType;

    /// Least and greatest scalar.
    fn value_range(&self) -> (f64, f64);

    /// How often each scalar occurs.
    fn histogram(&self) -> Histogram;
}

impl Described for Volume {
    fn lattice(&self) -> Lattice {
        Lattice {
            dims: self.dims,
            world_from_index: self.world_from_index,
            up_hint: self.up_hint,
            space: self.space.clone(),
            modality: self.modality,
        }
    }

    fn voxel_type(&self) -> VoxelType {
        VoxelType::of(&self.voxels)
    }

    fn value_range(&self) -> (f64, f64) {
        self.voxels.finite_range()
    }

    fn histogram(&self) -> Histogram {
        Histogram::of_volume(self)
    }
}
