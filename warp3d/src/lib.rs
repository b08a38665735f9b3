//! Depth-image warping: the pixels of a picture with depth laid on the screen of another camera.
//!
//! In the order in which data flows: files become [`Reference`] views; their samples are warped, grouped into surfaces,
//! selected, accumulated and resolved into a picture; holes are left or filled, and said.

#[cfg(feature = "clap")]
pub mod args;
mod bands;
mod blend;
mod colour;
mod epipole;
mod fill;
mod flags;
mod hybrid;
#[cfg(feature = "input")]
pub mod input;
#[cfg(feature = "input")]
pub mod large;
mod layer;
pub mod memory;
mod nearest;
pub mod options;
mod patch;
mod piece;
mod prepared;
mod raster;
pub mod reference;
mod resolve;
mod rims;
mod splat;
mod spline;
pub mod stats;
mod surface;
pub mod warp;
pub mod warper;

#[cfg(feature = "clap")]
pub use args::WarpArgs;
#[cfg(feature = "input")]
pub use large::{LargeReference, LargeWarper};
pub use options::{
    Blend, ExtraPlanes, Fill, Method, MixedPixels, SurfaceOptions, SurfaceTolerance, Visibility,
    WarpOptions,
};
pub use reference::Reference;
pub use resample_core::Error;
pub use resample_core::clock::StageTime;
pub use stats::{FrameStats, StageTimes};
pub use warper::{Frame, Warper};
