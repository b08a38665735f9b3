//! The command line as clap structs, whose doc comments are the help texts.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked. `settings.rs` turns these
//! structs into the options of the libraries, which own the enums, their words and their defaults.

pub(crate) mod tools;
pub(crate) mod volume;
pub mod words;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use resample_core::Projection;

pub use crate::args::volume::{
    BlendArgs, ChannelArgs, ClipArgs, ComponentLook, LookWords, OrderName, RayBlend, ReadingArgs,
    RenderArgs, SceneArgs, TransferArgs, VolumeArgs, VolumeLook,
};

use crate::values::input_file::{HeldVolumes, InputFile, Source};
use crate::values::{self, Axis, BackgroundWord, LookOf, Orbit, Size, input_file};

mod drawing;
mod figure;
mod gaussians;
mod given;
mod points;
mod sequence;
mod short_help;
mod texmap;
mod warp3d;

pub use crate::args::given::listed;
pub use crate::args::sequence::{AskArgs, PartArgs};
pub use crate::args::tools::{
    BenchArgs, BenchSceneArgs, BenchTable, CompareArgs, CompletionsArgs, DemoArgs, InfoArgs,
    JoinArgs, ManArgs, SceneArg, ServeArgs, ThumbnailsArgs, TradeArgs, TradeOptions, ViewArgs,
};
pub(crate) use crate::args::words::tips::with_tip;
pub use drawing::Drawing;
pub use figure::{AxesKind, FigureArgs};
pub use gaussians::{GaussianClipArgs, GaussianRenderArgs, GaussiansArgs};
pub use given::{Given, names_of};
pub use points::{ColourBy, PointsArgs, PointsLookArgs, PointsPartArgs, PointsRenderArgs};
pub use sequence::SequenceArgs;
pub use texmap::{ModelArgs, TexmapArgs};
pub use warp3d::{DepthArgs, LayoutWord, Warp3dArgs, WarpCameraArgs};

/// How the command is left out, and the exit codes of all commands.
const EXIT_CODES: &str = "\
resample FILE -o PICTURE finds the command that draws a file by its content.

Exit codes:
  0    everything that was asked for is written
  1    a file could not be written although all checks had passed, a bound of compare is broken, or some of the files of thumbnails
       could not be drawn
  2    the input or the options are bad; nothing is written
  130  Ctrl-C; what is finished is kept";

/// Forward resampling: clean pictures from discrete samples
#[derive(Clone, Debug, Parser)]
#[command(name = "resample", version, max_term_width = 110, after_help = EXIT_CODES)]
pub struct Cli {
    /// The command.
    #[command(subcommand)]
    pub command: Command,
    /// Options of every command.
    #[command(flatten)]
    pub global: GlobalArgs,
}

/// The commands.
#[derive(Clone, Debug, Subcommand)]
pub enum Command {
    /// Draw built-in scenes of every kind on one page: needs no file, takes seconds
    Demo(DemoArgs),
    /// Describe a volume, 3-D Gaussians, a mesh, a scan, a picture or a depth image, and name the command that draws it
    ///
    /// Example: resample info head.nii.gz
    Info(InfoArgs),
    /// Reproduce the published tables on this machine
    Bench(BenchArgs),
    /// Compare a picture or an animation with its reference: PSNR, SSIM, FLIP and more
    ///
    /// Example: resample compare mine.png truth.exr --heatmap errors.png --fail-above flip=0.02
    Compare(CompareArgs),
    /// Join tiles written with --tile; byte-identical to an undivided run
    ///
    /// Example: resample join head.tile-*.exr -o head.png
    Join(JoinArgs),
    /// Draw a small picture of each of many files, and a sheet of all of them
    ///
    /// Example: resample thumbnails models/*.glb scans/*.nrrd -o previews
    Thumbnails(ThumbnailsArgs),
    /// Measure cost and error of every choice on a scene: error against time, as one page with pictures
    ///
    /// Example: resample trade volsplat engine.nrrd --transfer tf.json --out report --settings slab,subpixel
    Trade(TradeArgs),
    /// Look at a file live, in a browser: turn, zoom, edit the transfer function
    ///
    /// Example: resample view head.nrrd --shade phong
    View(ViewArgs),
    /// Print the completions of a shell: which words may follow
    ///
    /// Example: resample completions bash > ~/.local/share/bash-completion/completions/resample
    Completions(CompletionsArgs),
    /// Write manual pages, one for each command
    ///
    /// Example: resample man ~/.local/share/man/man1
    Man(ManArgs),
    /// The commands that draw.
    #[command(flatten)]
    Draw(Drawing),
}

/// Options of every command.
#[derive(Args, Clone, Debug)]
pub struct GlobalArgs {
    /// Number of threads [default: all processors]; the picture is the same for any number
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print warnings and errors only
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print the time of each stage
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Begin with the words of a session that `resample view` has saved; options that are typed win over its own
    #[arg(long, global = true, value_name = "FILE.json")]
    pub session: Option<PathBuf>,
}

