//! Errors of a caller's input, sorted by who must act.

use std::path::PathBuf;

use thiserror::Error;

/// Why a volume, a transfer function or a rendering was refused.
///
/// Each message names the file, the place, what was expected and what to do.
#[derive(Debug, Error)]
pub enum Error {
    /// The operating system could not read the file.
    #[error("{path}: cannot read: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file is not what its format says it must be.
    #[error("{path}: {what}", path = path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Place, expectation and way out.
        what: String,
    },
    /// The file is well formed, but holds something that is not read here.
    #[error("{path}: not supported: {what}", path = path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The fault, and the remedy.
        what: String,
    },
    /// An option or a combination of options makes no sense.
    #[error("{0}")]
    Option(String),
    /// The frame was not finished, because the caller asked for its end.
    #[error("the frame was stopped: nobody waits for it")]
    Stopped,
}
