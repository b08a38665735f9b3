//! Options of several pictures in a row.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked. What belongs together
//! beyond one option is checked by clap; what depends on the name of the output is not known here.

use std::path::PathBuf;

use clap::Args;
use resample_io::film::{FrameRate, Original, Spatial};

use crate::output;
use crate::values;
use crate::values::{Bound, FrameRange, TileWord};

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
    /// Keep pictures, and pieces of a video, that were already drawn with these options and draw the rest: continues after Ctrl-C
    #[arg(long)]
    pub resume: bool,
    /// Pictures per second of an animation or of --path [default: 25]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=MAX_FPS))]
    pub fps: Option<u16>,
    /// The film that the pictures are made from.
    #[arg(skip)]
    pub original: Option<Original>,
    /// The marks of a film by which players know its views.
    #[arg(skip)]
    pub spatial: Spatial,
    /// The pictures that this process draws.
    #[command(flatten)]
    pub part: PartArgs,
}

impl SequenceArgs {
    /// Pictures per second: those that are asked for, else those of the film that they are made from.
    pub(crate) fn rate(&self) -> FrameRate {
        match (self.fps, &self.original) {
            (None, Some(original)) => original.facts.rate,
            (fps, _) => FrameRate::whole(u32::from(fps.unwrap_or(output::DEFAULT_FPS))),
        }
    }
}

/// Most steps of a turntable: an hour at 25 pictures a second is 90 000. More is a slip of the finger.
const MAX_STEPS: i64 = 100_000;

/// Most pictures per second: more than any screen shows.
const MAX_FPS: i64 = 1_000;

/// The part of the pictures that is drawn; all else is decided by the whole.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[command(next_help_heading = "Several pictures")]
pub struct PartArgs {
    /// Draw only pictures A to B-1, counted from 0; `A..` means to the end
    ///
    /// Names, views and settings stay those of the whole, so that many processes can each draw their pictures.
    #[arg(long, value_name = "A..B", value_parser = values::frames)]
    pub frames: Option<FrameRange>,
    /// Draw only one tile of a picture that is divided in COLSxROWS, into a file of its own beside it
    ///
    /// Tiles are counted from 0. `resample join` makes the picture of all tiles: the bytes of one run.
    #[arg(long, value_name = "COL,ROW/COLSxROWS", value_parser = values::tile)]
    pub tile: Option<TileWord>,
}

/// The largest error or time of a picture.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Accuracy and time targets")]
pub struct AskArgs {
    /// The fastest setting whose error stays under BOUND, such as 1/255 or 0.004: the root mean square over the covered
    /// pixels, against the most exact setting; max:1/64 bounds the largest change of any pixel
    ///
    /// Options that are given are kept as they are; the rest is chosen by measuring small windows of the picture.
    #[arg(long, value_name = "BOUND", value_parser = values::bound, conflicts_with = "max_time_ms")]
    pub max_error: Option<Bound>,
    /// The most accurate setting that is predicted to take no longer than TIME a picture, such as 50ms or 2s
    #[arg(long = "max-time", value_name = "TIME", value_parser = values::time_ms)]
    pub max_time_ms: Option<f64>,
    /// Print the chosen setting, the reason, and the error and saving of the others
    #[arg(long)]
    pub explain: bool,
}
