//! Options of `resample join`; see `args.rs`.

use std::path::PathBuf;

use clap::Args;

/// Options of `resample join`.
#[derive(Args, Clone, Debug)]
pub struct JoinArgs {
    /// Files that --tile wrote: all tiles of a picture, or of several
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    /// Picture to write, of the kind that the tiles were drawn for; a pattern such as %04d is replaced by the number of the picture
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}
