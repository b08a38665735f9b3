//! How a volume is drawn, as it is typed: the libraries' own groups of options beside one another.
//!
//! The groups of the field, of samples and of kernels in sheets belong to orders of compositing; `order.rs` says which one
//! the options that are given select.

use clap::{Args, ValueEnum};
use glam::DVec3;
use resample_core::OpacityMode;
use resample_core::simd::SimdLevel;
use volsplat::{FieldOptions, KernelSheets, RenderOptions, SampleOptions, Shading, Subpixels};

use crate::args::short_help;
use crate::args::{BlendArgs, ClipArgs};
use crate::values;

/// How the volume is drawn.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Rendering")]
pub struct RenderArgs {
    /// Order of compositing [default: field; an option that only one order has selects that order, and a single slice is
    /// drawn by every-sample]
    #[arg(long, value_enum)]
    pub order: Option<OrderName>,
    /// The trilinear field.
    #[command(flatten)]
    pub field: FieldOptions,
    /// Sub-pixels along a pixel's side: 1, 2, 4, 8, 16, or auto: about two per voxel (field), one per sample (every-sample), 1 (axis-sheets)
    #[arg(long, value_name = "N|auto", value_parser = values::subpixels, default_value = "auto")]
    pub subpixels: Subpixels,
    /// How the opacity of a voxel becomes the opacity of a pixel
    #[arg(long, value_enum, default_value_t = RenderOptions::default().opacity)]
    pub opacity: OpacityMode,
    /// Stop a ray once its remaining transmittance falls below T (0: never)
    #[arg(long, value_name = "T", value_parser = values::fraction,
        default_value_t = RenderOptions::default().min_transmittance)]
    pub min_transmittance: f32,
    /// SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    #[arg(long, value_enum, default_value = "auto")]
    pub vector_level: SimdLevel,
    /// How samples are lit, by the gradient of the volume [default: as the preset or the data have it; with --transfer,
    /// --window or --colormap none; of an isosurface phong]
    #[arg(long, value_enum)]
    pub shade: Option<Shading>,
    /// Direction towards the light, in the world [default: the light is at the camera]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub light: Option<DVec3>,
    /// Multiply the extinction by a ramp over the length of the gradient: 0 at LOW, 1 at HIGH, value per world unit
    #[arg(long, value_name = "LOW,HIGH", value_parser = values::ramp)]
    pub gradient_opacity: Option<[f64; 2]>,
    /// The part of the volume that is drawn.
    #[command(flatten)]
    pub clip: ClipArgs,
    /// The value of a ray that a pixel shows.
    #[command(flatten)]
    pub blend: BlendArgs,
    /// The samples of the paper's orders.
    #[command(flatten, next_help_heading = short_help::PAPER)]
    pub samples: SampleOptions,
    /// The part of the volume that a sample stands for
    #[arg(long, value_enum, default_value_t = CellsName::Auto)]
    pub cells: CellsName,
    /// Subdivide cells whose parts differ from the whole by more than this in colour or opacity
    #[arg(long, value_name = "E", value_parser = values::fraction, default_value = "0.0625")]
    pub cell_error: f32,
    /// The sheets in which kernels are summed.
    #[command(flatten, next_help_heading = short_help::PAPER)]
    pub sheets: KernelSheets,
}

/// `--order`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OrderName {
    /// The trilinear field on planes parallel to the picture, classified per sub-pixel: sharp and antialiased
    Field,
    /// Each classified sample over those behind it, as point or splat: the paper
    EverySample,
    /// Slices of samples, summed, one over another: jumps as the view turns, for comparison
    AxisSheets,
    /// Kernels summed in slabs parallel to the picture, for comparison
    ImageSheets,
}

/// `--cells`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CellsName {
    /// Split in every-sample, off in the other orders
    Auto,
    /// A voxel, by its own value
    Off,
    /// The mean of the field between eight voxels
    Mean,
    /// The same, or parts of it where it varies by more than --cell-error
    Split,
}

impl OrderName {
    /// As it is typed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Field => "field",
            Self::EverySample => "every-sample",
            Self::AxisSheets => "axis-sheets",
            Self::ImageSheets => "image-sheets",
        }
    }
}
