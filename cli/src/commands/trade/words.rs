//! The words of a measured command, told apart from the words of the measurement.
//!
//! Both kinds may stand in any order; an option of the measurement takes its value with it.

use anyhow::{Result, bail};
use clap::{CommandFactory, Parser};

use crate::args::TradeOptions;

/// The words of the measurement, parsed, and those of the measured command.
pub(super) fn split(words: &[String]) -> Result<(TradeOptions, Vec<String>)> {
    let command = TradeOptions::command();
    let (mut own, mut measured) = (Vec::new(), Vec::new());
    let mut rest = words.iter().cloned();
    while let Some(word) = rest.next() {
        let name = word
            .split('=')
            .next()
            .unwrap_or_default()
            .trim_start_matches("--")
            .to_owned();
        let known = command
            .get_arguments()
            .find(|arg| word.starts_with("--") && arg.get_long() == Some(&name));
        match known {
            None => measured.push(word),
            Some(arg) => {
                let takes_next = arg.get_action().takes_values() && !word.contains('=');
                own.push(word);
                own.extend(takes_next.then(|| rest.next()).flatten());
            }
        }
    }
    if let Some(word) = measured
        .iter()
        .find(|word| ["-o", "--output", "--stats"].contains(&word.as_str()))
    {
        bail!("{word}: trade writes its own pictures; leave it out");
    }
    Ok((TradeOptions::try_parse_from(own)?, measured))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn the_two_kinds_of_words_may_be_mixed() {
        let words = list(
            "volsplat a.nrrd --out r --slab 1 --reps=3 --settings slab,subpixel --flicker --fov 20",
        );
        let (options, measured) = split(&words).expect("good");
        assert_eq!(measured, list("volsplat a.nrrd --slab 1 --fov 20"));
        assert_eq!((options.reps, options.flicker), (3, true));
        assert_eq!(options.settings, ["slab", "subpixel"]);
        assert!(
            split(&list("volsplat a.nrrd -o b.png")).is_err(),
            "-o is refused"
        );
        assert!(
            split(&list("volsplat a.nrrd --reps many")).is_err(),
            "not a number"
        );
    }
}
