//! Errors, worded so that the reader can act: the file, the place, the expected value, the remedy.

use thiserror::Error;

/// An error of a reader or of a renderer.
#[derive(Debug, Error)]
pub enum Error {
    /// A file or what it holds; the text names the file, the place, what was expected and what to do.
    #[error("{0}")]
    Input(String),
    /// An option or a camera outside its range.
    #[error("{0}")]
    Option(String),
}
