//! A file that could not be written although all checks passed.

use std::io;
use std::path::{Path, PathBuf};

/// Something that could not be written although all checks passed, such as a full disk. It is not bad input.
#[derive(Debug)]
pub struct WriteFailure {
    path: PathBuf,
    source: io::Error,
}

impl WriteFailure {
    pub(super) fn of(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self { path, source }
    }
}

impl std::fmt::Display for WriteFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: cannot write", self.path.display())
    }
}

impl std::error::Error for WriteFailure {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.source)
    }
}
