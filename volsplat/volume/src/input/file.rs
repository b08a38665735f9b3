//! Opening files, the lines of their text headers, and the errors that name them.
//!
//! The parts of a reader work on text and bytes and do not know the path; they return a [`Fault`], and the caller that opened the
//! file turns it into the error that names it.

use std::fs::File;
use std::io::{BufRead, Read};
use std::path::Path;

use resample_io::refused::Refused;

use crate::Error;
use crate::volume::{Lattice, Voxels};

pub(crate) use resample_io::refused::excerpt;

/// The result of a format's reader: the parts of a volume, not yet checked against each other.
pub(crate) struct Parts {
    pub(crate) lattice: Lattice,
    /// Of each component that is read.
    pub(crate) voxels: Vec<Voxels>,
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

/// Why a file is refused.
#[derive(Debug)]
pub(crate) enum Fault {
    /// It contradicts the format or itself.
    Invalid(String),
    /// It is right, but not a scalar volume, or a rare form that is not read.
    Unsupported(String),
    /// Only the caller's options are at fault.
    Option(String),
}

impl From<String> for Fault {
    fn from(what: String) -> Self {
        Self::Invalid(what)
    }
}

impl From<Refused> for Fault {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::Invalid(what) => Self::Invalid(what),
            Refused::Unsupported(what) => Self::Unsupported(what),
        }
    }
}

impl Fault {
    pub(crate) fn at(self, path: &Path) -> Error {
        match self {
            Self::Invalid(what) => invalid(path, what),
            Self::Unsupported(what) => Error::Unsupported {
                path: path.to_owned(),
                what,
            },
            Self::Option(what) => Error::Option(format!("{}: {what}", path.display())),
        }
    }
}

/// A fault of a right file that is not read here.
pub(crate) fn unsupported(what: impl Into<String>) -> Fault {
    Fault::Unsupported(what.into())
}

/// Longest header that is read. Diffusion data with hundreds of gradients has some hundred kB; this is a guess beyond it.
const MAX_HEADER_BYTES: u64 = 1 << 24;

/// The lines of a header, which end in LF or CR LF.
pub(crate) struct Lines<'a> {
    reader: &'a mut dyn BufRead,
    /// Bytes read so far, line ends included.
    pub(crate) bytes: u64,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(reader: &'a mut dyn BufRead) -> Self {
        Self { reader, bytes: 0 }
    }

    /// The next line without its end, `None` at the end of the file.
    pub(crate) fn next(&mut self) -> Result<Option<String>, Fault> {
        let mut line = Vec::new();
        let room = MAX_HEADER_BYTES - self.bytes;
        let got = (&mut *self.reader).take(room).read_until(b'\n', &mut line);
        let got = got.map_err(|error| format!("the header cannot be read: {error}"))? as u64;
        self.bytes += got;
        if got == room && !line.ends_with(b"\n") {
            return Err(Fault::Invalid(format!(
                "the header has no end within {MAX_HEADER_BYTES} bytes"
            )));
        }
        let text = String::from_utf8_lossy(&line);
        Ok((got > 0).then(|| {
            text.trim_end_matches('\n')
                .trim_end_matches('\r')
                .to_owned()
        }))
    }
}
