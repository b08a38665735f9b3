//! Opening files, and the errors that name them.

use std::fs::File;
use std::path::Path;

use crate::Error;
use crate::volume::{Lattice, Voxels};

/// The result of a format's reader: the parts of a volume, not yet checked against each other.
pub(crate) struct Parts {
    pub(crate) lattice: Lattice,
    pub(crate) voxels: Voxels,
}

pub(crate) fn open(path: &Path) -> Result<File, Error> {
    open_sized(path).map(|(file, _)| file)
}

/// Opens a file, and gives its bytes too.
pub(crate) fn open_sized(path: &Path) -> Result<(File, u64), Error> {
    resample_io::files::open_regular(path).map_err(|source| cannot_read(path, source))
}

pub(crate) fn cannot_read(path: &Path, source: std::io::Error) -> Error {
    Error::Read {
        path: path.to_owned(),
        source,
    }
}

pub(crate) fn unsupported_file(path: &Path, what: impl Into<String>) -> Error {
    Error::Unsupported {
        path: path.to_owned(),
        what: what.into(),
    }
}

pub(crate) fn invalid(path: &Path, what: impl Into<String>) -> Error {
    Error::Invalid {
        path: path.to_owned(),
        what: what.into(),
    }
}

/// Puts the file's name before an error of the volume's own checks.
pub(crate) fn at(path: &Path, error: Error) -> Error {
    match error {
        Error::Option(what) => invalid(path, what),
        other => other,
    }
}
