//! The content of a transfer function's file, whichever program wrote it.

use resample_core::image::linear_from_srgb;

use crate::look::options::Shading;
use crate::look::transfer::{ColourEncoding, ColourKnot, OpacityKnot};

/// The content of a file.
#[derive(Debug, Default)]
pub(crate) struct Knots {
    /// Absent where the file has opacity alone.
    pub(crate) colours: Option<Vec<ColourKnot>>,
    /// Absent where the file has colours alone.
    pub(crate) opacities: Option<Vec<OpacityKnot>>,
    /// The light, where the file says.
    pub(crate) shading: Option<Shading>,
    /// Length over which its opacities are meant, world units, where the file says.
    pub(crate) opacity_unit: Option<f64>,
    /// Ignored parts of the file, one sentence each.
    pub(crate) notes: Vec<String>,
}

/// A colour in linear light.
pub(crate) fn decoded(rgb: [f64; 3], encoding: ColourEncoding) -> [f32; 3] {
    match encoding {
        ColourEncoding::Linear => rgb.map(|channel| channel as f32),
        ColourEncoding::Srgb => rgb.map(|channel| linear_from_srgb(channel as f32)),
    }
}
