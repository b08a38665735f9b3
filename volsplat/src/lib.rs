//! Volume rendering by hybrid forward resampling.

pub mod error;
pub mod options;
pub mod stats;

pub use error::Error;
pub use options::{ColourBy, DepthPlane, RenderOptions};
pub use stats::{FrameStats, StageTime, StageTimes};
