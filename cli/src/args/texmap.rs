//! Options of `resample texmap`; see `args.rs`.
//!
//! Takes words, gives plain values. Camera, sequence and picture options are those of every command that draws.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{AskArgs, CameraArgs, PictureArgs, SequenceArgs};
use crate::values;

/// Options of `resample texmap`.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct TexmapArgs {
    /// Mesh file: glTF 2.0 (.gltf, .glb) or OBJ with its .mtl; the format is told by the content
    #[arg(value_name = "MODEL")]
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
    /// What of the file is drawn.
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
    pub render: TexmapRenderArgs,
    #[command(flatten)]
    pub ask: AskArgs,
    /// How the picture is written.
    #[command(flatten)]
    pub picture: PictureArgs,
}

/// What of the file is drawn.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Model")]
pub(crate) struct ModelArgs {
    /// Scene of the file, by name or by number from 0 [default: the file's own]
    #[arg(long, value_name = "NAME|INDEX")]
    pub scene: Option<String>,
    /// Camera of the file, by name or by number from 0 [default: the whole model, framed]
    #[arg(long, value_name = "NAME|INDEX", conflicts_with_all = ["camera", "orbit", "up", "projection", "turntable"])]
    pub camera_name: Option<String>,
    /// Picture for meshes that have texture coordinates and no texture
    #[arg(long, value_name = "FILE")]
    pub texture: Option<PathBuf>,
}

/// How a mesh is drawn.
#[derive(Args, Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", default)]
#[command(next_help_heading = "Rendering")]
pub(crate) struct TexmapRenderArgs {
    /// How texels become pixels [default: hybrid]
    #[arg(long, value_enum)]
    pub method: Option<TexmapMethodArg>,
    /// How a texel's place on the screen is found [default: exact]
    #[arg(long, value_enum)]
    pub footprint: Option<FlatFootprintArg>,
    /// How surfaces are lit [default: auto]
    #[arg(long, value_enum)]
    pub shade: Option<MeshShadeArg>,
    /// Direction towards the light, in the world, for --shade lambert [default: 0.4,1,0.6]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true, requires = "shade")]
    #[serde(skip)]
    pub light: Option<DVec3>,
    /// Sub-pixels along a pixel's side at which visibility is decided: 1, 2, 3, 4 or 8 [default: 4]
    #[arg(long, value_name = "N")]
    pub subpixel: Option<u32>,
    /// From which level of the texture's pyramid small texels are taken [default: auto]
    #[arg(long, value_enum)]
    pub level: Option<LevelArg>,
    /// Most texels that one pixel gathers from one surface [default: 1024]
    #[arg(long, value_name = "N")]
    pub max_texels: Option<u32>,
    /// Planes of an EXR file beside its colour [default: all]
    #[arg(long, value_enum, value_name = "NAMES", value_delimiter = ',')]
    pub layers: Option<Vec<LayerArg>>,
}

/// How texels become pixels.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum TexmapMethodArg {
    /// Small texels are points gathered by the pixel, large ones splats
    Hybrid,
    /// Every texel is a point; large ones leave holes
    Point,
    /// Large texels are split into points
    Supersample,
    /// Look-up: the nearest texel
    BackwardNearest,
    /// Look-up: four texels
    BackwardBilinear,
    /// Look-up: eight texels of two levels
    BackwardTrilinear,
    /// Look-up: elliptical average, at most 16 times longer than wide
    BackwardEwa,
}

/// How a texel's place on the screen is found.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum FlatFootprintArg {
    /// Ellipse from the derivatives at the texel
    Affine,
    /// Exact projection of the texel's disc
    Exact,
}

/// How surfaces are lit.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum MeshShadeArg {
    /// Unlit where the material says so, a headlight otherwise
    Auto,
    /// The plain colours
    Unlit,
    /// A light at the eye
    Headlight,
    /// A distant light, see --light
    Lambert,
}

/// From which level of the pyramid texels are taken.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LevelArg {
    /// The level whose texels are just under the pixel
    Auto,
    /// The full texture, however many texels a pixel holds
    Full,
}

/// A plane of an EXR file.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LayerArg {
    /// Distance along the view: channel Z
    Depth,
    /// World normal: channels normal.X, normal.Y and normal.Z
    Normal,
    /// Share of the pixel that is covered: channel coverage
    Coverage,
    /// Share that is laid as points: channel selection
    Selection,
    /// Texels per pixel: channel texels
    Texels,
}
