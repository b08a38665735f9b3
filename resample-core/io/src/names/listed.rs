//! The files of a numbered pattern, or of a list.

use std::path::Path;

use resample_core::Error;

use crate::Part;
use crate::files::{cannot_read, fault, read_text};
use crate::names::FrameNames;

/// One line of a list, or one file of a pattern.
pub struct Item {
    /// The number in its name, or its place in the list, from 0.
    pub number: usize,
    /// The time before its name in the list, s, as it is written.
    pub time: Option<String>,
    /// The file, with the part that was named.
    pub file: String,
}

/// The names of the files of a pattern or a list; `None` for a single file.
pub fn files_of(word: &str) -> Result<Option<Vec<String>>, Error> {
    let names = |items: Vec<Item>| items.into_iter().map(|item| item.file).collect();
    Ok(items(word)?.map(names))
}

/// The files of a pattern or a list; `None` for a single file.
pub fn items(word: &str) -> Result<Option<Vec<Item>>, Error> {
    let Part { path, name } = Part::from_text(word);
    let with_name = |file: &Path| match &name {
        Some(name) => format!("{}#{name}", file.display()),
        None => file.display().to_string(),
    };
    let is_list = path.extension().is_some_and(|extension| extension == "txt");
    if is_list {
        return list(&path, with_name).map(Some);
    }
    // A file whose own name looks like a pattern is one file.
    let pattern = if path.exists() {
        None
    } else {
        FrameNames::from_pattern(&path)?
    };
    pattern
        .map(|pattern| numbered(&path, &pattern, with_name))
        .transpose()
}

fn numbered(
    path: &Path,
    pattern: &FrameNames,
    with_name: impl Fn(&Path) -> String,
) -> Result<Vec<Item>, Error> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let mut numbers = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| cannot_read(folder, &e))? {
        let name = entry.map_err(|e| cannot_read(folder, &e))?.file_name();
        numbers.extend(name.to_str().and_then(|name| pattern.number_of(name)));
    }
    numbers.sort_unstable();
    if numbers.is_empty() {
        return Err(fault(path, "no file has such a name"));
    }
    let item = |number: usize| Item {
        number,
        time: None,
        file: with_name(&pattern.frame(number)),
    };
    Ok(numbers.into_iter().map(item).collect())
}

fn list(path: &Path, with_name: impl Fn(&Path) -> String) -> Result<Vec<Item>, Error> {
    let text = read_text(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let lines = text
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    let items: Vec<Item> = lines
        .enumerate()
        .map(|(number, line)| {
            let timed = line
                .split_once(char::is_whitespace)
                .filter(|(time, _)| time.parse::<f64>().is_ok_and(f64::is_finite));
            let (time, name) = timed.map_or((None, line), |(time, name)| (Some(time), name));
            Item {
                number,
                time: time.map(str::to_owned),
                file: with_name(&folder.join(name.trim())),
            }
        })
        .collect();
    if items.is_empty() {
        return Err(fault(path, "the list is empty, expected a name a line"));
    }
    Ok(items)
}
