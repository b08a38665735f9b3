//! Depth-image warping: the pixels of a picture with depth laid on the screen of another camera.
//!
//! In the order in which data flows: files become [`Reference`] views; their samples are warped, grouped into surfaces,
//! selected, accumulated and resolved into a picture; holes stay transparent or are filled.
//!
//! ```
//! use resample_core::{Camera, LookAt};
//! use warp3d::{Reference, WarpOptions, Warper};
//!
//! let camera = |x: f64| {
//!     let pose = LookAt {
//!         position: [x, 0.0, 0.0].into(),
//!         target: [x, 0.0, 1.0].into(),
//!         up: [0.0, -1.0, 0.0].into(),
//!     };
//!     Camera::perspective(&pose, 0.8, [64, 48])
//! };
//! let reference = Reference {
//!     camera: camera(0.0)?,
//!     colour: vec![[0.5; 3]; 64 * 48],
//!     depth: vec![3.0; 64 * 48],
//! };
//! let mut warper = Warper::new(vec![reference], &WarpOptions::default())?;
//! let image = warper.render(&camera(0.5)?)?.image;
//! // The new eye stands farther to the right: what it sees at its right border the picture does not show.
//! assert_eq!(image.pixel(10, 24), [0.5, 0.5, 0.5, 1.0]);
//! assert_eq!(image.pixel(62, 24)[3], 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(feature = "clap")]
pub mod args;
mod bands;
mod beyond;
mod blend;
mod colour;
mod epipole;
mod fill;
mod flags;
mod gaps;
mod hybrid;
#[cfg(feature = "input")]
pub mod input;
pub mod keys;
#[cfg(feature = "input")]
pub mod large;
mod layer;
mod lengths;
pub mod memory;
mod nearest;
pub mod options;
pub mod panorama;
mod patch;
mod piece;
mod prepared;
mod ramps;
mod raster;
pub mod reference;
mod resolve;
mod rims;
mod splat;
mod spline;
pub mod stats;
mod surface;
mod taken;
mod tolerance;
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
