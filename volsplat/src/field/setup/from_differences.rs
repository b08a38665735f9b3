//! The map from differences of voxels to gradients in the world.

use glam::DMat3;

use crate::grid::units::gradient_from_differences;

/// From the differences of the voxels on both sides to gradients, along the axes of the world, as `Gradients::Vectors` holds
/// them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FromDifferences {
    /// The parts of the differences along x, of those along y, and of those along z.
    pub(crate) columns: [[f32; 3]; 3],
}

impl FromDifferences {
    /// Those of a grid with these axes.
    pub(crate) fn new(world_from_index: &DMat3) -> Self {
        let half = gradient_from_differences(world_from_index) * 0.5;
        Self {
            columns: half.as_mat3().to_cols_array_2d(),
        }
    }
}
