//! What was typed: the clap structs, whose doc comments are the help texts.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked. Nothing here knows
//! what a value leads to: `settings.rs` turns these structs into the options of the libraries, and `choices.rs` pairs
//! the small enums with their twins in the libraries, which need not know clap. Defaults come from the libraries.

mod blend;
mod clip;
mod defaults;
mod samples;
mod scene;
mod transfer;
mod volume;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use volsplat::Subpixels;

pub(crate) use blend::{BlendArgs, RayBlendArg, VolumeLayerArg};
pub(crate) use clip::ClipArgs;
pub(crate) use samples::{CellsArg, InterpolateArg, SampleArgs};
pub(crate) use scene::SceneArgs;
pub(crate) use transfer::{SpaceArg, TransferArgs};
pub(crate) use volume::VolumeArgs;

use crate::values::{self, Axis, BackgroundWord, Orbit, Size};

mod ask;
mod bench;
mod calibrate;
mod compare;
mod drawing;
mod given;
mod info;
mod sequence;
mod texmap;
mod trade;
mod warp3d;

pub(crate) use ask::AskArgs;
pub(crate) use bench::{BenchArgs, BenchPaperArgs, BenchSceneArgs, BenchTable};
pub(crate) use calibrate::CalibrateArgs;
pub(crate) use compare::CompareArgs;
pub(crate) use drawing::Drawing;
pub(crate) use given::Given;
pub(crate) use info::{DemoArgs, InfoArgs};
pub(crate) use sequence::SequenceArgs;
pub(crate) use texmap::{ModelArgs, TexmapArgs};
pub(crate) use trade::{SceneArg, TradeArgs, TradeOptions};
pub(crate) use warp3d::{AnaglyphArg, DepthArgs, DepthKindArg, Warp3dArgs, WarpCameraArgs};

/// Forward resampling: clean pictures from discrete samples
#[derive(Clone, Debug, Parser)]
#[command(name = "resample", version, max_term_width = 110)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Options of every command.
    #[command(flatten)]
    pub global: GlobalArgs,
}

/// The commands.
#[derive(Clone, Debug, Subcommand)]
pub(crate) enum Command {
    /// Draw built-in volumes: needs no file, takes seconds
    Demo(DemoArgs),
    /// Show what a volume file holds: size, place, values
    ///
    /// Example: resample info head.nii.gz
    Info(InfoArgs),
    /// Reproduce the published tables on this machine
    Bench(BenchArgs),
    /// Benchmark this machine once, so that --max-time can predict render times
    Calibrate(CalibrateArgs),
    /// Compare a picture or an animation with its reference: PSNR, SSIM, FLIP and more
    ///
    /// Example: resample compare mine.png truth.exr --heatmap errors.png --fail-above flip=0.02
    Compare(CompareArgs),
    /// Measure what every choice costs and loses: error against time, as one page with pictures
    ///
    /// Example: resample trade volsplat engine.nrrd --transfer tf.json --out report --settings slab,subpixel
    Trade(TradeArgs),
    /// The commands that draw.
    #[command(flatten)]
    Draw(Drawing),
}

/// Options of every command.
#[derive(Args, Clone, Debug)]
pub(crate) struct GlobalArgs {
    /// Number of threads [default: all processors]; the picture is the same for any number
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print nothing but warnings and errors
    #[arg(long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print the time of each stage
    #[arg(long, global = true)]
    pub verbose: bool,
}

