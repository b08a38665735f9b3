//! Voxels that stay in their file: any box of them is read when it is asked for.

use std::fmt::Debug;

use crate::Error;
use crate::volume::{VoxelType, Voxels};

/// A box of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Its first voxel.
    pub first: [usize; 3],
    /// Voxels along each axis.
    pub size: [usize; 3],
}

/// Voxels that are read box by box, by many threads at once.
pub trait VoxelSource: Debug + Send + Sync {
    /// Number of voxels along x, y and z.
    fn dims(&self) -> [usize; 3];

    /// Type of a voxel in the source.
    fn voxel_type(&self) -> VoxelType;

    /// Reads a box of voxels, x fastest, all of them finite.
    fn read(&self, region: &Region) -> Result<Voxels, Error>;
}

/// Called now and then with the share of a long task that is done, 0 to 1.
pub type Watch<'a> = dyn FnMut(f64) + 'a;
