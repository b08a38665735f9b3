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

pub mod options;
#[cfg(feature = "clap")]
pub mod args;

// In the order in which data flow.
#[cfg(feature = "input")]
pub mod input;
mod view;
mod surfaces;
mod project;
mod hybrid;
mod resolve;
mod rows;
mod fill;
mod paper;
pub mod warper;
pub mod stats;
pub mod memory;

#[cfg(feature = "clap")]
pub use args::WarpArgs;
pub use options::{ExtraPlanes, Fill, Method, SurfaceTolerance, Visibility, WarpOptions};
pub use resample_core::clock::StageTime;
pub use resample_core::{Error, Reuse};
pub use stats::{FrameStats, StageTimes};
pub use view::reference::{self, Reference};
pub use view::{exposure, film, keys, multiview, panorama, warp};
pub use warper::{Frame, Warper};
