//! One row of the table of presets.

use crate::look::options::{Blend, Shading};

/// The scale of a preset's knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresetScale {
    /// Hounsfield units, as CT has them.
    Hounsfield,
    /// Shares 0..=1 of the range of the volume's values.
    Share,
    /// Shares 0..=1 from the end of the background to the top of the range.
    Signal,
}

/// A preset.
#[derive(Debug)]
pub(crate) struct Entry {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) scale: PresetScale,
    /// The light that it was made for.
    pub(crate) shading: Shading,
    /// The value of a ray that it was made for.
    pub(crate) blend: Blend,
    /// Scalar, then red, green, blue in linear light.
    pub(crate) colours: &'static [(f64, [f32; 3])],
    /// Scalar and opacity per voxel.
    pub(crate) opacities: &'static [(f64, f64)],
}
