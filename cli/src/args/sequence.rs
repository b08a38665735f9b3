//! Options of several pictures in a row.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked. What belongs together
//! beyond one option is checked by clap; what depends on the name of the output is not known here.

use std::path::PathBuf;

use clap::Args;

use super::PartArgs;

/// Several pictures, one after another.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Several pictures")]
pub struct SequenceArgs {
    /// Go once around the visible part in N numbered pictures, from --orbit's azimuth on
    #[arg(long, value_name = "N", conflicts_with = "camera",
        value_parser = clap::value_parser!(u32).range(1..=MAX_STEPS))]
    pub turntable: Option<u32>,
    /// Move through the keys of a file, each with a time in seconds and a camera, in numbered pictures
    ///
    /// For volumes, keys may also change the transfer function and the clip.
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["camera", "turntable", "orbit", "up", "projection"])]
    pub path: Option<PathBuf>,
    /// Keep pictures that were already drawn with these options and draw the rest: continues after Ctrl-C
    #[arg(long)]
    pub resume: bool,
    /// Pictures per second of an animation or of --path [default: 25]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=MAX_FPS))]
    pub fps: Option<u16>,
    /// The pictures that this process draws.
    #[command(flatten)]
    pub part: PartArgs,
}

/// Most steps of a turntable: an hour at 25 pictures a second is 90 000. More is a slip of the finger.
const MAX_STEPS: i64 = 100_000;

/// Most pictures per second: more than any screen shows.
const MAX_FPS: i64 = 1_000;
