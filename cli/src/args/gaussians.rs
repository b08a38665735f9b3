//! Options of `resample gaussians`; see `args.rs`.
//!
//! Takes words, gives plain values. Camera, sequence and picture options are those of every command that draws.

use std::path::PathBuf;

use clap::Args;
use resample_core::simd::SimdLevel;
use volsplat::{ClipPlane, GaussianLayer, GaussianModel, GaussianOptions, Gaussians, PixelSamples};

use super::{AskArgs, CameraArgs, FigureArgs, Given, PictureArgs, ReadingArgs, SequenceArgs};
use crate::values;
use crate::values::input_file;
use crate::values::input_file::{InputFile, Source};

/// Options of `resample gaussians`.
#[derive(Args, Clone, Debug, Default)]
pub struct GaussiansArgs {
    /// File of 3-D Gaussians: PLY (as INRIA's code writes it, or compressed), .splat, SPZ, SOG (archive, folder or its meta.json), glTF
    /// with KHR_gaussian_splatting
    ///
    /// The format is detected by the content.
    #[arg(value_name = "FILE", value_parser = input_file::parser())]
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
    /// Source of the Gaussians: their file, or memory.
    #[arg(skip)]
    pub source: Source<Gaussians>,
    /// Rules of reading.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// From where they are seen.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// How many pictures there are.
    #[command(flatten)]
    pub sequence: SequenceArgs,
    /// How they are drawn.
    #[command(flatten)]
    pub render: Given<GaussianRenderArgs>,
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

/// How Gaussians are drawn.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Rendering")]
pub struct GaussianRenderArgs {
    /// Meaning of a Gaussian; all but the volume are twins of other viewers, to compare pictures with
    ///
    /// Only the volume takes --slab-error and --samples. A picture of another viewer is nearest to the model that it follows: draw each
    /// from the same camera, and ask resample compare.
    #[arg(long, value_enum, default_value_t)]
    pub model: GaussianModel,
    /// Thickness of the slabs in which Gaussians are summed, by its error: the most that the order inside a slab may change a colour
    /// before the slab corrects it, above 0, at most 1
    ///
    /// Smaller is more exact and slower. The error that is left in the picture is far smaller; --max-error measures it.
    #[arg(long, value_name = "E", value_parser = values::share,
        default_value_t = GaussianOptions::default().slab_error)]
    pub slab_error: f32,
    /// Samples of a pixel
    #[arg(long, value_enum, default_value = "auto")]
    pub samples: PixelSamples,
    /// Stop a ray once its remaining transmittance falls below T (0: never)
    #[arg(long, value_name = "T", value_parser = values::fraction,
        default_value_t = GaussianOptions::default().min_transmittance)]
    pub min_transmittance: f32,
    /// SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    #[arg(long, value_enum, default_value = "auto")]
    pub vector_level: SimdLevel,
    /// Planes of an EXR file beside colour and mean depth (Z) [default: none]
    #[arg(long, value_enum, value_name = "NAMES", value_delimiter = ',')]
    pub layers: Option<Vec<GaussianLayer>>,
    /// The part that is drawn.
    #[command(flatten)]
    pub clip: GaussianClipArgs,
}

/// The part of the Gaussians that is drawn: a Gaussian that a side crosses is cut there.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Clipping")]
pub struct GaussianClipArgs {
    /// Draw only the inside of a box along the world's axes, from the first corner to the second
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = values::corners, allow_hyphen_values = true)]
    pub crop: Option<[[f64; 3]; 2]>,
    /// Draw only the side of a plane where NX x + NY y + NZ z >= D, in the world; up to six times
    #[arg(long, value_name = "NX,NY,NZ,D", value_parser = values::plane, allow_hyphen_values = true)]
    pub clip_plane: Vec<ClipPlane>,
}
