//! Options of the value of a ray that a pixel shows; see `args.rs`.

use clap::{Args, ValueEnum};
use volsplat::Layer;

use crate::values;

/// The value of its ray that a pixel shows.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Blending (order field)")]
pub struct BlendArgs {
    /// The value of its ray that a pixel shows [default: emission, or isosurface with --iso]
    #[arg(long, value_enum)]
    pub blend: Option<RayBlend>,
    /// Draw the surface at this value, lit by the gradient
    #[arg(long, value_name = "VALUE", value_parser = values::number, allow_hyphen_values = true)]
    pub iso: Option<f64>,
    /// Colour of the surface: white, black, #rrggbb, or R,G,B from 0 to 255 [default: the transfer function's]
    #[arg(long, alias = "iso-color", value_name = "COLOUR", value_parser = values::colour, requires = "iso")]
    pub iso_colour: Option<[f32; 3]>,
    /// Opacity of the surface, each time that a ray crosses it; above 0, at most 1 [default: 1]
    #[arg(long, value_name = "A", value_parser = values::positive_f32, requires = "iso")]
    pub iso_opacity: Option<f32>,
    /// Planes of an EXR file beside colour and mean depth (Z) [default: none]
    #[arg(long, value_enum, value_name = "NAMES", value_delimiter = ',')]
    pub layers: Option<Vec<Layer>>,
}

/// The value of its ray that a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RayBlend {
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
