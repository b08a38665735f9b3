//! What was typed about what a pixel shows of its ray; see `args.rs`.

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use crate::values;

/// What a pixel shows of its ray.
#[derive(Args, Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", default)]
#[command(next_help_heading = "Blending (order image-sheets)")]
pub(crate) struct BlendArgs {
    /// What a pixel shows of its ray [default: emission, or isosurface with --iso]
    #[arg(long, value_enum)]
    pub blend: Option<RayBlendArg>,
    /// Draw the surface at this value, lit by the gradient
    #[arg(long, value_name = "VALUE", value_parser = values::number, allow_hyphen_values = true)]
    pub iso: Option<f64>,
    /// Colour of the surface: white, black, #rrggbb, or R,G,B from 0 to 255 [default: the transfer function's]
    #[arg(long, alias = "iso-color", value_name = "COLOUR", value_parser = values::colour, requires = "iso")]
    pub iso_colour: Option<[f32; 3]>,
    /// Opacity of the surface, each time that a ray crosses it; above 0, at most 1 [default: 1]
    #[arg(long, value_name = "A", value_parser = values::positive_f32, requires = "iso")]
    pub iso_opacity: Option<f32>,
    /// Planes of an EXR file beside colour and mean depth (Z): where the ray first meets something (depth.first), what it
    /// faces (normal.X, .Y, .Z), how many samples it took (samples); the share of points (selection) [default: none]
    #[arg(long, value_enum, value_name = "NAMES", value_delimiter = ',')]
    pub layers: Option<Vec<VolumeLayerArg>>,
}

/// Planes beside a volume's colour.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum VolumeLayerArg {
    /// Camera z at which the ray first meets something
    FirstHit,
    /// Mean normal, towards the eye, times opacity
    Normal,
    /// Samples along the ray
    Samples,
    /// Share of points in the opacity, the rest being splats (every-sample, axis-sheets)
    Selection,
}

/// What a pixel shows of its ray.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum RayBlendArg {
    /// Emission and absorption, sample behind sample
    Emission,
    /// The greatest value, through the transfer function
    Maximum,
    /// The least value inside the volume, through the transfer function
    Minimum,
    /// The mean of the values inside the volume, through the transfer function
    Average,
    /// The surface at --iso
    Isosurface,
}
