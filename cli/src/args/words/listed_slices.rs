//! Slices and steps that a shell has listed, as in `volsplat slices/*.png` without quotes.
//!
//! Takes the words of a command line, gives them with such a list replaced by the pattern that names the same files.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

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
    let listed = &words[first..first + count];
    if command == Some("view") && !differ_in_numbers(listed) {
        // A picture and its depth.
        return Ok(words);
    }
    let pattern = pattern_of(listed)?;
    Ok([&words[..first], &[pattern.into()], &words[first + count..]].concat())
}

fn is_slice(word: &OsString) -> bool {
    let path = Path::new(word);
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    let is_known = ending.is_some_and(|ending| ENDINGS.iter().any(|known| ending == *known));
    is_known && path.is_file()
}

/// True if the names are equal except for their numbers.
fn differ_in_numbers(files: &[OsString]) -> bool {
    let without_digits = |file: &OsString| -> String {
        let letters = name(Path::new(file));
        letters.chars().filter(|c| !c.is_ascii_digit()).collect()
    };
    let first = without_digits(&files[0]);
    files.iter().all(|file| without_digits(file) == first)
}

fn pattern_of(files: &[OsString]) -> Result<PathBuf> {
    let folder = Path::new(&files[0]).parent().unwrap_or(Path::new(""));
    let names: Vec<String> = files.iter().map(|file| name(Path::new(file))).collect();
    let advice = "name slices by their folder, and slices or steps by a pattern in quotes such as 'slices/*.png'";
    if files
        .iter()
        .any(|file| Path::new(file).parent() != Some(folder))
    {
        bail!("{} files of several folders: {advice}", files.len());
    }
    let [begin, end] = common_ends(&names);
    let fits = |other: &String| {
        other.len() >= begin.len() + end.len() && other.starts_with(begin) && other.ends_with(end)
    };
    let listed = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let all = std::fs::read_dir(listed)?
        .flatten()
        .filter(|entry| fits(&name(&entry.path())))
        .count();
    if all != files.len() {
        bail!(
            "{} files, and {all} in their folder have such a name: {advice}",
            files.len()
        );
    }
    Ok(folder.join(format!("{begin}*{end}")))
}

fn name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// The longest common prefix of the names, and the longest common suffix behind it.
fn common_ends(names: &[String]) -> [&str; 2] {
    let first = names[0].as_str();
    let shared = |holds: &dyn Fn(&str, usize) -> bool, most: usize| {
        (0..=most)
            .rev()
            .find(|&length| names.iter().all(|name| holds(name, length)))
            .unwrap_or(0)
    };
    let begins = |name: &str, length: usize| {
        first.is_char_boundary(length) && name.starts_with(&first[..length])
    };
    let begin = shared(&begins, first.len());
    let shortest = names.iter().map(String::len).min().unwrap_or(0);
    let ends = |name: &str, length: usize| {
        let from = first.len() - length;
        first.is_char_boundary(from) && name.ends_with(&first[from..])
    };
    let end = shared(&ends, shortest - begin);
    [&first[..begin], &first[first.len() - end..]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_and_its_depth_are_no_slices() {
        let differ = |names: [&str; 2]| differ_in_numbers(&names.map(OsString::from));
        assert!(differ(["s09.png", "s10.png"]), "slices");
        assert!(!differ(["photo.jpg", "depth8.png"]), "a photograph");
        assert!(!differ(["rgb0.png", "depth0.png"]), "a recording");
    }

    #[test]
    fn what_all_names_share_is_kept() {
        let ends = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            common_ends(&names).map(str::to_owned)
        };
        assert_eq!(ends(&["s01.png", "s02.png", "s10.png"]), ["s", ".png"]);
        assert_eq!(ends(&["a1.tif", "a1b.tif"]), ["a1", ".tif"]);
        assert_eq!(
            ends(&["aa.tif", "aaa.tif"]),
            ["aa", ".tif"],
            "ends do not overlap"
        );
        assert_eq!(
            ends(&["é1.png", "è1.png"]),
            ["", "1.png"],
            "letters stay whole"
        );
    }
}
