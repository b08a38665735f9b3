//! Arguments of the commands that draw no picture of a file of their own.

use std::ffi::OsString;
use std::net::IpAddr;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use clap_complete::Shell;

use crate::args::{
    Drawing, GaussiansArgs, PointsArgs, TexmapArgs, VolsplatArgs, VolumeArgs, Warp3dArgs,
    short_help,
};
use crate::values;
use crate::values::input_file::InputFile;
use crate::values::{Size, input_file};

/// Options of `resample bench`.
#[derive(Args, Clone, Debug)]
pub struct BenchArgs {
    /// The table.
    #[command(subcommand)]
    pub table: BenchTable,
}

/// The tables that can be repeated.
#[derive(Clone, Debug, Subcommand)]
pub enum BenchTable {
    /// Footprint modes and kernels of the every-sample order, near and wide: error and cost
    Footprint(BenchSceneArgs),
    /// Orders of compositing: error, cost, and how much a picture jumps while the view turns
    Orders(BenchSceneArgs),
    /// Texture filters on a ground and a ball: error, cost and shimmer
    Texture(BenchSceneArgs),
    /// Methods of warping a picture with depth, against the true view: error and cost
    Warp(BenchSceneArgs),
}

/// Options of the tables over built-in scenes.
#[derive(Args, Clone, Debug)]
pub struct BenchSceneArgs {
    /// Frames of each setting; the median of their CPU times counts
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub reps: u16,
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "320x240")]
    pub size: Size,
}

/// Options of `resample compare`.
#[derive(Args, Clone, Debug)]
pub struct CompareArgs {
    /// Picture to judge: .png, .apng or .exr, or numbered pictures such as out/a_%04d.png
    #[arg(value_name = "PICTURE")]
    pub picture: PathBuf,
    /// Picture to compare with: the same kinds and the same size
    #[arg(value_name = "REFERENCE")]
    pub reference: PathBuf,
    /// Compare only where this picture is lighter than middle grey and not transparent
    #[arg(long, value_name = "FILE", conflicts_with = "inside")]
    pub within: Option<PathBuf>,
    /// Compare only where the reference shows something: where its alpha is above 1/255
    #[arg(long)]
    pub inside: bool,
    /// Write the FLIP error of each pixel as colours, black for none to bright for 1 (of several: the worst picture)
    #[arg(long, value_name = "FILE.png", value_parser = values::png_name)]
    pub heatmap: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Exit with 1 if a figure is above a bound, such as flip=0.02; may be repeated
    ///
    /// For psnr, alpha-psnr and ssim, where more is better: if it is below.
    #[arg(long = "fail-above", value_name = "METRIC=VALUE", value_parser = values::metric_bound)]
    pub bounds: Vec<(String, f64)>,
}

/// Options of `resample completions`.
#[derive(Args, Clone, Copy, Debug)]
pub struct CompletionsArgs {
    /// Shell that completes
    pub shell: Shell,
}

/// Options of `resample man`.
#[derive(Args, Clone, Debug)]
pub struct ManArgs {
    /// Folder for the pages; it must exist
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
}

/// Options of `resample demo`.
#[derive(Args, Clone, Debug)]
pub struct DemoArgs {
    /// Folder for the page, its pictures and the scenes' files; it is made if it does not exist
    #[arg(short, long, value_name = "FOLDER", default_value = "demo")]
    pub output: PathBuf,
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "512x512")]
    pub size: Size,
}

/// Options of `resample info`.
#[derive(Args, Clone, Debug)]
pub struct InfoArgs {
    /// Volume, 3-D Gaussians, mesh, scan, picture or depth; a folder of slices, or a pattern such as 'slices/*.tif'; FILE#PART reads a part of the file
    #[arg(value_name = "FILE[#PART]", value_parser = input_file::parser())]
    pub input: InputFile,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// How the file is read.
    #[command(flatten)]
    pub volume: VolumeArgs,
}

/// Options of `resample join`.
#[derive(Args, Clone, Debug)]
pub struct JoinArgs {
    /// Files that --tile wrote: all tiles of a picture, or of several
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    /// Picture to write, of the kind that the tiles were drawn for; a pattern such as %04d is replaced by the number of the picture
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// The words after `resample trade`.
#[derive(Args, Clone, Debug)]
pub struct TradeArgs {
    /// The measured command.
    #[command(subcommand)]
    pub measured: Measured,
}

/// The command that is measured.
#[derive(Clone, Debug, Subcommand)]
pub enum Measured {
    /// Measure how a mesh is drawn
    #[command(mut_args(short_help::texmap), mut_arg("output", unwritten))]
    Texmap(Box<MeasuredMesh>),
    /// Measure how a volume is drawn
    #[command(mut_args(short_help::volsplat), mut_arg("output", unwritten), mut_arg("input", |input| input.required(false).default_value("").hide_default_value(true)))]
    Volsplat(Box<MeasuredVolume>),
    /// Measure how 3-D Gaussians are drawn
    #[command(mut_args(short_help::gaussians), mut_arg("output", unwritten))]
    Gaussians(Box<MeasuredGaussians>),
    /// Measure how a picture with depth is shown
    #[command(
        name = "warp3d",
        mut_args(short_help::warp3d),
        mut_arg("output", unwritten)
    )]
    Warp3d(Box<MeasuredDepth>),
    /// Measure how a scan of points is drawn
    #[command(mut_args(short_help::points), mut_arg("output", unwritten))]
    Points(Box<MeasuredPoints>),
}

/// A mesh and the measurement.
#[derive(Args, Clone, Debug)]
pub struct MeasuredMesh {
    #[command(flatten)]
    measurement: TradeOptions,
    #[command(flatten, next_help_heading = None::<&str>)]
    drawing: TexmapArgs,
}

