//! The files that hold the data: the header itself, one other, a list, or a numbered series.
//!
//! Takes the text of the field that names them, which NRRD and MetaImage write alike, and gives paths. Relative names
//! count from the folder of the header. Several files hold equal, consecutive shares of the values; their number must
//! match the sizes.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use resample_io::Gate;

use crate::input::file::{Fault, excerpt};

/// The field that names the data.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum DataFiles {
    /// Absent: the data follows the header.
    Attached,
    /// One name.
    One(String),
    /// The names that follow the header. `subdim` is the dimension of what one file holds.
    List { names: Vec<String>, subdim: usize },
    /// `prefix`, a number of at least `width` places, `suffix`; numbers from `first` by `step`.
    Series {
        prefix: String,
        suffix: String,
        fill: char,
        width: usize,
        numbers: Numbers,
        subdim: usize,
    },
}

/// `count` numbers from `first` on, `step` apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Numbers {
    first: i64,
    step: i64,
    count: u64,
}

impl DataFiles {
    /// `listed` are the lines behind a header whose field says LIST.
    pub(crate) fn parse(
        field: Option<&str>,
        listed: Vec<String>,
        dimension: usize,
    ) -> Result<Self, String> {
        let Some(text) = field else {
            return Ok(Self::Attached);
        };
        let words: Vec<&str> = text.split_whitespace().collect();
        if words
            .first()
            .is_some_and(|word| word.eq_ignore_ascii_case("list"))
        {
            let subdim = parse_subdim(words.get(1), dimension)?;
            return Ok(Self::List {
                names: listed,
                subdim,
            });
        }
        match words.iter().position(|word| word.contains('%')) {
            Some(at) if matches!(words.len() - at, 4 | 5) => parse_series(&words, at, dimension),
            _ if text.is_empty() => {
                Err("the data file field is empty: expected a file name".to_owned())
            }
            _ => Ok(Self::One(text.to_owned())),
        }
    }

    /// The files in the order of the data; `header` is the path of the header.
    pub(crate) fn paths(
        &self,
        header: &Path,
        sizes: &[usize],
        gate: &Gate,
    ) -> Result<Vec<PathBuf>, Fault> {
        let folder = header.parent().unwrap_or(Path::new(""));
        let named = |name: &str| gate.named_file(name, folder, folder);
        match self {
            Self::Attached => Ok(vec![header.to_owned()]),
            Self::One(name) => Ok(vec![named(name)?]),
            Self::List { names, subdim } => {
                check_share(names.len() as u64, *subdim, sizes)?;
                let files = names.iter().map(|name| named(name.trim()));
                Ok(files.collect::<Result<_, String>>()?)
            }
            Self::Series {
                prefix,
                suffix,
                fill,
                width,
                numbers,
                subdim,
            } => {
                check_share(numbers.count, *subdim, sizes)?;
                let name = |number: i64| match fill {
                    '0' => format!("{prefix}{number:0width$}{suffix}", width = *width),
                    _ => format!("{prefix}{number:width$}{suffix}", width = *width),
                };
                let number = |place: u64| numbers.first + place as i64 * numbers.step;
                let files = (0..numbers.count).map(|place| named(&name(number(place))));
                Ok(files.collect::<Result<_, String>>()?)
            }
        }
    }
}

/// More files than a folder sensibly holds; a forged series must not fill memory with names. A guess.
const MAX_FILES: u64 = 100_000;

/// Files of dimension `subdim` are as many as the axes above it make; files of the full dimension cut the slowest axis.
fn check_share(files: u64, subdim: usize, sizes: &[usize]) -> Result<(), String> {
    if files > MAX_FILES {
        return Err(format!(
            "the data file field names {files} files: at most {MAX_FILES} are read"
        ));
    }
    let slowest = sizes.len() - 1;
    let matches = if subdim == sizes.len() {
        files > 0 && (sizes[slowest] as u64).is_multiple_of(files)
    } else {
        let expected = sizes[subdim..]
            .iter()
            .try_fold(1u64, |count, &size| count.checked_mul(size as u64));
        expected == Some(files)
    };
    if matches {
        return Ok(());
    }
    Err(format!(
        "the data file field names {files} files of dimension {subdim}, which does not fit sizes {sizes:?}"
    ))
}

/// Without the word, one file holds all axes but the slowest.
fn parse_subdim(word: Option<&&str>, dimension: usize) -> Result<usize, String> {
    let allowed: RangeInclusive<usize> = 1..=dimension;
    // MetaImage writes "2D" where NRRD writes "2".
    match word.map(|word| word.trim_end_matches(['D', 'd']).parse()) {
        None => Ok(dimension.saturating_sub(1).max(1)),
        Some(Ok(subdim)) if allowed.contains(&subdim) => Ok(subdim),
        Some(_) => Err(format!(
            "the data file field: the dimension of one file must be 1 to {dimension}"
        )),
    }
}

/// `words[at]` has the `%`; the name may hold spaces before it.
fn parse_series(words: &[&str], at: usize, dimension: usize) -> Result<DataFiles, String> {
    let number = |word: &str| {
        let fault = || {
            format!(
                "the data file field holds '{}': expected NAME FIRST LAST STEP",
                excerpt(word)
            )
        };
        word.parse::<i32>().map(i64::from).map_err(|_| fault())
    };
    let [first, last, step] = [
        number(words[at + 1])?,
        number(words[at + 2])?,
        number(words[at + 3])?,
    ];
    if step == 0 || (last - first).signum() == -step.signum() {
        return Err(format!(
            "the data file field: step {step} never reaches {last} from {first}"
        ));
    }
    let numbers = Numbers {
        first,
        step,
        count: ((last - first) / step) as u64 + 1,
    };
    let pattern = words[..=at].join(" ");
    let fault = || {
        format!(
            "the data file field: pattern '{}': expected one such as %03d",
            excerpt(&pattern)
        )
    };
    let (prefix, rest) = pattern.split_once('%').ok_or_else(fault)?;
    let conversion = rest.find(['d', 'i', 'u']).ok_or_else(fault)?;
    let digits = &rest[..conversion];
    let width = if digits.is_empty() {
        0
    } else {
        digits.parse().map_err(|_| fault())?
    };
    let suffix = &rest[conversion + 1..];
    // No real name has more places, and a forged width would fill memory.
    if width > 64 || suffix.contains('%') {
        return Err(fault());
    }
    let fill = if digits.starts_with('0') { '0' } else { ' ' };
    let subdim = parse_subdim(words.get(at + 4), dimension)?;
    Ok(DataFiles::Series {
        prefix: prefix.to_owned(),
        suffix: suffix.to_owned(),
        fill,
        width,
        numbers,
        subdim,
    })
}
