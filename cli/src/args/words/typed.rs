//! The typed options as the parser understood them: to leave some out and to show the rest again.

use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command};

/// The options of a command that were typed, in the order in which they were typed.
#[derive(Clone, Debug, Default)]
pub struct Typed {
    /// Of each: its name, and its words.
    options: Vec<(String, Vec<String>)>,
}

impl Typed {
    /// The words after the innermost subcommand.
    pub fn of(command: Command, matches: &ArgMatches) -> Self {
        let mut command = command;
        // Globals are handed down to the subcommands.
        command.build();
        let (mut command, mut matches) = (&command, matches);
        while let Some((name, inner)) = matches.subcommand() {
            let Some(subcommand) = command.find_subcommand(name) else {
                break;
            };
            (command, matches) = (subcommand, inner);
        }
        let mut options: Vec<(usize, String, Vec<String>)> = command
            .get_arguments()
            .filter(|arg| is_typed(arg, matches))
            .map(|arg| {
                let place = matches
                    .indices_of(arg.get_id().as_str())
                    .and_then(|mut indices| indices.next());
                // Options without a value that may have one stand last: no word after them can be taken for it.
                (place.unwrap_or(usize::MAX), name(arg), words(arg, matches))
            })
            .collect();
        options.sort_by_key(|(place, _, _)| *place);
        Self {
            options: options
                .into_iter()
                .map(|(_, name, words)| (name, words))
                .collect(),
        }
    }

    /// Returns true if an option was typed: its long name without dashes.
    pub fn has(&self, name: &str) -> bool {
        self.options.iter().any(|(typed, _)| typed == name)
    }

    /// The words, without those of some options.
    pub fn words(&self, left_out: impl Fn(&str) -> bool) -> Vec<String> {
        let kept = self.options.iter().filter(|(name, _)| !left_out(name));
        kept.flat_map(|(_, words)| words.iter().cloned()).collect()
    }
}

/// A command line as a person would type it.
pub fn line<'a>(words: impl IntoIterator<Item = &'a String>) -> String {
    let quoted = |word: &String| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+%#".contains(c);
        // A word that begins with # is a comment to a shell.
        let begins_well = word.chars().next().is_some_and(|first| first != '#');
        if begins_well && word.chars().all(plain) {
            word.clone()
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    };
    let words: Vec<String> = words.into_iter().map(quoted).collect();
    format!("resample {}", words.join(" "))
}

fn is_typed(arg: &Arg, matches: &ArgMatches) -> bool {
    let id = arg.get_id().as_str();
    matches!(matches.try_contains_id(id), Ok(true))
        && matches.value_source(id) == Some(ValueSource::CommandLine)
}

/// The long name of an option, or what stands for a positional one.
fn name(arg: &Arg) -> String {
    arg.get_long().unwrap_or(arg.get_id().as_str()).to_owned()
}

/// An option with its values, each time that it was given.
fn words(arg: &Arg, matches: &ArgMatches) -> Vec<String> {
    let dashed = arg.get_long().map(|long| format!("--{long}"));
    if !arg.get_action().takes_values() {
        return dashed.into_iter().collect();
    }
    let Some(occurrences) = matches.get_raw_occurrences(arg.get_id().as_str()) else {
        return Vec::new();
    };
    let mut words = Vec::new();
    for values in occurrences {
        let values: Vec<String> = values
            .map(|value| value.to_string_lossy().into_owned())
            .collect();
        if let (true, Some(dashed)) = (arg.is_require_equals_set(), &dashed) {
            let value = values.first().map(|value| format!("={value}"));
            words.push(format!("{dashed}{}", value.unwrap_or_default()));
            continue;
        }
        words.extend(dashed.clone());
        match arg.get_value_delimiter() {
            Some(delimiter) => words.push(values.join(&delimiter.to_string())),
            None => words.extend(values),
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::args::Cli;

    fn typed(words: &str) -> Typed {
        let command = Cli::command();
        let words = std::iter::once("resample").chain(words.split(' '));
        let matches = command
            .clone()
            .try_get_matches_from(words)
            .expect("good words");
        Typed::of(command, &matches)
    }

    #[test]
    fn what_was_typed_comes_back_in_its_order() {
        for words in [
            "a.nrrd --slab 1 --output b.png --threads 1",
            "a.nrrd --output b.png --channel 0:green --channel 2:magenta:1,9 --resume",
            "a.nrrd --output b.exr --layers first-hit,normal --origin -1,2,3",
            "a.nrrd --occlusion=2.5 --output b.png",
            "a.nrrd --output b.png --occlusion",
        ] {
            let again = typed(&format!("volsplat {words}")).words(|_| false);
            assert_eq!(again.join(" "), words);
        }
        assert_eq!(
            line(&["a b".to_owned(), "c#1".to_owned()]),
            "resample 'a b' c#1"
        );
    }

    #[test]
    fn options_are_found_and_left_out() {
        let typed = typed("volsplat a.nrrd --max-error 1/255 --slab=1 --explain -o b.png");
        assert!(typed.has("slab") && typed.has("explain") && !typed.has("subpixel"));
        let words = typed.words(|name| ["max-error", "explain", "slab"].contains(&name));
        assert_eq!(words.join(" "), "a.nrrd --output b.png");
    }
}
