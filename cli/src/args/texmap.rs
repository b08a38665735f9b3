//! Options of `resample texmap`; see `args.rs`.
//!
//! Takes words, gives plain values. Camera, sequence and picture options are those of every command that draws.

use std::path::PathBuf;

use clap::Args;
use texmap::{Loaded, RenderOptions, Textures};

use super::{AskArgs, CameraArgs, FigureArgs, Given, PictureArgs, ReadingArgs, SequenceArgs};
use crate::values::input_file;
use crate::values::input_file::{InputFile, Source};

/// Options of `resample texmap`.
#[derive(Args, Clone, Debug, Default)]
pub struct TexmapArgs {
    /// Mesh file: glTF 2.0 (.gltf, .glb), OBJ with its .mtl, PLY or STL; FILE#SCENE is a scene of the file, by name or number from 0
    ///
    /// The format is detected by the content.
    #[arg(value_name = "MODEL[#SCENE]", value_parser = input_file::parser())]
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
    /// Source of the mesh: its file, or memory.
    #[arg(skip)]
    pub source: Source<Loaded>,
    /// The part of the file that is drawn.
    #[command(flatten)]
    pub model: ModelArgs,
    /// From where it is seen.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// How many pictures there are.
    #[command(flatten)]
    pub sequence: SequenceArgs,
    /// How it is drawn.
    #[command(flatten)]
    pub render: Given<RenderOptions>,
    /// An error or a time that is asked for.
    #[command(flatten)]
    pub ask: AskArgs,
    /// The parts of a figure.
    #[command(flatten)]
    pub figure: FigureArgs,
    /// How the picture is written.
    #[command(flatten)]
    pub picture: PictureArgs,
}

/// The part of the file that is drawn.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Model")]
pub struct ModelArgs {
    /// Camera of the file, by name or by number from 0 [default: the whole model, framed]
    #[arg(long, value_name = "NAME|INDEX", conflicts_with_all = ["camera", "orbit", "up", "projection", "turntable"])]
    pub camera_name: Option<String>,
    /// Animation time at which to pose the model, in seconds [default: the pose of the file]
    #[arg(long, value_name = "SECONDS", value_parser = crate::values::number, allow_hyphen_values = true)]
    pub pose_time: Option<f64>,
    /// Animation of --pose-time or --play, by name or by number from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub animation: Option<String>,
    /// Advance the animation across the frames of --turntable or --path, from --pose-time, at --fps
    #[arg(long)]
    pub play: bool,
    /// Equirectangular picture of the light around the model, .hdr or .exr [default: a neutral studio]
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,
    /// Picture for meshes that have texture coordinates and no texture
    #[arg(long, value_name = "FILE")]
    pub texture: Option<PathBuf>,
    /// Pictures of the surfaces
    #[arg(long, value_enum, default_value_t)]
    pub textures: Textures,
    /// Rules of reading.
    #[command(flatten)]
    pub reading: ReadingArgs,
}
