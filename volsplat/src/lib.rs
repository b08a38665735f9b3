//! Volume rendering by hybrid forward resampling.

pub mod cull;
pub mod error;
mod geometry;
pub mod input;
pub mod near;
pub mod options;
pub mod procedural;
mod project;
pub mod render;
pub mod sample;
pub mod stats;
mod tiles;
pub mod transfer;
pub mod volume;

pub use error::Error;
pub use input::{Endian, LoadOptions, RawOptions, VoxelType, load};
pub use options::{ColourBy, DepthPlane, RenderOptions};
pub use render::{Frame, Renderer};
pub use stats::{FrameStats, StageTime, StageTimes};
pub use transfer::{ColourEncoding, ColourMap, Histogram, TransferFunction};
pub use volume::{NanPolicy, Volume, Voxels};
