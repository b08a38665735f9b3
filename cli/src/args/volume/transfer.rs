//! Options of the transfer function; see `args.rs`.
//!
//! Takes words, gives plain values. A function comes from one of four places: a file, a window, a preset or the
//! histogram; clap refuses two of them together. What changes a function goes with each of them.

use std::path::PathBuf;

use clap::Args;
use volsplat::transfer::{ColourEncoding, ColourMap, Preset};

use crate::values;
use crate::values::Window;

/// How values become colour and opacity.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Transfer function")]
pub struct TransferArgs {
    /// Transfer function file: a colour map of ParaView (JSON), or a volume property of Slicer (.vp, .vp.json) [default: made from the
    /// histogram]
    #[arg(long, value_name = "FILE")]
    pub transfer: Option<PathBuf>,
    /// Colour space of the colours in the transfer function file
    #[arg(long, value_name = "SPACE", value_enum, default_value = "linear")]
    pub transfer_space: ColourEncoding,
    /// Move the file's knots, from the first to the last, to the range of the volume's values
    ///
    /// For colour maps that are written over 0 to 1. Opacity that the file does not give is made from the histogram and
    /// is not moved.
    #[arg(long, requires = "transfer")]
    pub rescale_transfer: bool,
    /// Values LEVEL - WIDTH/2 to LEVEL + WIDTH/2 span the colour map and an opacity from 0 to 1, as in CT: 40,400
    #[arg(long, value_name = "LEVEL,WIDTH", value_parser = values::window, allow_hyphen_values = true,
        conflicts_with = "transfer")]
    pub window: Option<Window>,
    /// Preset: transfer function, shading and blend mode, such as ct-bone, mr-head, green-channel, flame; `list` prints all
    ///
    /// Those for CT expect Hounsfield units, others take the range of the volume's values. Opacities are per voxel,
    /// unless --opacity-unit says otherwise. --shade and --blend replace the light and the blending of the preset.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["transfer", "window", "colormap"])]
    pub preset: Option<Preset>,
    /// Colour map of the window, or of the transfer function that is made from the histogram [default: viridis]
    #[arg(
        long,
        alias = "colourmap",
        value_name = "NAME",
        conflicts_with = "transfer"
    )]
    pub colormap: Option<ColourMap>,
    /// Multiply the extinction of any transfer function: an opacity A becomes 1 - (1 - A)^S
    #[arg(long, value_name = "S", value_parser = values::positive, default_value = "1")]
    pub opacity_scale: f64,
    /// Length in world units over which an opacity is meant [default: the smallest distance between voxels]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive)]
    pub opacity_unit: Option<f64>,
    /// Also draw the transfer function over the histogram of the volume, as a PNG
    #[arg(long, value_name = "FILE.png", value_parser = values::png_name)]
    pub show_transfer: Option<PathBuf>,
}

impl Default for TransferArgs {
    fn default() -> Self {
        crate::args::defaults::defaults()
    }
}
