//! Names of numbered pictures; `listed` reads lists of files, `pattern` finds the pattern of files that a shell has listed.
//!
//! Takes the name that was asked for, gives one name per frame. A pattern such as `%04d` in the file name is
//! replaced by the number of the frame; without one, `_0000` and so on goes before the extension where numbers are
//! wanted. Numbers start at 0, the index of the camera in its list.

pub mod listed;
pub mod pattern;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use resample_core::Error;

/// How frames are named.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameNames {
    /// One picture, one name.
    Single(PathBuf),
    /// The number goes between the two parts of the file name.
    Numbered {
        /// Where the pictures go.
        folder: PathBuf,
        /// The file name before the number.
        before: String,
        /// The file name after the number.
        after: String,
        /// The number has at least this many digits.
        digits: usize,
    },
}

/// Digits of a number that has no pattern: enough for a film of five minutes.
const DEFAULT_DIGITS: usize = 4;

/// Most digits in a pattern: more than any list of frames needs, and a name stays legal everywhere.
const MAX_DIGITS: usize = 18;

impl FrameNames {
    /// Names for one picture: `output` itself, or frame 0 of its pattern.
    pub fn single(output: &Path) -> Result<Self, Error> {
        Ok(Self::from_pattern(output)?.unwrap_or_else(|| Self::Single(output.to_owned())))
    }

    /// Names for a list of pictures.
    pub fn numbered(output: &Path) -> Result<Self, Error> {
        if let Some(names) = Self::from_pattern(output)? {
            return Ok(names);
        }
        let (Some(stem), Some(extension)) = (text(output.file_stem()), text(output.extension()))
        else {
            return Err(Error::Option(format!(
                "{}: expected a file name in UTF-8 with an extension",
                output.display()
            )));
        };
        let folder = output.parent().unwrap_or(Path::new("")).to_owned();
        let (before, after) = (format!("{stem}_"), format!(".{extension}"));
        Ok(Self::Numbered {
            folder,
            before,
            after,
            digits: DEFAULT_DIGITS,
        })
    }

    /// The name of frame `index`.
    pub fn frame(&self, index: usize) -> PathBuf {
        match self {
            Self::Single(path) => path.clone(),
            Self::Numbered {
                folder,
                before,
                after,
                digits,
            } => {
                let digits = *digits;
                folder.join(OsString::from(format!("{before}{index:0digits$}{after}")))
            }
        }
    }

    /// The names of the files of one tile of each picture.
    pub fn of_tile(&self, column: u32, row: u32) -> Self {
        let tiled = |name: &str| {
            let stem = name.rfind('.').map_or(name, |dot| &name[..dot]);
            format!("{stem}.tile-{column}-{row}.exr")
        };
        match self {
            Self::Single(path) => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                Self::Single(path.with_file_name(tiled(&name)))
            }
            Self::Numbered {
                folder,
                before,
                after,
                digits,
            } => Self::Numbered {
                folder: folder.clone(),
                before: before.clone(),
                after: tiled(after),
                digits: *digits,
            },
        }
    }

    /// The number of a file's name, if the pattern gives such names.
    pub fn number_of(&self, name: &str) -> Option<usize> {
        let Self::Numbered {
            before,
            after,
            digits,
            ..
        } = self
        else {
            return None;
        };
        let number = name
            .strip_prefix(before.as_str())?
            .strip_suffix(after.as_str())?;
        let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        let number: usize = number.parse().ok().filter(|_| is_number)?;
        (format!("{before}{number:0digits$}{after}", digits = *digits) == name).then_some(number)
    }

    /// Finds `%d` or `%0Nd` in the file name.
    pub fn from_pattern(output: &Path) -> Result<Option<Self>, Error> {
        let Some(name) = text(output.file_name()) else {
            return Ok(None);
        };
        let patterns: Vec<_> = name
            .match_indices('%')
            .filter_map(|(at, _)| pattern_at(&name, at))
            .collect();
        let (at, end, digits) = match patterns.as_slice() {
            [] => return Ok(None),
            &[pattern] => pattern,
            _ => {
                return Err(Error::Option(format!(
                    "{}: expected one pattern such as %04d in the name, found several",
                    output.display()
                )));
            }
        };
        if digits > MAX_DIGITS {
            return Err(Error::Option(format!(
                "{}: expected at most {MAX_DIGITS} digits in the number of a picture",
                output.display()
            )));
        }
        let folder = output.parent().unwrap_or(Path::new("")).to_owned();
        let (before, after) = (name[..at].to_owned(), name[end..].to_owned());
        Ok(Some(Self::Numbered {
            folder,
            before,
            after,
            digits,
        }))
    }
}

/// Start, end and digits of a pattern whose percent sign is at `at`, if there is one.
fn pattern_at(name: &str, at: usize) -> Option<(usize, usize, usize)> {
    let rest = &name[at + 1..];
    let length = rest.bytes().take_while(u8::is_ascii_digit).count();
    if rest.as_bytes().get(length) != Some(&b'd') {
        return None;
    }
    let digits = if length == 0 {
        1
    } else {
        rest[..length].parse().unwrap_or(usize::MAX)
    };
    Some((at, at + 1 + length + 1, digits))
}

fn text(name: Option<&std::ffi::OsStr>) -> Option<String> {
    name.and_then(|name| name.to_str()).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(output: &str, index: usize) -> String {
        FrameNames::numbered(Path::new(output))
            .expect("a good name")
            .frame(index)
            .display()
            .to_string()
    }

    #[test]
    fn numbers_go_into_the_pattern_or_before_the_extension() {
        assert_eq!(numbered("a/b.png", 7), "a/b_0007.png", "without a pattern");
        assert_eq!(
            numbered("b.tar.exr", 12345),
            "b.tar_12345.exr",
            "numbers may outgrow their digits"
        );
        assert_eq!(numbered("a/x%03d.png", 7), "a/x007.png", "with a pattern");
        assert_eq!(
            numbered("%d-of-100%.png", 7),
            "7-of-100%.png",
            "a lone percent sign is text"
        );
    }

    #[test]
    fn one_picture_keeps_its_name_unless_it_holds_a_pattern() {
        let single = |output: &str| {
            FrameNames::single(Path::new(output))
                .expect("a good name")
                .frame(0)
        };
        assert_eq!(
            single("a/b.png"),
            Path::new("a/b.png"),
            "no pattern, no number"
        );
        assert_eq!(
            single("a/b%02d.png"),
            Path::new("a/b00.png"),
            "a pattern is always used"
        );
    }

    #[test]
    fn two_patterns_and_endless_numbers_are_refused() {
        for bad in ["%d_%d.png", "%019d.png", "%99999999999999999999999d.png"] {
            assert!(
                FrameNames::single(Path::new(bad)).is_err(),
                "{bad} is no usable pattern"
            );
        }
    }
}
