//! A pixel on a textured plane, and what it gathers there.

use glam::Vec4;
use resample_core::point::PIXEL_SIGMA_PX;

use crate::prepare::mip::Pyramid;
use crate::project::surface::UvAt;

/// The pixel's variance, px^2.
pub(crate) const PIXEL_VARIANCE: f32 = (PIXEL_SIGMA_PX * PIXEL_SIGMA_PX) as f32;

/// A pixel on a textured plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelOnTexture<'a> {
    pub(crate) pyramid: &'a Pyramid,
    pub(crate) at: UvAt,
    /// Relative change of 1/w per px along x and y; 0 neglects perspective within the footprint.
    pub(crate) over_w_slope: [f32; 2],
}

/// A gathered colour.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    pub(crate) rgba: Vec4,
    /// Texels looked at.
    pub(crate) texels: u32,
}
