//! Slices and steps that a shell has listed, as in `volsplat slices/*.png` without quotes.
//!
//! Takes the words of a command line, gives them with such a list replaced by the pattern that names the same files.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::Result;
use resample_io::names::pattern;

/// Endings of files that hold a slice or a step each, in lower case.
const ENDINGS: [&str; 17] = [
    "png", "jpg", "jpeg", "tif", "tiff", "dcm", "npy", "vti", "vtk", "nrrd", "nhdr", "mha", "mhd",
    "nii", "gz", "mgz", "raw",
];

/// Commands that draw or describe a volume.
const OF_VOLUMES: [&str; 2] = ["volsplat", "view"];

/// The words, with two or more slices in a row as one pattern.
///
/// # Errors
/// The list is not all that a pattern would name.
pub(crate) fn as_pattern(words: Vec<OsString>) -> Result<Vec<OsString>> {
    let command = words.get(1).and_then(|word| word.to_str());
    if !command.is_some_and(|command| OF_VOLUMES.contains(&command)) {
        return Ok(words);
    }
    let is_option = |word: &OsString| word.to_string_lossy().starts_with('-');
    let Some(first) = (2..words.len()).find(|&i| {
        // The word behind an option belongs to it.
        is_slice(&words[i]) && !is_option(&words[i - 1]) && words.get(i + 1).is_some_and(is_slice)
    }) else {
        return Ok(words);
    };
    let count = words[first..]
        .iter()
        .take_while(|word| is_slice(word))
        .count();
    let listed: Vec<PathBuf> = words[first..first + count]
        .iter()
        .map(PathBuf::from)
        .collect();
    if command == Some("view") && !pattern::differ_in_numbers(&listed) {
        // A picture and its depth.
        return Ok(words);
    }
    let joined = pattern::of_files(&listed)?;
    Ok([&words[..first], &[joined.into()], &words[first + count..]].concat())
}

fn is_slice(word: &OsString) -> bool {
    let path = Path::new(word);
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    let is_known = ending.is_some_and(|ending| ENDINGS.iter().any(|known| ending == *known));
    is_known && path.is_file()
}
