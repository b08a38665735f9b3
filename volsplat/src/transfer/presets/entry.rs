//! One row of the table of presets.

use crate::options::{Blend, Shading};

/// What the knots of a preset are written in.
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
pub(super) struct Entry {
    pub(super) name: &'static str,
    pub(super) about: &'static str,
    pub(super) scale: PresetScale,
    /// The light that it was made for.
    pub(super) shading: Shading,
    /// The value of a ray that it was made for.
    pub(super) blend: Blend,
    /// Scalar, then red, green, blue in linear light.
    pub(super) colours: &'static [(f64, [f32; 3])],
    /// Scalar and opacity per voxel.
    pub(super) opacities: &'static [(f64, f64)],
}
