//! Options that ask for an error or a time instead of settings.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked. `planner` turns them into
//! settings before anything is drawn.

use clap::Args;

use crate::values;
use crate::values::Bound;

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
