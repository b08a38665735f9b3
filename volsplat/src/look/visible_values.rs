//! The values of a volume that a transfer function shows, and how many voxels have them.

use std::ops::Range;

use rayon::prelude::*;
use resample_volume::volume::{Volume, VoxelType, Voxels, scalar, with_voxels};

use crate::look::transfer::TransferFunction;

/// The values that a transfer function shows: a table where the type has few.
pub(crate) enum VisibleValues<'a> {
    Table { lowest: i32, shown: Vec<bool> },
    Direct(&'a TransferFunction),
}

impl<'a> VisibleValues<'a> {
    pub(crate) fn new(voxel_type: VoxelType, transfer: &'a TransferFunction) -> Self {
        let (lowest, count) = match voxel_type {
            VoxelType::U8 => (0, 1 << 8),
            VoxelType::I8 => (-(1 << 7), 1 << 8),
            VoxelType::U16 => (0, 1 << 16),
            VoxelType::I16 => (-(1 << 15), 1 << 16),
            _ => return Self::Direct(transfer),
        };
        let shown = (lowest..lowest + count)
            .map(|value| transfer.opacity(f64::from(value)) > 0.0)
            .collect();
        Self::Table { lowest, shown }
    }

    /// Returns true if a value of the type is visible.
    #[inline(always)]
    pub(crate) fn shows(&self, value: f64) -> bool {
        match self {
            Self::Table { lowest, shown } => shown[(value as i32 - lowest) as usize],
            Self::Direct(transfer) => transfer.opacity(value) > 0.0,
        }
    }
}

/// Voxels whose own scalar is visible.
pub(crate) fn count_visible(volume: &Volume, transfer: &TransferFunction) -> u64 {
    let values = VisibleValues::new(VoxelType::of(&volume.voxels), transfer);
    let count = |part: Range<usize>| match (&volume.voxels, &values) {
        (Voxels::U8(bytes), VisibleValues::Table { shown, .. }) => {
            let mut ones = [0u32; 256];
            for (one, &shown) in ones.iter_mut().zip(shown) {
                *one = u32::from(shown);
            }
            let parts = bytes[part].iter().map(|&byte| ones[usize::from(byte)]);
            u64::from(parts.sum::<u32>())
        }
        _ => with_voxels!(&volume.voxels, slice => {
            slice[part].iter().filter(|&&v| values.shows(scalar(v))).count() as u64
        }),
    };
    volume.voxels.parts().into_par_iter().map(count).sum()
}
