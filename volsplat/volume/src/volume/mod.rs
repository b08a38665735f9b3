//! The volume: a lattice of scalars and where it lies in the world, in memory.
//!
//! `voxels` of a `voxel_type` on a lattice, their `histogram`, and the facts that a transfer function and a camera need of them
//! ([`Described`]); `steps` for volumes that change over time; `procedural` volumes for tests and examples.

mod voxels;
mod voxel_type;
pub mod histogram;
pub mod procedural;
#[cfg(feature = "input")]
mod regrid;
mod slices;
mod steps;

pub use histogram::Histogram;
#[cfg(feature = "input")]
pub use regrid::Between;
pub use slices::{PlaneGrid, Slice};
pub use steps::Steps;
pub use voxel_type::{Endian, VoxelType};
pub use voxels::{Grid, Lattice, Modality, NanPolicy, Volume, Voxels, scalar, with_voxels};
#[cfg(feature = "input")]
pub(crate) use voxels::{map_voxels, voxel_count};

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

    /// The scalars at black and at white in slices: the window of the file, else [`Histogram::usual_window`].
    fn slice_window(&self) -> [f64; 2] {
        let own = self.lattice().window;
        own.unwrap_or_else(|| self.histogram().usual_window())
    }
}

impl Described for Volume {
    fn lattice(&self) -> Lattice {
        Lattice {
            dims: self.dims,
            world_from_index: self.world_from_index,
            up_hint: self.up_hint,
            space: self.space.clone(),
            modality: self.modality,
            unit: self.unit.clone(),
            window: self.window,
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
