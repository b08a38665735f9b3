//! Volumes that are larger than memory: surveyed once, and read brick by brick.

pub(crate) mod blocks;
mod survey;
mod volume;

pub use resample_volume::source::{Region, VoxelSource};
pub use volume::{LargeVolume, most_brick_bytes};
