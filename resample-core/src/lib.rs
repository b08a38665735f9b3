//! Hybrid forward resampling: discrete samples laid on the screen as points or as splats.
//!
//! The modules stand in the order in which data flows.

pub mod camera;
pub mod view;
pub mod kernel;
pub mod table;
pub mod conic;
pub mod footprint;
pub mod index_table;
pub mod disc;
pub mod select;
pub mod scan;
pub mod simd;
pub mod tile;
pub mod sort;
pub mod point;
pub mod composite;
pub mod image;
pub mod metrics;

pub use camera::{Camera, CameraError, Intrinsics, LookAt, PixelCentre, Projection};
pub use composite::OpacityMode;
pub use footprint::FootprintMode;
pub use image::{Image, Plane};
pub use kernel::{Kernel, KernelShape};
pub use select::SelectMode;
pub use view::GridView;
