//! Volumes that are larger than memory: surveyed once, and read brick by brick.

pub(crate) mod blocks;
mod source;
mod survey;
mod volume;

pub use source::{Region, VoxelSource};
pub use volume::{LargeVolume, most_brick_bytes};
