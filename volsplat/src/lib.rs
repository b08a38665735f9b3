//! Volume rendering by hybrid forward resampling.

pub mod error;
pub mod input;
pub mod options;
pub mod procedural;
pub mod stats;
pub mod volume;

pub use error::Error;
pub use input::{Endian, LoadOptions, RawOptions, VoxelType, load};
pub use options::{ColourBy, DepthPlane, RenderOptions};
pub use stats::{FrameStats, StageTime, StageTimes};
pub use volume::{NanPolicy, Volume, Voxels};
