//! What was typed about the orders that draw samples; see `args.rs`.

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use super::{ColourByArg, FootprintArg, KernelArg, SelectArg};
use crate::values;

/// Options of the orders that draw samples.
#[derive(Args, Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", default)]
#[command(next_help_heading = "Rendering, orders every-sample and axis-sheets")]
pub(crate) struct SampleArgs {
    /// How a perspective footprint is evaluated [default: exact]
    #[arg(long, value_enum)]
    pub footprint: Option<FootprintArg>,
    /// Shape of the reconstruction kernel [default: polynomial; trilinear in image-sheets, which has all of them]
    #[arg(long, value_enum)]
    pub kernel: Option<KernelArg>,
    /// Whether the kernels' sum passes through the voxels (image-sheets with a kernel other than trilinear) [default: off]
    #[arg(long, value_enum, num_args = 0..=1, default_missing_value = "on")]
    pub interpolate: Option<InterpolateArg>,
    /// Which voxels are drawn as points and which as splats; with a kernel other than trilinear in image-sheets too
    /// [default: hybrid]
    #[arg(long, value_enum)]
    pub select: Option<SelectArg>,
    /// In hybrid: voxels whose spacing projects to less than this many pixels are points [default: 1]
    #[arg(long, value_name = "PX", value_parser = values::positive_f32)]
    pub point_threshold: Option<f32>,
    /// Depth range within which points are summed before they are composited, in voxels (every-sample) [default: 1]
    #[arg(long, value_name = "VOXELS", value_parser = values::positive)]
    pub sheet: Option<f64>,
    /// What gives a voxel its colour; select paints splats red [default: transfer]
    #[arg(long, alias = "color-by", value_enum)]
    pub colour_by: Option<ColourByArg>,
    /// What a sample of every-sample, axis-sheets or --classify pre stands for [default: auto]
    #[arg(long, value_enum)]
    pub cells: Option<CellsArg>,
    /// A cell is split where a part shows a colour or opacity that is farther than this from that of the whole
    /// [default: 0.0625]
    #[arg(long, value_name = "E", value_parser = values::fraction)]
    pub cell_error: Option<f32>,
}

/// What a pre-classified sample stands for.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum CellsArg {
    /// Split in every-sample, off in the other orders
    Auto,
    /// A voxel, by its own value
    Off,
    /// The mean of what is seen between eight voxels
    Mean,
    /// The same, or parts of it where it varies inside
    Split,
}

/// What a sum of kernels does at the voxels.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum InterpolateArg {
    /// It blurs them
    Off,
    /// It takes their values; coefficients are solved for first
    On,
}
