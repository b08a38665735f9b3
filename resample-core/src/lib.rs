//! Hybrid forward resampling: discrete samples laid on the screen as points or as splats.
//!
//! In the order in which data flow: `camera`; `kernels` and their footprints; `tile` and `sort`; `composite`; `image`, `light` and
//! `metrics`. `simd` is the vectors that all of them run on.
//!
//! ```
//! use resample_core::{Image, Kernel, KernelShape, metrics};
//!
//! // A kernel's integral along a line through its centre, and where it ends.
//! let kernel = Kernel::new(KernelShape::Polynomial);
//! assert!(kernel.line_integral(0.0) > kernel.line_integral(1.0));
//! assert_eq!(kernel.line_integral(kernel.radius().powi(2)), 0.0);
//!
//! // Two pictures that differ by 0.1 everywhere are 20 dB apart.
//! let (mut one, other) = (Image::transparent(16, 16), Image::transparent(16, 16));
//! one.rgba.fill([0.1; 4]);
//! let same = metrics::compare(&one, &other, None)?;
//! assert!((same.psnr_db - 20.0).abs() < 1e-3);
//! # Ok::<(), metrics::MetricsError>(())
//! ```

// In the order in which data flow.
pub mod camera;
pub mod kernels;
pub mod tile;
pub mod sort;
pub mod composite;
pub mod image;
pub mod light;
pub mod metrics;
pub mod simd;
pub mod clock;
pub mod stop;
pub mod scratch;
pub mod narrow;
pub mod error;

pub use camera::framing::Framing;
pub use camera::view::GridView;
pub use camera::{Camera, CameraError, Intrinsics, LookAt, PixelCentre, Projection};
pub use camera::{framing, view};
pub use composite::OpacityMode;
pub use composite::maps;
pub use composite::surface::{Surface, SurfaceTile};
pub use error::Error;
pub use image::{Image, Plane};
pub use kernels::footprint::{FootprintMode, SelectMode};
pub use kernels::kernel::{Kernel, KernelShape};
pub use kernels::{conic, footprint, index_table, kernel, point, section, table};
pub use stop::{Reuse, Stop};
