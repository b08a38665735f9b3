//! Scans of points without a grid, drawn as opaque surfaces.
//!
//! Takes a [`PointCloud`] (positions and sRGB colours in any order), returns for each camera a linear premultiplied picture
//! with depth. In the order in which data flow: `input` reads files; `grid` finds points of a scanner on a tripod that show no surface; `points` checks the points; `discs` makes a disc of each point and leaves out flying
//! pixels; `outline` and `spacing` measure a scan for framing and for people; `draw` puts discs on the screen, tile by tile; `renderer`
//! drives it all; `lanes` are the vectors of both.
//!
//! The method is that of surface splats: discs in the tangent planes of their points (Zwicker et al., "Surface splatting",
//! 2001), met by each pixel's ray with exact perspective (Botsch et al., "High-quality surface splatting on today's GPUs",
//! 2005), visibility first and then a normalised blend. The blend is a linear fit instead of a mean (moving least squares,
//! Lancaster and Salkauskas 1981), so that irregular points do not shift the colours.
//!
//! Limits: one surface a pixel, so that an edge of one surface before another has steps of one pixel, while the edge
//! before the empty background is antialiased. A point whose centre is before the near plane is left out whole. Points
//! have one colour from all directions.
//!
//! ```
//! use resample_core::{Camera, LookAt};
//! use resample_cloud::{CloudOptions, CloudRenderer, PointCloud, prepare};
//!
//! let places = (0..900).map(|i| [(i % 30) as f32, (i / 30) as f32, 0.0]);
//! let cloud = PointCloud {
//!     origin_in_world: [0.0; 3].into(),
//!     positions: places.collect(),
//!     colours: vec![[188; 3]; 900],
//! };
//! let mut renderer = CloudRenderer::new(prepare(&cloud)?, &CloudOptions::default())?;
//! let pose = LookAt {
//!     position: [14.5, 14.5, 40.0].into(),
//!     target: [14.5, 14.5, 0.0].into(),
//!     up: [0.0, 1.0, 0.0].into(),
//! };
//! let image = renderer.render(&Camera::perspective(&pose, 0.9, [64, 48])?)?.image;
//! assert_eq!(image.pixel(32, 24)[3], 1.0);
//! assert_eq!(image.pixel(0, 0)[3], 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(feature = "input")]
pub mod input;
mod lanes;
mod points;
mod discs;
mod outline;
mod spacing;
mod options;
mod grid;
mod draw;
mod renderer;

pub use discs::prepare::{Disc, Floating, LeftOut, Prepared, prepare, prepare_bytes, prepare_with};
pub use grid::{GridFate, StationGrid};
pub use options::{Blend, CloudLayer, CloudOptions, Shade};
pub use outline::CloudOutline;
pub use points::PointCloud;
pub use renderer::{CloudFrame, CloudRenderer, CloudStats};
pub use resample_core::Error;
pub use spacing::usual_spacing;

#[cfg(test)]
mod tests;
