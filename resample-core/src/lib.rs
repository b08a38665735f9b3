//! Hybrid forward resampling: discrete samples laid on the screen as points or as splats.
//!
//! The modules stand in the order in which data flows.

pub mod camera;
pub mod image;

pub use camera::{Camera, CameraError, Intrinsics, LookAt, PixelCentre, Projection};
pub use image::{Image, Plane};
pub mod composite;
pub mod footprint;
pub mod kernel;
pub mod select;
pub use composite::OpacityMode;
pub use footprint::FootprintMode;
pub use kernel::KernelShape;
pub use select::SelectMode;