/// A volume and the measurement.
#[derive(Args, Clone, Debug)]
pub struct MeasuredVolume {
    #[command(flatten)]
    measurement: TradeOptions,
    /// A built-in scene instead of a file
    #[arg(
        long,
        value_enum,
        help_heading = short_help::MEASUREMENT,
        conflicts_with = "input"
    )]
    scene: Option<SceneArg>,
    #[command(flatten, next_help_heading = None::<&str>)]
    drawing: VolsplatArgs,
}

/// Gaussians and the measurement.
#[derive(Args, Clone, Debug)]
pub struct MeasuredGaussians {
    #[command(flatten)]
    measurement: TradeOptions,
    #[command(flatten, next_help_heading = None::<&str>)]
    drawing: GaussiansArgs,
}

/// A picture with depth and the measurement.
#[derive(Args, Clone, Debug)]
pub struct MeasuredDepth {
    #[command(flatten)]
    measurement: TradeOptions,
    #[command(flatten, next_help_heading = None::<&str>)]
    drawing: Warp3dArgs,
}

/// A scan and the measurement.
#[derive(Args, Clone, Debug)]
pub struct MeasuredPoints {
    #[command(flatten)]
    measurement: TradeOptions,
    #[command(flatten, next_help_heading = None::<&str>)]
    drawing: PointsArgs,
}

/// Options of the measurement.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = short_help::MEASUREMENT)]
pub struct TradeOptions {
    /// Folder for the report; it is made if it does not exist
    #[arg(long, value_name = "FOLDER", default_value = "trade-report")]
    pub out: PathBuf,
    /// Comma-separated parameters to vary jointly, in addition to one at a time
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub settings: Vec<String>,
    /// Frames of each setting; the median counts
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub reps: u16,
    /// Picture to compare with, instead of that of the slowest, most exact setting
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// Measure how errors flicker over sixteen steps of a sixteenth of a pixel
    #[arg(long)]
    pub flicker: bool,
    /// Draw one picture and print its time and memory, for the measurement itself
    #[arg(long, hide = true)]
    pub probe: bool,
}

/// The built-in scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SceneArg {
    /// Opaque cells with sharp edges
    CheckerBox,
    /// Ripples that are hard to reconstruct
    MarschnerLobb,
    /// Soft translucent matter
    Blobs,
}

/// Never written; any valid file name will do.
fn unwritten(output: clap::Arg) -> clap::Arg {
    output
        .required(false)
        .hide(true)
        .default_value("picture.exr")
}

impl TradeArgs {
    /// The measurement, the measured command, and a built-in scene in place of its file.
    pub fn parts(self) -> (TradeOptions, Drawing, Option<SceneArg>) {
        match self.measured {
            Measured::Texmap(args) => (
                args.measurement,
                Drawing::Texmap(Box::new(args.drawing)),
                None,
            ),
            Measured::Volsplat(args) => (
                args.measurement,
                Drawing::Volsplat(Box::new(args.drawing)),
                args.scene,
            ),
            Measured::Gaussians(args) => (
                args.measurement,
                Drawing::Gaussians(Box::new(args.drawing)),
                None,
            ),
            Measured::Warp3d(args) => (
                args.measurement,
                Drawing::Warp3d(Box::new(args.drawing)),
                None,
            ),
            Measured::Points(args) => (
                args.measurement,
                Drawing::Points(Box::new(args.drawing)),
                None,
            ),
        }
    }
}

/// Options of `resample view`.
#[derive(Args, Clone, Debug)]
pub struct ViewArgs {
    /// How the page is served.
    #[command(flatten)]
    pub serve: ServeArgs,
    /// A volume, 3-D Gaussians, a mesh, a scan, or a picture and its depth; then any options of the command that draws it
    #[arg(value_name = "FILE [OPTIONS]", required = true, num_args = 1.., trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<OsString>,
}

/// How the page is served.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Page")]
pub struct ServeArgs {
    /// Do not open a browser; only print the address
    #[arg(long)]
    pub no_open: bool,
    /// Port of the page [default: 7467, or any that is free]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// File of the address's token, made if it is not there: the same address works after a restart on the same --port
    #[arg(long, value_name = "FILE")]
    pub token_file: Option<PathBuf>,
    /// Address to listen at; any other than the default can be reached by other machines [default: 127.0.0.1]
    #[arg(long, value_name = "ADDRESS")]
    pub bind: Option<IpAddr>,
    /// Additional host name to accept, e.g. behind a reverse proxy; repeatable
    #[arg(long, value_name = "NAME")]
    pub allow_host: Vec<String>,
}

impl ServeArgs {
    /// These options, with `others` as fallback.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            no_open: self.no_open || other.no_open,
            port: self.port.or(other.port),
            token_file: self.token_file.or(other.token_file),
            bind: self.bind.or(other.bind),
            allow_host: [self.allow_host, other.allow_host].concat(),
        }
    }
}

/// Options of `resample thumbnails`.
#[derive(Args, Clone, Debug)]
pub struct ThumbnailsArgs {
    /// Volumes, 3-D Gaussians, meshes and scans of any format
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Folder of the thumbnails, FILE.png each, and of contact-sheet.png
    #[arg(short, long, value_name = "FOLDER")]
    pub output: PathBuf,
    /// Width and height of a thumbnail, px
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub size: u32,
    /// Columns of the contact sheet [default: as many as rows]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=64))]
    pub columns: Option<u16>,
    /// Options for all files, as the command that draws them takes them: -- --environment room.hdr
    #[arg(last = true, value_name = "OPTION")]
    pub options: Vec<OsString>,
}
