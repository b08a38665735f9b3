//! Options of `resample completions` and `resample man`; see `args.rs`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

/// Options of `resample completions`.
#[derive(Args, Clone, Copy, Debug)]
pub struct CompletionsArgs {
    /// Shell that completes
    pub shell: Shell,
}

/// Options of `resample man`.
#[derive(Args, Clone, Debug)]
pub struct ManArgs {
    /// Folder for the pages; it must exist
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
}
