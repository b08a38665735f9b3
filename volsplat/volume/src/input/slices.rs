//! Volumes that are spread over files, one slice each: a folder, or a pattern such as `slices/img*.tif`.
//!
//! Takes what the user typed, gives the files in natural order: numbers inside names are compared as numbers, so that
//! `img2` comes before `img10`. A pattern is only looked at where no file has exactly this name.
//! Limits: `*` and `?` in the last part of the path. Folders inside the folder are entered by [`below`] alone.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use crate::Error;
use crate::input::{cannot_read, invalid};

/// The files of a folder or of a pattern in natural order, hidden ones aside; `None` if `path` is a file or nothing.
pub(crate) fn paths(path: &Path) -> Result<Option<Vec<PathBuf>>, Error> {
    if path.is_dir() {
        return listed(path, "*").map(Some);
    }
    let pattern = path
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    if !pattern.contains(['*', '?']) || path.exists() {
        return Ok(None);
    }
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let paths = listed(folder, &pattern)?;
    if paths.is_empty() {
        return Err(invalid(path, "no file has a name of this pattern"));
    }
    Ok(Some(paths))
}

/// Most folders that lie in one another. A disc has three: patient, study, series.
const MAX_DEPTH: usize = 8;

/// Most files in the folders of a folder: a disc of a hospital has some ten thousand. A guess.
const MOST_FILES: usize = 1 << 17;

/// All files in the folders of a folder, one folder after the other.
pub(crate) fn below(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut all = Vec::new();
    let mut open = vec![(folder.to_owned(), 0)];
    while let Some((folder, depth)) = open.pop() {
        all.extend(listed(&folder, "*")?);
        if all.len() > MOST_FILES {
            return Err(invalid(
                &folder,
                format!(
                    "the folder and those before it hold more than {MOST_FILES} files: name one that holds a scan"
                ),
            ));
        }
        if depth == MAX_DEPTH {
            continue;
        }
        let entries = std::fs::read_dir(&folder).map_err(|source| cannot_read(&folder, source))?;
        let inner = entries.filter_map(|entry| Some(entry.ok()?.path()));
        // A link may lead back.
        let mut inner: Vec<PathBuf> = inner
            .filter(|path| path.is_dir() && !path.is_symlink())
            .collect();
        inner.sort();
        open.extend(inner.into_iter().rev().map(|path| (path, depth + 1)));
    }
    Ok(all)
}

/// Compares names as a person would: runs of digits by their value, everything else by its characters.
fn natural_order(left: &str, right: &str) -> Ordering {
    let (mut left_rest, mut right_rest) = (left, right);
    while let (Some(a), Some(b)) = (left_rest.chars().next(), right_rest.chars().next()) {
        if a.is_ascii_digit() && b.is_ascii_digit() {
            let ((left_number, l), (right_number, r)) =
                (split_number(left_rest), split_number(right_rest));
            // Without leading zeros, the longer number is the greater one.
            let order = left_number
                .len()
                .cmp(&right_number.len())
                .then(left_number.cmp(right_number));
            if order.is_ne() {
                return order;
            }
            (left_rest, right_rest) = (l, r);
        } else if a == b {
            (left_rest, right_rest) = (&left_rest[a.len_utf8()..], &right_rest[b.len_utf8()..]);
        } else {
            return a.cmp(&b);
        }
    }
    // The shorter one first; names that differ in leading zeros only are ordered by them.
    left_rest
        .len()
        .cmp(&right_rest.len())
        .then_with(|| left.cmp(right))
}

fn listed(folder: &Path, pattern: &str) -> Result<Vec<PathBuf>, Error> {
    let entries = std::fs::read_dir(folder).map_err(|source| cannot_read(folder, source))?;
    let mut named = Vec::new();
    for entry in entries {
        let path = entry.map_err(|source| cannot_read(folder, source))?.path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if !name.starts_with('.') && matches(&name, pattern) && path.is_file() {
            named.push((name, path));
        }
    }
    named.sort_by(|left, right| natural_order(&left.0, &right.0));
    Ok(named.into_iter().map(|(_, path)| path).collect())
}

/// Returns true if a name fits a pattern: `*` stands for any characters, `?` for one.
fn matches(name: &str, pattern: &str) -> bool {
    let (name, pattern): (Vec<char>, Vec<char>) =
        (name.chars().collect(), pattern.chars().collect());
    let (mut at, mut place) = (0, 0);
    // Where to go on if the characters after the latest star do not fit: the star takes one more.
    let mut retry: Option<(usize, usize)> = None;
    while at < name.len() {
        match pattern.get(place) {
            Some('*') => {
                retry = Some((at, place));
                place += 1;
            }
            Some(&wanted) if wanted == '?' || wanted == name[at] => {
                (at, place) = (at + 1, place + 1)
            }
            _ => {
                let Some((star_at, star_place)) = retry else {
                    return false;
                };
                retry = Some((star_at + 1, star_place));
                (at, place) = (star_at + 1, star_place + 1);
            }
        }
    }
    pattern[place..].iter().all(|&wanted| wanted == '*')
}

/// The digits at the front without leading zeros, and what follows them.
fn split_number(text: &str) -> (&str, &str) {
    let end = text
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(text.len());
    (text[..end].trim_start_matches('0'), &text[end..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_compared_by_value() {
        let mut names = [
            "img10.tif",
            "img2.tif",
            "img1.tif",
            "img",
            "a5b10",
            "a5b9",
            "img02.tif",
            "image",
        ];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(
            names,
            [
                "a5b9",
                "a5b10",
                "image",
                "img",
                "img1.tif",
                "img02.tif",
                "img2.tif",
                "img10.tif"
            ]
        );
        assert_eq!(
            natural_order("x99999999999999999999999", "x100000000000000000000000"),
            Ordering::Less,
            "long"
        );
    }

    #[test]
    fn stars_and_question_marks_stand_for_characters() {
        for (name, pattern, expected) in [
            ("img1.tif", "*", true),
            ("img1.tif", "img*.tif", true),
            ("img.tif", "img*.tif", true),
            ("img1.tiff", "img*.tif", false),
            ("img12.tif", "img?.tif", false),
            ("img1.tif", "img?.tif", true),
            ("aXbXc", "*X?", true),
            ("aXbXcc", "*X?", false),
            ("", "*", true),
        ] {
            assert_eq!(matches(name, pattern), expected, "{name} {pattern}");
        }
    }
}
