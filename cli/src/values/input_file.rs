//! A file as it is typed, and behind a `#` the part of it that is meant: `FILE#PART`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::builder::{OsStringValueParser, TypedValueParser};

/// A file, and perhaps a part of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InputFile {
    /// The file.
    pub path: PathBuf,
    /// The part, without the `#`.
    pub part: Option<String>,
}

impl InputFile {
    /// Splits at the last `#`; a file whose own name holds it wins.
    pub fn of(text: OsString) -> Self {
        let split = text.to_str().and_then(|text| text.rsplit_once('#'));
        match split {
            Some((path, part))
                if !path.is_empty() && !part.is_empty() && !Path::new(&text).exists() =>
            {
                Self {
                    path: path.into(),
                    part: Some(part.to_owned()),
                }
            }
            _ => Self {
                path: text.into(),
                part: None,
            },
        }
    }
}

impl From<PathBuf> for InputFile {
    fn from(path: PathBuf) -> Self {
        Self { path, part: None }
    }
}

/// For clap.
pub fn parser() -> impl TypedValueParser<Value = InputFile> {
    OsStringValueParser::new().map(InputFile::of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_stands_behind_the_last_hash() {
        let of = |text: &str| InputFile::of(text.into());
        assert_eq!(of("a#1/scene.glb#2").part.as_deref(), Some("2"));
        for whole in ["a.nrrd", "a.nrrd#", "#1"] {
            assert_eq!(of(whole), PathBuf::from(whole).into(), "no part");
        }
    }
}
