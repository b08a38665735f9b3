//! A group of options, and which of them are given: typed by a person, or set by a change.
//!
//! An option's name, value and word come from the group's own derives: clap knows the long names, serde the values. Groups
//! can therefore be overlaid, compared and written as words, and no option needs code of its own here.

use std::collections::BTreeSet;

use anyhow::{Context, Result, bail};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// Options, with a record of which were set explicitly.
#[derive(Clone, Debug)]
pub struct Given<T> {
    /// All of them; those that are not given have their default.
    pub options: T,
    names: BTreeSet<String>,
}

impl<T: Args> Given<T> {
    /// A change of the default: `names` are the long names of the options that it sets.
    pub fn of(names: &[&str], set: impl FnOnce(&mut T)) -> Self {
        let mut options = super::defaults::defaults();
        set(&mut options);
        Self {
            options,
            names: names.iter().map(|&name| name.to_owned()).collect(),
        }
    }

    /// Returns true if an option is given.
    pub fn has(&self, name: &str) -> bool {
        self.names.contains(name)
    }
}

impl<T: Args> Default for Given<T> {
    fn default() -> Self {
        Self::of(&[], |_| ())
    }
}

impl<T: Args + Clone + Serialize + DeserializeOwned> Given<T> {
    /// The options of `other` where it gives them, else its own.
    pub fn with(&self, other: &Self) -> Result<Self> {
        let (mut values, others) = (values(&self.options)?, values(&other.options)?);
        for Place { name, path } in places::<T>(&others) {
            if let (true, Some(own), Some(value)) = (
                other.has(&name),
                values.pointer_mut(&path),
                others.pointer(&path),
            ) {
                *own = value.clone();
            }
        }
        Ok(Self {
            options: serde_json::from_value(values)?,
            names: self.names.union(&other.names).cloned().collect(),
        })
    }

    /// Without the options that `other` gives.
    pub fn without(&self, other: &Self) -> Self {
        Self {
            options: self.options.clone(),
            names: self.names.difference(&other.names).cloned().collect(),
        }
    }

    /// Name and word of each option that is given, in the order of the help.
    pub fn pairs(&self) -> Result<Vec<(String, String)>> {
        let values = values(&self.options)?;
        let mut pairs = Vec::new();
        for Place { name, path } in places::<T>(&values) {
            if let Some(value) = values.pointer(&path).filter(|_| self.has(&name)) {
                let word = word(value).with_context(|| name.clone())?;
                pairs.push((name, word));
            }
        }
        Ok(pairs)
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
            names: BTreeSet::new(),
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
    /// Takes note of the options that were typed.
    fn note(&mut self, matches: &ArgMatches) {
        let typed = |arg: &Arg| {
            let is_typed =
                matches.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine);
            arg.get_long().filter(|_| is_typed).map(str::to_owned)
        };
        self.names
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

/// An option, and the path to its value among those of nested groups.
struct Place {
    name: String,
    path: String,
}

/// The place of each option: under its name, or under that of its field.
fn places<T: Args>(values: &Value) -> Vec<Place> {
    let place = |arg: &Arg| {
        let (long, id) = (arg.get_long()?, arg.get_id().as_str());
        Some(Place {
            path: path(values, long).or_else(|| path(values, id))?,
            name: long.to_owned(),
        })
    };
    group::<T>().get_arguments().filter_map(place).collect()
}

/// The path to the first value of a name that is no group itself.
fn path(values: &Value, name: &str) -> Option<String> {
    let Value::Object(map) = values else {
        return None;
    };
    if map.get(name).is_some_and(|value| !value.is_object()) {
        return Some(format!("/{name}"));
    }
    map.iter()
        .find_map(|(group, inner)| Some(format!("/{group}{}", path(inner, name)?)))
}

/// The values of options, in nested groups.
fn values(options: &impl Serialize) -> Result<Value> {
    // Text keeps a number in single precision as short as it was typed.
    let text = serde_json::to_string(options)?;
    Ok(serde_json::from_str(&text)?)
}

/// A value as it is typed.
fn word(value: &Value) -> Result<String> {
    match value {
        Value::String(word) => Ok(word.clone()),
        Value::Number(number) => Ok(number.to_string().trim_end_matches(".0").to_owned()),
        Value::Array(values) => {
            let words: Result<Vec<String>> = values.iter().map(word).collect();
            Ok(words?.join(","))
        }
        _ => bail!("{value} cannot be typed"),
    }
}
