//! Command lines as lists of words: parsed, changed setting by setting, and typed again.
//!
//! A setting is nothing but words of the command line, so that whatever is measured or chosen can be repeated by typing
//! it. An option that a setting gives takes the place of the same option in the words it is added to.

use anyhow::Result;
use clap::Parser;

use crate::args::Cli;

/// A whole command line, parsed.
pub(crate) fn parsed(words: &[String]) -> Result<Cli> {
    let all = std::iter::once("resample").chain(words.iter().map(String::as_str));
    Ok(Cli::try_parse_from(all)?)
}

/// `words` with the options of `changes` instead of their own. Options come in pairs of name and value.
pub(crate) fn with(words: &[String], changes: &[String]) -> Vec<String> {
    let names: Vec<&String> = changes.iter().step_by(2).collect();
    let mut kept = Vec::with_capacity(words.len() + changes.len());
    let mut rest = words.iter();
    while let Some(word) = rest.next() {
        let option = word.split('=').next().unwrap_or_default();
        if names.iter().any(|name| *name == option) {
            if !word.contains('=') {
                rest.next();
            }
        } else {
            kept.push(word.clone());
        }
    }
    kept.extend_from_slice(changes);
    kept
}

/// The words as a person would type them.
pub(crate) fn typed(words: &[String]) -> String {
    let quoted = |word: &String| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+%".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word.clone()
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    };
    let words: Vec<String> = words.iter().map(quoted).collect();
    format!("resample {}", words.join(" "))
}

/// Whether an option is among the words.
pub(crate) fn has(words: &[String], option: &str) -> bool {
    words
        .iter()
        .any(|word| word.split('=').next() == Some(option))
}

/// `words` without some options: those that take a value, and those that take none.
pub(crate) fn without(words: &[String], valued: &[&str], plain: &[&str]) -> Vec<String> {
    let mut kept = Vec::with_capacity(words.len());
    let mut rest = words.iter();
    while let Some(word) = rest.next() {
        let option = word.split('=').next().unwrap_or_default();
        if valued.contains(&option) {
            if !word.contains('=') {
                rest.next();
            }
        } else if !plain.contains(&option) {
            kept.push(word.clone());
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn a_setting_replaces_what_was_there() {
        let words = list("volsplat a.nrrd --slab 1 --fov=20");
        let changed = with(&words, &list("--slab 0.5 --fov 30 --subpixel 2"));
        assert_eq!(
            changed,
            list("volsplat a.nrrd --slab 0.5 --fov 30 --subpixel 2")
        );
        assert_eq!(typed(&list("volsplat a.nrrd")), "resample volsplat a.nrrd");
        assert_eq!(typed(&["a b".to_owned()]), "resample 'a b'");
    }

    #[test]
    fn options_are_found_and_left_out() {
        let words = list("volsplat a.nrrd --max-error 1/255 --slab=1 --explain -o b.png");
        assert!(
            has(&words, "--slab") && !has(&words, "--subpixel"),
            "with a value behind ="
        );
        let rest = without(&words, &["--max-error", "--slab"], &["--explain"]);
        assert_eq!(
            rest,
            list("volsplat a.nrrd -o b.png"),
            "an option goes with its value"
        );
    }
}