/// Options of `resample volsplat`.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct VolsplatArgs {
    /// Volume file, folder of slices or pattern such as 'slices/*.tif'
    ///
    /// The format is told by the file's content: NRRD, MetaImage, NIfTI, NumPy .npy, VTK .vti, TIFF stacks, DICOM or OME-Zarr. A
    /// file without a known header is raw and needs --dims and --type.
    #[arg(value_name = "VOLUME")]
    pub input: PathBuf,
    /// Picture to write, .png or .exr; a pattern such as %04d is replaced by the number of the picture
    ///
    /// With .apng or .webp, all pictures go into one animation; with .mp4, .webm or .mkv into one video, which needs the
    /// program ffmpeg.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Also write counts and times as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// How the file is read.
    #[command(flatten)]
    pub volume: VolumeArgs,
    /// How values become colour and opacity.
    #[command(flatten)]
    pub transfer: TransferArgs,
    /// What else is drawn, and what is not.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// From where it is seen.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// How many pictures there are.
    #[command(flatten)]
    pub sequence: SequenceArgs,
    /// How it is drawn.
    #[command(flatten)]
    pub render: Given<RenderArgs>,
    #[command(flatten)]
    pub ask: AskArgs,
    /// How the picture is written.
    #[command(flatten)]
    pub picture: PictureArgs,
}

/// From where the volume is seen.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Camera")]
pub(crate) struct CameraArgs {
    /// Camera file; a JSON list of cameras renders one numbered picture for each
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["orbit", "up", "projection"])]
    pub camera: Option<PathBuf>,
    /// Azimuth and elevation of the eye in degrees, around what is visible; DIST multiplies the distance that
    /// just fits the view (orthographic: the height of the view) [default: 30,20,1]
    #[arg(long, value_name = "AZ,EL[,DIST]", value_parser = values::orbit, allow_hyphen_values = true)]
    pub orbit: Option<Orbit>,
    /// Vertical field of view in degrees, where no camera file gives one
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view, default_value = "30")]
    pub fov: f64,
    /// World axis that points up in the picture [default: the file's own idea, else y]
    #[arg(long, value_name = "AXIS", value_parser = values::axis, allow_hyphen_values = true)]
    pub up: Option<Axis>,
    /// Perspective or parallel view
    #[arg(long, value_enum, default_value = "perspective")]
    pub projection: ProjectionArg,
    /// Picture size in pixels [default: 800x800, or the size that the camera file gives]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<Size>,
}

impl Default for CameraArgs {
    fn default() -> Self {
        defaults::defaults()
    }
}

/// How the volume is drawn.
#[derive(Args, Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", default)]
#[command(next_help_heading = "Rendering")]
pub(crate) struct RenderArgs {
    /// Order in which voxels are composited [default: image-sheets; every-sample where one of its own options is
    /// given, or where the volume is a single slice]
    #[arg(long, value_enum)]
    pub order: Option<OrderArg>,
    /// How the opacity of a voxel becomes the opacity of a pixel [default: extinction]
    #[arg(long, value_enum)]
    pub opacity: Option<OpacityArg>,
    /// Stop a ray once its remaining transmittance falls below T (0: never) [default: 0.001953125]
    #[arg(long, value_name = "T", value_parser = values::fraction)]
    pub min_transmittance: Option<f32>,
    /// How samples are lit, by the gradient of the volume [default: none]
    #[arg(long, value_enum)]
    pub shade: Option<ShadeArg>,
    /// Direction towards the light, in the world [default: the light is at the camera]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true, requires = "shade")]
    #[serde(skip)]
    pub light: Option<DVec3>,
    /// Multiply the extinction by a ramp over the length of the gradient: 0 at LOW, 1 at HIGH, value per world unit
    #[arg(long, value_name = "LOW,HIGH", value_parser = values::ramp)]
    pub gradient_opacity: Option<[f64; 2]>,
    /// Which part of the volume is drawn.
    #[command(flatten)]
    #[serde(skip)]
    pub clip: ClipArgs,
    /// What a pixel shows of its ray.
    #[command(flatten)]
    #[serde(flatten)]
    pub blend: BlendArgs,
    #[command(flatten)]
    #[serde(flatten)]
    pub sheets: SheetArgs,
    #[command(flatten)]
    #[serde(flatten)]
    pub samples: SampleArgs,
}

