//! Why a reader gives up, before the file's name is known.
//!
//! The parts of a reader work on text and bytes and do not know the path; they give a [`Fault`], and whoever opened the
//! file turns it into the error that names it.

use std::path::Path;

use resample_io::refused::Refused;
pub(crate) use resample_io::refused::excerpt;

use crate::Error;
use crate::input::invalid;

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
