//! Options of `resample trade`.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked. The options of the measured
//! command and those of the measurement stand in any order; each command that draws has both kinds.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use crate::args::{Drawing, TexmapArgs, VolsplatArgs, Warp3dArgs, short_help};

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
    /// Measure how a picture with depth is shown
    #[command(
        name = "warp3d",
        mut_args(short_help::warp3d),
        mut_arg("output", unwritten)
    )]
    Warp3d(Box<MeasuredDepth>),
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

/// A picture with depth and the measurement.
#[derive(Args, Clone, Debug)]
pub struct MeasuredDepth {
    #[command(flatten)]
    measurement: TradeOptions,
    #[command(flatten, next_help_heading = None::<&str>)]
    drawing: Warp3dArgs,
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
            Measured::Warp3d(args) => (
                args.measurement,
                Drawing::Warp3d(Box::new(args.drawing)),
                None,
            ),
        }
    }
}
