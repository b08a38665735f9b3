//! The words of a measured command: told apart from the words of the measurement, and changed for each setting.
//!
//! A setting is nothing but words of the command line, so that every row of the report can be repeated by typing it.
//! An option that a setting gives takes the place of the same option in the words it is added to.

use anyhow::{Result, bail};
use clap::{CommandFactory, Parser};

use crate::args::{Cli, TradeOptions};

/// The words of the measurement, parsed, and those of the measured command.
pub(super) fn split(words: &[String]) -> Result<(TradeOptions, Vec<String>)> {
    let command = TradeOptions::command();
    let (mut own, mut measured) = (Vec::new(), Vec::new());
    let mut rest = words.iter().cloned();
    while let Some(word) = rest.next() {
        let name = word.split('=').next().unwrap_or_default().trim_start_matches("--").to_owned();
        let known =
            command.get_arguments().find(|arg| word.starts_with("--") && arg.get_long() == Some(&name));
        match known {
            None => measured.push(word),
            Some(arg) => {
                let takes_next = arg.get_action().takes_values() && !word.contains('=');
                own.push(word);
                own.extend(takes_next.then(|| rest.next()).flatten());
            }
        }
    }
    if let Some(word) = measured.iter().find(|word| ["-o", "--output", "--stats"].contains(&word.as_str())) {
        bail!("{word}: trade writes its own pictures; leave it out");
    }
    Ok((TradeOptions::try_parse_from(own)?, measured))
}

/// A whole command line, parsed.
pub(super) fn parsed(words: &[String]) -> Result<Cli> {
    let all = std::iter::once("resample").chain(words.iter().map(String::as_str));
    Ok(Cli::try_parse_from(all)?)
}

/// `words` with the options of `changes` instead of their own. Options come in pairs of name and value.
pub(super) fn with(words: &[String], changes: &[String]) -> Vec<String> {
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
pub(super) fn typed(words: &[String]) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn the_two_kinds_of_words_may_be_mixed() {
        let words =
            list("volsplat a.nrrd --out r --slab 1 --reps=3 --settings slab,subpixel --flicker --fov 20");
        let (options, measured) = split(&words).expect("good");
        assert_eq!(measured, list("volsplat a.nrrd --slab 1 --fov 20"));
        assert_eq!((options.reps, options.flicker), (3, true));
        assert_eq!(options.settings, ["slab", "subpixel"]);
        assert!(split(&list("volsplat a.nrrd -o b.png")).is_err(), "-o is refused");
        assert!(split(&list("volsplat a.nrrd --reps many")).is_err(), "not a number");
    }

    #[test]
    fn a_setting_replaces_what_was_there() {
        let words = list("volsplat a.nrrd --slab 1 --fov=20");
        let changed = with(&words, &list("--slab 0.5 --fov 30 --subpixel 2"));
        assert_eq!(changed, list("volsplat a.nrrd --slab 0.5 --fov 30 --subpixel 2"));
        assert_eq!(typed(&list("volsplat a.nrrd")), "resample volsplat a.nrrd");
        assert_eq!(typed(&["a b".to_owned()]), "resample 'a b'");
    }
}
