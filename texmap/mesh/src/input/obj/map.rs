//! Texture maps of MTL files: their options and their files.
//!
//! Takes the text of a `map_` line, gives where and how a picture lies. A name is looked for as it stands, with
//! back-slashes as slashes, then by its last part beside the MTL file, and then without regard to capitals: files written
//! on another system keep working.

use std::path::{Path, PathBuf};

use super::super::files::{Names, excerpt};
use super::channels::Channel;

/// A map as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// Its file, as it is named.
    pub file: String,
    /// Factor of u and v.
    pub scale: [f32; 2],
    /// Added to u and v, v from the bottom.
    pub offset: [f32; 2],
    /// True if the border goes on outside, instead of the picture again.
    pub clamp: bool,
    /// The channel of a map of numbers.
    pub channel: Channel,
    /// Factor of bumps or normals.
    pub strength: f32,
}

impl Map {
    /// Reads options and name; the name is all that follows the last option.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let mut map = Self {
            file: String::new(),
            scale: [1.0; 2],
            offset: [0.0; 2],
            clamp: false,
            channel: Channel::Mean,
            strength: 1.0,
        };
        let mut rest = text.trim();
        while let Some((option, after)) = option(rest) {
            rest = match option {
                "-s" => numbers_into(&mut map.scale, after)?,
                "-o" => numbers_into(&mut map.offset, after)?,
                "-t" => numbers_into(&mut [0.0; 2], after)?,
                "-mm" => skipped(after, 2),
                "-clamp" => {
                    map.clamp = after.starts_with("on");
                    skipped(after, 1)
                }
                "-bm" => {
                    let mut strength = [1.0; 2];
                    let rest = numbers_into(&mut strength, after)?;
                    map.strength = strength[0];
                    rest
                }
                "-imfchan" => {
                    map.channel = Channel::of_word(after);
                    skipped(after, 1)
                }
                "-blendu" | "-blendv" | "-cc" | "-boost" | "-texres" | "-type" | "-colorspace" => {
                    skipped(after, 1)
                }
                _ => break,
            };
        }
        if rest.is_empty() {
            return Err("a map without a file".into());
        }
        rest.trim_matches('"').clone_into(&mut map.file);
        Ok(map)
    }
}

/// The file that a name in another file means; the error names it and says why it is not read.
pub(super) fn find(names: &Names, name: &str) -> Result<PathBuf, String> {
    let absent = || format!("{} is not there", excerpt(name));
    let name = name.trim().trim_matches('"').replace('\\', "/");
    if name.is_empty() || name.contains('\0') {
        return Err(absent());
    }
    let last = name.rsplit('/').next().unwrap_or(&name);
    let relative = !Path::new(&name).is_absolute();
    let mut spelt = [Some(name.as_str()).filter(|_| relative), Some(last)]
        .into_iter()
        .flatten()
        .filter(|name| !name.is_empty());
    match spelt.find(|name| names.folder.join(name).is_file()) {
        Some(name) => names.file(name),
        None => names.file(&in_any_case(names.folder, last).ok_or_else(absent)?),
    }
}

/// An option at the start of a text, and what follows it.
fn option(text: &str) -> Option<(&str, &str)> {
    let (word, rest) = text.split_once(|c: char| c.is_whitespace())?;
    word.starts_with('-').then_some((word, rest.trim_start()))
}

/// Reads one to three numbers, of which the first two count; one number stands for itself alone.
fn numbers_into<'a>(numbers: &mut [f32; 2], text: &'a str) -> Result<&'a str, String> {
    let mut rest = text;
    for place in 0..3 {
        let (word, after) = rest
            .split_once(|c: char| c.is_whitespace())
            .unwrap_or((rest, ""));
        let number: f32 = match word.parse() {
            Ok(number) => number,
            Err(_) if place > 0 => break,
            Err(_) => return Err(format!("'{}' is no number", excerpt(word))),
        };
        if !number.is_finite() {
            return Err("a number of a map is not finite".into());
        }
        if let Some(slot) = numbers.get_mut(place) {
            *slot = number;
        }
        rest = after.trim_start();
    }
    Ok(rest)
}

fn skipped(text: &str, words: usize) -> &str {
    (0..words).fold(text, |rest, _| {
        rest.split_once(|c: char| c.is_whitespace())
            .map_or("", |(_, rest)| rest.trim_start())
    })
}

fn in_any_case(folder: &Path, name: &str) -> Option<String> {
    // A folder of more files is not one of a model.
    const LOOKED_AT: usize = 10_000;
    let entries = std::fs::read_dir(folder).ok()?.take(LOOKED_AT).flatten();
    let same = |path: &PathBuf| {
        path.file_name()
            .is_some_and(|file| file.eq_ignore_ascii_case(name))
    };
    entries
        .map(|entry| entry.path())
        .filter(|path| path.is_file())
        .find(same)
        .and_then(|path| Some(path.file_name()?.to_str()?.to_owned()))
}

#[cfg(test)]
mod tests {
    use resample_io::Gate;

    use super::*;

    #[test]
    fn options_are_read_and_names_keep_their_spaces() {
        let map = Map::read("-s 2 3 1 -o 0.5 -bm 1.5 -clamp on my wood.png").expect("a map");
        let expected = Map {
            file: "my wood.png".into(),
            scale: [2.0, 3.0],
            offset: [0.5, 0.0],
            clamp: true,
            channel: Channel::Mean,
            strength: 1.5,
        };
        assert_eq!(map, expected, "each option by its own arguments");
        assert_eq!(
            Map::read("-mm 0 1 a.png").expect("a map").file,
            "a.png",
            "two arguments"
        );
        assert_eq!(
            Map::read("-dash.png").expect("a map").file,
            "-dash.png",
            "a name may begin with a dash"
        );
        for bad in ["", "-s 1 1 1", "-clamp on", "-s x a.png"] {
            assert!(Map::read(bad).is_err(), "'{bad}' names no file");
        }
    }

    #[test]
    fn names_of_other_systems_are_found() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("tex")).expect("a folder");
        std::fs::write(folder.path().join("tex/a.png"), "").expect("written");
        std::fs::write(folder.path().join("Wood B.PNG"), "").expect("written");
        let gate = Gate::default();
        let names = Names {
            folder: folder.path(),
            root: folder.path(),
            gate: &gate,
        };
        let found = |name: &str| {
            let path = find(&names, name).ok()?;
            Some(path.strip_prefix(folder.path()).map(PathBuf::from))
        };
        assert_eq!(
            found("tex\\a.png"),
            Some(Ok("tex/a.png".into())),
            "back-slashes"
        );
        assert_eq!(
            found("C:\\other\\wood b.png"),
            Some(Ok("Wood B.PNG".into())),
            "the last part, in any case"
        );
        assert_eq!(found("nothing.png"), None, "what is not there");
        assert_eq!(
            found("/etc/passwd"),
            None,
            "absolute names are not followed"
        );
    }
}
