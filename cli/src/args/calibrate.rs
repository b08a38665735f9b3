//! Options of `resample calibrate`.

use std::path::PathBuf;

use clap::Args;

/// Options of `resample calibrate`.
#[derive(Args, Clone, Debug)]
pub struct CalibrateArgs {
    /// File to write, instead of the one in the user's cache folder
    #[arg(short, long, value_name = "FILE.json")]
    pub output: Option<PathBuf>,
    /// Frames of each picture; the fastest counts
    #[arg(long, value_name = "N", default_value = "3", value_parser = clap::value_parser!(u16).range(1..=100))]
    pub reps: u16,
}
