//! A group of options, and which of them are given: typed by a person, or set by a choice.
//!
//! clap parses the group and knows the long names; the word of an option is kept as it was typed.

use std::collections::BTreeMap;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use volsplat::transfer::{ColourMap, Preset};

/// Options, with the names and words of those that were set explicitly.
#[derive(Clone, Debug, PartialEq)]
pub struct Given<T> {
    /// All of them; those that are not given have their default.
    pub options: T,
    words: BTreeMap<String, String>,
}

impl<T> Given<T> {
    /// Returns true if an option is given.
    pub fn has(&self, name: &str) -> bool {
        self.words.contains_key(name)
    }

    /// The word of each option that is given, by its long name.
    pub fn words(&self) -> &BTreeMap<String, String> {
        &self.words
    }

    /// Sets an option, which is typed as `word`.
    pub fn set(&mut self, name: &str, word: String, set: impl FnOnce(&mut T)) {
        set(&mut self.options);
        self.words.insert(name.to_owned(), word);
    }
}

impl<T: Args> Default for Given<T> {
    fn default() -> Self {
        Self {
            options: defaults(),
            words: BTreeMap::new(),
        }
    }
}

impl<T: Args> Args for Given<T> {
    fn augment_args(command: Command) -> Command {
        T::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        T::augment_args_for_update(command)
    }
}

impl<T: Args> FromArgMatches for Given<T> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut given = Self {
            options: T::from_arg_matches(matches)?,
            words: BTreeMap::new(),
        };
        given.note(matches);
        Ok(given)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.options.update_from_arg_matches(matches)?;
        self.note(matches);
        Ok(())
    }
}

impl<T: Args> Given<T> {
    /// Stores the words of the options that were typed.
    fn note(&mut self, matches: &ArgMatches) {
        let typed = |arg: &Arg| {
            let id = arg.get_id().as_str();
            let is_typed = matches.value_source(id) == Some(ValueSource::CommandLine);
            let name = arg.get_long().filter(|_| is_typed)?;
            let words = matches.get_raw(id).into_iter().flatten();
            let words: Vec<_> = words.map(|word| word.to_string_lossy()).collect();
            Some((name.to_owned(), words.join(",")))
        };
        self.words
            .extend(group::<T>().get_arguments().filter_map(typed));
    }
}

/// The long names of a group's options.
pub fn names_of<T: Args>() -> Vec<String> {
    let group = group::<T>();
    let names = group.get_arguments().filter_map(Arg::get_long);
    names.map(str::to_owned).collect()
}

fn group<T: Args>() -> Command {
    T::augment_args(Command::new("group"))
}

/// A group of which no option is typed. It must not require any.
pub(super) fn defaults<T: Args + FromArgMatches>() -> T {
    let matches = T::augment_args(Command::new("defaults").no_binary_name(true))
        .get_matches_from(std::iter::empty::<&str>());
    T::from_arg_matches(&matches).expect("a group of optional options")
}

/// Gives groups of options the default that clap gives them when nothing is typed.
macro_rules! defaults_untyped {
    ($($group:ty),+) => {$(
        impl Default for $group {
            fn default() -> Self {
                $crate::args::given::defaults()
            }
        }
    )+};
}
pub(super) use defaults_untyped;

/// The list that a person has asked for, one name in a line.
pub fn listed(error: &clap::Error) -> Option<String> {
    let told = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => text.as_str(),
        _ => "",
    };
    if error.kind() != ErrorKind::ValueValidation || told(ContextKind::InvalidValue) != "list" {
        return None;
    }
    let option = told(ContextKind::InvalidArg);
    let lines: Vec<String> = if option.starts_with("--preset ") {
        let all = Preset::all();
        all.map(|preset| format!("{:<16} {}", preset.name(), preset.about()))
            .collect()
    } else if option.starts_with("--colormap ") {
        ColourMap::names().map(str::to_owned).collect()
    } else {
        return None;
    };
    Some(lines.join("\n") + "\n")
}