/// Options of `resample volsplat`.
#[derive(Args, Clone, Debug, Default)]
pub struct VolsplatArgs {
    /// Volume file, folder of slices or pattern such as 'slices/*.tif'; FILE#PART reads a part of the file
    ///
    /// The format is detected by the content: NRRD, MetaImage, NIfTI, MGH, NumPy .npy, VTK .vti and .vtk, TIFF stacks, slices in PNG
    /// or JPEG, DICOM or OME-Zarr. A file without a known header is raw and needs --dims and --type. Parts are series=UID (DICOM),
    /// array=NAME (VTK), component=N, time=N (NIfTI, MGH, TIFF, OME-Zarr) and level=N (OME-Zarr), counted from 0 and separated by
    /// commas: image.zarr#level=2,time=5. A volume over time is a pattern such as 't%04d.vti' or 't*.npy', a list (.txt), or time=all or
    /// time=A..B, and gives a picture for each step. A file of 3-D Gaussians is drawn as by `resample gaussians`, whose options it then has.
    #[arg(value_name = "VOLUME[#PART]", value_parser = input_file::parser())]
    pub input: InputFile,
    /// Picture to write, .png, .jpg or .exr, or - for the standard output; a pattern such as %04d is replaced by the number of the picture
    ///
    /// With .apng, .webp or .gif, all pictures go into one animation; with .mp4, .webm or .mkv into one video, which needs the
    /// program ffmpeg.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Also write counts and times as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Source of the volume: its file, or memory.
    #[arg(skip)]
    pub source: Source<HeldVolumes>,
    /// How the file is read.
    #[command(flatten)]
    pub volume: VolumeArgs,
    /// How values become colour and opacity.
    #[command(flatten)]
    pub transfer: TransferArgs,
    /// Channels, labels and masks.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// From where it is seen.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// How many pictures there are.
    #[command(flatten)]
    pub sequence: SequenceArgs,
    /// The step of a volume over time that decides look and view, counted from 0; all: the values of all of them
    #[arg(long, value_name = "all|STEP", value_parser = values::look_of, default_value = "all", help_heading = "Several pictures")]
    pub look_of: LookOf,
    /// The step that all pictures show; the viewer's page sets it for a turntable.
    #[arg(skip)]
    pub only_step: Option<usize>,
    /// How it is drawn.
    #[command(flatten)]
    pub render: Given<RenderArgs>,
    /// The parts of a figure.
    #[command(flatten)]
    pub figure: FigureArgs,
    /// An error or a time that is asked for.
    #[command(flatten)]
    pub ask: AskArgs,
    /// How the picture is written.
    #[command(flatten)]
    pub picture: PictureArgs,
}

/// From where the volume is seen.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// Camera file; a JSON list of cameras renders one numbered picture for each
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["orbit", "up", "projection"])]
    pub camera: Option<PathBuf>,
    /// Also write the view as a camera file, from which --camera draws the same bytes
    #[arg(long, value_name = "FILE.json")]
    pub save_camera: Option<PathBuf>,
    /// Azimuth and elevation of the eye in degrees, around the visible part; DIST multiplies the distance at
    /// which that fills 0.85 of the picture (orthographic: the height of the view) [default: 30,20,1]
    #[arg(long, value_name = "AZ,EL[,DIST]", value_parser = values::orbit, allow_hyphen_values = true)]
    pub orbit: Option<Orbit>,
    /// Vertical field of view in degrees, where no camera file gives one
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view, default_value = "30")]
    pub fov: f64,
    /// World axis that points up in the picture [default: as stored in the file, else y; of Gaussians in PLY, .splat and SOG -y]
    #[arg(long, value_name = "AXIS", value_parser = values::axis, allow_hyphen_values = true)]
    pub up: Option<Axis>,
    /// Perspective or parallel view
    #[arg(long, value_enum, default_value = "perspective")]
    pub projection: Projection,
    /// Picture size in pixels [default: 800x800, or the size that the camera file gives]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<Size>,
}

/// How the picture is written.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Picture")]
pub struct PictureArgs {
    /// Bits per channel of a PNG [default: 8]
    #[arg(long, value_name = "8|16", value_parser = values::bits)]
    pub bits: Option<u8>,
    /// Background: transparent, white, black, #rrggbb, R,G,B from 0 to 255 (sRGB), or a picture file, which is
    /// scaled until it covers the picture [default: transparent]
    #[arg(long, value_name = "COLOUR|FILE", value_parser = values::background)]
    pub background: Option<BackgroundWord>,
    /// Where it goes.
    #[arg(skip)]
    pub goes: Goes,
}

/// Where pictures go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Goes {
    /// To the file of `--output`.
    #[default]
    File,
    /// To the file of `--output`, or to numbered ones: none of them may exist yet.
    NewFile,
    /// To the program that uses this library: nothing is written, and the name only says which format it would have.
    Memory,
}

given::defaults_untyped!(CameraArgs);
