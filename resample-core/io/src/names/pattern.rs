//! Files that a shell has listed, as the pattern that names them.

use std::path::{Path, PathBuf};

use resample_core::Error;

use crate::files::cannot_read;

/// True if the names are equal except for their numbers.
pub fn differ_in_numbers(files: &[PathBuf]) -> bool {
    let without_digits = |file: &PathBuf| -> String {
        let letters = name(file);
        letters.chars().filter(|c| !c.is_ascii_digit()).collect()
    };
    let first = files.first().map(without_digits);
    files.iter().all(|file| Some(without_digits(file)) == first)
}

/// The pattern that names these files, two or more of one folder, and no others.
///
/// # Errors
/// There is no file, they lie in several folders, or the pattern would name other files too.
pub fn of_files(files: &[PathBuf]) -> Result<PathBuf, Error> {
    let Some(first) = files.first() else {
        return Err(Error::Option("no files".to_owned()));
    };
    let folder = first.parent().unwrap_or(Path::new(""));
    let names: Vec<String> = files.iter().map(|file| name(file)).collect();
    let advice = "name slices by their folder, and slices or steps by a pattern in quotes such as 'slices/*.png'";
    if files.iter().any(|file| file.parent() != Some(folder)) {
        return Err(Error::Option(format!(
            "{} files of several folders: {advice}",
            files.len()
        )));
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
    let all = std::fs::read_dir(listed)
        .map_err(|source| cannot_read(listed, &source))?
        .flatten()
        .filter(|entry| fits(&name(&entry.path())))
        .count();
    if all != files.len() {
        return Err(Error::Option(format!(
            "{} files, and {all} in their folder have such a name: {advice}",
            files.len()
        )));
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
        let differ = |names: [&str; 2]| differ_in_numbers(&names.map(PathBuf::from));
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
