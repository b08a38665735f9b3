//! Options of `resample trade`.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked. The words of the
//! measured command stand between them in any order, so the command line is parsed in two parts: see
//! `commands/trade/words.rs`.

use std::path::PathBuf;

use clap::builder::StyledStr;
use clap::{Args, CommandFactory, Parser, ValueEnum};

/// What is typed after `resample trade`.
#[derive(Args, Debug)]
pub(crate) struct TradeArgs {
    /// volsplat, texmap or warp3d with its own options (all but -o), and the options of the measurement
    #[arg(
        value_name = "COMMAND",
        required = true,
        trailing_var_arg = true,
        allow_hyphen_values = true
    )]
    pub words: Vec<String>,
}

/// Options of the measurement.
#[derive(Debug, Parser)]
#[command(name = "resample trade", no_binary_name = true)]
pub(crate) struct TradeOptions {
    /// Folder for the report; it is made if it does not exist
    #[arg(long, value_name = "FOLDER", default_value = "trade-report")]
    pub out: PathBuf,
    /// Ladders whose rungs are combined with one another, separated by commas, beside one ladder at a time
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub settings: Vec<String>,
    /// A built-in scene instead of a file (volsplat)
    #[arg(long, value_enum)]
    pub scene: Option<SceneArg>,
    /// Frames of each setting; the median counts
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub reps: u16,
    /// Picture to compare with, instead of that of the slowest, most exact setting
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// Measure how errors flicker over sixteen steps of a sixteenth of a pixel
    #[arg(long)]
    pub flicker: bool,
    /// Keep what an earlier run of the same command has measured
    #[arg(long)]
    pub resume: bool,
    /// Draw one picture and print what it took, for the measurement itself
    #[arg(long, hide = true)]
    pub probe: bool,
}

/// The options of the measurement, as help shows them.
pub(super) fn help_of_the_measurement() -> StyledStr {
    TradeOptions::command()
        .disable_help_flag(true)
        .help_template("Options of the measurement, anywhere among the others:\n{options}")
        .render_help()
}

/// The built-in scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SceneArg {
    /// Opaque cells with sharp edges
    CheckerBox,
    /// Ripples that are hard to reconstruct
    MarschnerLobb,
    /// Soft translucent matter
    Blobs,
}
