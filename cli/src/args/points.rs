//! Options of `resample points`; see `args.rs`.
//!
//! Takes words, gives plain values. Camera, sequence and picture options are those of every command that draws.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;
use resample_cloud::input::PointCloudFile;
use resample_cloud::{Blend, CloudLayer, CloudOptions, Floating, Shade};
use volsplat::ClipPlane;
use volsplat::transfer::ColourMap;

use super::{AskArgs, CameraArgs, FigureArgs, Given, PictureArgs, ReadingArgs, SequenceArgs};
use crate::values::input_file;
use crate::values::input_file::{InputFile, Source};
use crate::values::{self, Axis};

/// Options of `resample points`.
#[derive(Args, Clone, Debug, Default)]
pub struct PointsArgs {
    /// Scan of points: PLY without faces, LAS, LAZ, E57, PCD, PTX, PTS or XYZ
    ///
    /// The format is detected by the content.
    #[arg(value_name = "SCAN", value_parser = input_file::parser())]
    pub input: InputFile,
    /// Picture to write, .png, .jpg or .exr, or - for the standard output; a pattern such as %04d is replaced by the number of the picture
    ///
    /// An EXR file also holds depth (Z), and what --layers says. With .apng, .webp or .gif, all pictures go into one animation; with .mp4, .webm or .mkv into
    /// one video, which needs the program ffmpeg.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Also write counts and times as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Source of the points: their file, or memory.
    #[arg(skip)]
    pub source: Source<PointCloudFile>,
    /// The points that are drawn.
    #[command(flatten)]
    pub part: PointsPartArgs,
    /// Colours of the points.
    #[command(flatten)]
    pub look: PointsLookArgs,
    /// From where they are seen.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// How many pictures there are.
    #[command(flatten)]
    pub sequence: SequenceArgs,
    /// How they are drawn.
    #[command(flatten)]
    pub render: Given<PointsRenderArgs>,
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

/// The points that are drawn.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Points")]
pub struct PointsPartArgs {
    /// Keep at most N points, evenly from the order of the file [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub points: Option<u64>,
    /// Also draw points that float far from all others, and those that the grid of a scanner shows to lie between two surfaces or to be crowded
    ///
    /// They are left out otherwise: a scanner makes them where its beam meets two surfaces, and birds and dust are among them.
    #[arg(long)]
    pub keep_all: bool,
    /// Draw only points inside a box along the world's axes, from the first corner to the second
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = values::corners, allow_hyphen_values = true)]
    pub crop: Option<[[f64; 3]; 2]>,
    /// Draw only points on the side of a plane where NX x + NY y + NZ z >= D, in the world; may be repeated
    #[arg(long, value_name = "NX,NY,NZ,D", value_parser = values::plane, allow_hyphen_values = true)]
    pub clip_plane: Vec<ClipPlane>,
    /// Rules of reading.
    #[command(flatten)]
    pub reading: ReadingArgs,
}

/// Colours of the points.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Colours")]
pub struct PointsLookArgs {
    /// Where colours come from
    #[arg(
        long,
        alias = "colour-by",
        value_enum,
        value_name = "WHAT",
        default_value = "auto"
    )]
    pub color_by: ColourBy,
    /// Colour map of heights and intensities [default: viridis for heights, greys for intensities]
    #[arg(long, alias = "colourmap", value_name = "NAME")]
    pub colormap: Option<ColourMap>,
    /// Heights or intensities at the ends of the colour map [default: those that 2 % of the points lie below and above]
    #[arg(long, alias = "colour-range", value_name = "LOW,HIGH", value_parser = values::ascending, allow_hyphen_values = true)]
    pub color_range: Option<[f64; 2]>,
    /// Axis along which heights are counted, and above which the light of lambert shading stands [default: the one that points up]
    #[arg(long, value_name = "AXIS", value_parser = values::axis, allow_hyphen_values = true)]
    pub height_axis: Option<Axis>,
}

/// Where colours of points come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ColourBy {
    /// The file's colours; without them intensities, without those heights
    #[default]
    Auto,
    /// The file's colours
    #[value(name = "colour", alias = "color")]
    Colour,
    /// The place along the axis that points up
    Height,
    /// The strength of the returns
    Intensity,
    /// The class of each point, such as ground or building
    Class,
    /// The direction of the surface: x, y and z as red, green and blue
    Normal,
}

/// How points are drawn.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Rendering")]
pub struct PointsRenderArgs {
    /// How the colours of points become the colour of a pixel
    #[arg(long, value_enum, default_value_t = CloudOptions::default().blend)]
    pub blend: Blend,
    /// How points are lit, by the surface through their neighbours [default: unlit where the colours are the file's, headlight otherwise]
    #[arg(long, value_enum)]
    pub shade: Option<Shade>,
    /// Direction towards the distant light of lambert shading, in the world, of any length [default: aslant from above]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true, requires = "shade")]
    pub light: Option<DVec3>,
    /// Sub-pixels along a pixel's side at outlines: 1, 2, 4 or 8
    ///
    /// An outline is then known to half of their step: 1/8 of a pixel with 4.
    #[arg(long, value_name = "N", default_value_t = CloudOptions::default().subpixels)]
    pub subpixels: u32,
    /// Draw one point of N, each larger so that surfaces stay closed: quicker and coarser, 1 to 64
    #[arg(long, value_name = "N", default_value_t = CloudOptions::default().every)]
    pub every: u32,
    /// Width of a point's Gaussian, spacings of its points: less is sharper and noisier, 0.1 to 1.5
    #[arg(long, value_name = "SPACINGS", value_parser = values::positive, default_value_t = CloudOptions::default().sigma_spacings)]
    pub sigma: f64,
    /// How far behind the nearest point of a pixel others still belong to its surface, spacings of the points: 0 to 10
    #[arg(long, value_name = "SPACINGS", value_parser = values::number, default_value_t = CloudOptions::default().depth_tolerance_spacings)]
    pub depth_tolerance: f64,
    /// Planes of an EXR file beside colour and depth (Z) [default: none]
    #[arg(long, value_enum, value_name = "NAMES", value_delimiter = ',')]
    pub layers: Option<Vec<CloudLayer>>,
}

impl PointsPartArgs {
    /// The fate of points far from all others.
    pub(crate) fn floating(&self) -> Floating {
        if self.keep_all {
            Floating::Kept
        } else {
            Floating::LeftOut
        }
    }
}

impl PointsRenderArgs {
    /// Returns true if every option lies in its range.
    pub(crate) fn is_legal(&self) -> bool {
        let CloudOptions { shade, light, .. } = CloudOptions::default();
        self.options(shade, light).validate().is_ok()
    }

    /// The renderer's options, with the light of a scene in place of one that is not typed.
    pub(crate) fn options(&self, shade: Shade, light: DVec3) -> CloudOptions {
        CloudOptions {
            blend: self.blend,
            shade: self.shade.unwrap_or(shade),
            light: self.light.unwrap_or(light),
            subpixels: self.subpixels,
            every: self.every,
            sigma_spacings: self.sigma,
            depth_tolerance_spacings: self.depth_tolerance,
            layers: self.layers.clone().unwrap_or_default(),
        }
    }
}
