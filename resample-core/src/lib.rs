//! Hybrid forward resampling: discrete samples laid on the screen as points or as splats.
//!
//! In the order in which data flows: `camera` and `view`; `kernel` and `table`; `conic`, `footprint`, `index_table` and
//! `disc`; `select` and `scan`; `tile`, `sort`, `maps`, `point`, `simd` and `composite`; `image` and `metrics`.

pub mod camera;
pub mod clock;
pub mod composite;
pub mod conic;
pub mod disc;
pub mod error;
pub mod footprint;
pub mod image;
pub mod index_table;
pub mod kernel;
pub mod light;
pub mod maps;
pub mod metrics;
pub mod point;
pub mod scan;
pub mod section;
pub mod select;
pub mod simd;
pub mod sort;
pub mod table;
pub mod tile;
pub mod view;

pub use camera::{Camera, CameraError, Intrinsics, LookAt, PixelCentre, Projection};
pub use composite::OpacityMode;
pub use error::Error;
pub use footprint::FootprintMode;
pub use image::{Image, Plane};
pub use kernel::{Kernel, KernelShape};
pub use select::SelectMode;
pub use view::GridView;