/// Options of the image-sheets order.
#[derive(Args, Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", default)]
#[command(next_help_heading = "Rendering, order image-sheets")]
pub(crate) struct SheetArgs {
    /// Thickness of a slab along the view, in voxels [default: 0.5]
    #[arg(long, value_name = "VOXELS", value_parser = values::positive)]
    pub slab: Option<f64>,
    /// Sub-pixels along a pixel's side: 1, 2, 4, 8, 16, or auto, about two a voxel, or one a sample in every-sample
    /// (every order) [default: auto; in axis-sheets it is 1]
    #[arg(long, value_name = "N|auto", value_parser = values::subpixels)]
    #[serde(with = "values::subpixels_word")]
    pub subpixel: Option<Subpixels>,
    /// Far bricks are drawn from merged blocks or fewer sheets where no pixel is predicted to change by more than this;
    /// 0 never does [default: 0.001953125]
    #[arg(long, value_name = "E", value_parser = values::fraction)]
    pub lod_error: Option<f32>,
    /// How the sums of a sheet are formed; the picture is the same [default: gather]
    #[arg(long, value_enum)]
    pub sheet_sums: Option<SheetSumsArg>,
    /// What the transfer function is applied to [default: post; the other orders classify voxels]
    #[arg(long, value_enum)]
    pub classify: Option<ClassifyArg>,
}

/// How the picture is written.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Picture")]
pub(crate) struct PictureArgs {
    /// Bits per channel of a PNG [default: 8]
    #[arg(long, value_name = "8|16", value_parser = values::bits)]
    pub bits: Option<u8>,
    /// Background: transparent, white, black, #rrggbb, R,G,B from 0 to 255 (sRGB), or a picture file, which is
    /// scaled until it covers the picture [default: transparent]
    #[arg(long, value_name = "COLOUR|FILE", value_parser = values::background)]
    pub background: Option<BackgroundWord>,
}

/// Perspective or parallel view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProjectionArg {
    /// Things far away are smaller
    Perspective,
    /// Parallel rays
    Orthographic,
}

/// Order of compositing.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum OrderArg {
    /// Slabs parallel to the picture, classified per sub-pixel: sharp and antialiased
    ImageSheets,
    /// Each voxel over those behind it, as point or splat
    EverySample,
    /// Slices of voxels, summed, one over another: jumps as the view turns, for comparison
    AxisSheets,
}

/// How samples are lit.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ShadeArg {
    /// Not at all: the colours of the transfer function
    None,
    /// Ambient and diffuse light
    Lambert,
    /// With a highlight
    Phong,
}

/// How the sums of a sheet are formed.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SheetSumsArg {
    /// Sample by sample, from the eight voxels around it
    Gather,
    /// Voxel by voxel; slower, for comparison
    Scatter,
}

/// How the opacity of a voxel becomes the opacity of a pixel.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum OpacityArg {
    /// Exact transmittance, however many footprints overlap
    Extinction,
    /// Opacity times footprint, for comparison
    Linear,
}

/// How a perspective footprint is evaluated.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum FootprintArg {
    /// Ellipse around the projected centre
    AffineApprox,
    /// Exact ellipse around its midpoint
    Affine,
    /// Exact ellipse, index corrected by the cone angle
    Table,
    /// Exact distance from the ray
    Exact,
}

/// What the transfer function is applied to.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ClassifyArg {
    /// Voxels, before they are summed
    Pre,
    /// The interpolated value, after the sum
    Post,
}

/// Shape of the reconstruction kernel.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum KernelArg {
    /// Trilinear interpolation (image-sheets)
    Trilinear,
    /// Truncated Gaussian
    Gaussian,
    /// Compact polynomial
    Polynomial,
    /// Cubic B-spline
    BSpline,
}

/// Which voxels are drawn as points and which as splats.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SelectArg {
    /// Small ones as points, large ones as splats
    Hybrid,
    /// All as points
    Points,
    /// All as splats
    Splats,
    /// All as footprints convolved with the pixel's Gaussian
    Ewa,
}

/// What gives a voxel its colour.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ColourByArg {
    /// The transfer function
    Transfer,
    /// Red for splats, the transfer function for points
    Select,
}
