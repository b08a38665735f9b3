//! Options of a picture of Gaussians.

use resample_core::simd::SimdLevel;

use crate::Error;
use crate::look::clip::Clip;
use crate::look::options::DepthPlane;

/// The choices of a picture of Gaussians.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
pub struct GaussianOptions {
    /// The meaning of a Gaussian.
    pub model: GaussianModel,
    /// How much the order inside a slab may change its colour before the slab's moments correct it, above 0, at most 1.
    pub slab_error: f32,
    /// Samples of a pixel.
    pub samples: PixelSamples,
    /// The part of the volume that is kept.
    pub clip: Clip,
    /// A pixel is left alone once its transmittance is below this, 0..1.
    pub min_transmittance: f32,
    /// The depth plane of the picture. Depths take slabs of at most 1/256 of their distance.
    pub depth: DepthPlane,
    /// Further planes of the picture.
    pub layers: Vec<GaussianLayer>,
    /// Vector instructions to use. Levels agree to rounding.
    pub simd: SimdLevel,
}

/// The meaning of a Gaussian. All but the volume are twins of other viewers, to compare pictures with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum GaussianModel {
    /// Extinction in space: exact footprints, filtered over the pixel, and no order
    #[default]
    Volume,
    /// The formulas of KHR_gaussian_splatting: affine footprints in the order of their centres, one sample a pixel
    Khr,
    /// The same as the code of Kerbl et al. 2023 draws it: footprints widened by 0.3 px squared
    Inria,
    /// The same as the code of Yu et al. 2024 (Mip-Splatting) draws it: widened by 0.1 px squared, with the light kept
    Mip,
}

/// Samples of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum PixelSamples {
    /// Four where footprints are small, else one
    #[default]
    Auto,
    /// One: each footprint is widened by the pixel's Gaussian
    #[cfg_attr(feature = "serde", serde(rename = "1"))]
    #[cfg_attr(feature = "clap", value(name = "1"))]
    One,
    /// Four, each with a narrower Gaussian
    #[cfg_attr(feature = "serde", serde(rename = "4"))]
    #[cfg_attr(feature = "clap", value(name = "4"))]
    Four,
}

/// A plane of a picture of Gaussians beside colour and mean depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum GaussianLayer {
    /// Camera z at which half of the light is lost, world units; +infinity where less is lost (channel depth.median)
    MedianDepth,
}

impl GaussianLayer {
    /// The name of its channel in an EXR file.
    pub fn channel(self) -> &'static str {
        match self {
            Self::MedianDepth => "depth.median",
        }
    }
}

impl Default for GaussianOptions {
    fn default() -> Self {
        Self {
            model: GaussianModel::Volume,
            // As the view turns in steps of 0.05 degrees, no pixel's second difference is above 1/255 on the scenes of the tests; 0.06
            // leaves 0.0052, and saves a sixth of the time.
            slab_error: 0.02,
            samples: PixelSamples::Auto,
            clip: Clip::default(),
            // A quarter of a step of an 8-bit picture.
            min_transmittance: 1.0 / 1024.0,
            depth: DepthPlane::None,
            layers: Vec::new(),
            simd: SimdLevel::Auto,
        }
    }
}

impl GaussianOptions {
    /// Returns true if a plane holds depths.
    pub(crate) fn has_depth(&self) -> bool {
        self.depth != DepthPlane::None || !self.layers.is_empty()
    }

    /// Checks every number against its range.
    pub fn validate(&self) -> Result<(), Error> {
        self.clip.validate()?;
        if !(self.slab_error > 0.0 && self.slab_error <= 1.0) {
            return Err(Error::Option(format!(
                "the error of a slab is {}: expected a number above 0, at most 1",
                self.slab_error
            )));
        }
        if !(0.0..1.0).contains(&self.min_transmittance) {
            return Err(Error::Option(format!(
                "the least transmittance is {}: expected 0 or more, below 1",
                self.min_transmittance
            )));
        }
        Ok(())
    }
}
