//! Choices of appearance that both pipelines share: light, sub-pixels, depth.

use glam::DVec3;

/// How samples are lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Shading {
    /// Not at all: the colours of the transfer function
    None,
    /// Ambient and diffuse light, by the gradient
    Lambert,
    /// With a white highlight
    Phong,
}

/// Where the light of shading comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Light {
    /// Along the view direction of the camera.
    Headlight,
    /// From this direction in the world: it points towards the light, and has any length above 0.
    Towards(DVec3),
}

/// Sub-pixels along a pixel's side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Subpixels {
    /// As many as make the middle of what is visible about two sub-pixels a voxel, or with every-sample about one a sample,
    /// 1 to 8; 1 in axis sheets. Up to 4, emission and absorption of the field correct a pixel's mean by its neighbours.
    Auto,
    /// This many, 1, 2, 4, 8 or 16, and their plain mean.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Fixed(u32),
}

/// The depth plane of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum DepthPlane {
    /// No depth
    None,
    /// Opacity-weighted mean camera z, world units; +infinity where nothing is seen
    Expected,
}
