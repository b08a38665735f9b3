//! Depth-image warping: the pixels of a picture with depth laid on the screen of another camera.
//!
//! In the order in which data flows: files become [`Reference`] views; their samples are warped, grouped into surfaces,
//! selected, accumulated and resolved into a picture; holes are left or filled, and said.

mod bands;
mod epipole;
mod error;
pub mod input;
mod layer;
mod nearest;
pub mod options;
pub mod reference;
pub mod stats;
pub mod warp;
pub mod warper;

pub use error::Error;
pub use options::{Blend, ExtraPlanes, Fill, Method, MixedPixels, SurfaceTolerance, Visibility, WarpOptions};
pub use reference::Reference;
pub use stats::{FrameStats, StageTime, StageTimes};
pub use warper::{Frame, Warper};
