//! Keyword arguments as words of the command line.
//!
//! `max_error="1/255"` becomes `--max-error=1/255`, `explain=True` becomes `--explain`, `(1, 2, 3)` becomes `1,2,3`, and a
//! dict becomes JSON. The command itself says which options there are, and what each takes; a name that it does not
//! know is a `TypeError` that names those which look like it.

use std::ffi::OsString;

use clap::{Arg, ArgAction, Command};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use resample_cli::args::words::content::Application;

/// Options that Python has its own ways for: files that are written, and what is said.
const OWN: [&str; 6] = ["output", "stats", "resume", "frames", "tile", "help"];

/// Names that look like a wrong one this much are suggested: a letter or two are different.
const LIKE: f64 = 0.8;

/// An option's name and its words.
pub(crate) type Named = (String, Vec<OsString>);

/// The application of a command's name.
pub(crate) fn application(name: &str) -> PyResult<Application> {
    let all = [
        Application::Volume,
        Application::Gaussians,
        Application::Mesh,
        Application::Depth,
        Application::Points,
    ];
    let found = all.into_iter().find(|one| one.name() == name);
    found.ok_or_else(|| PyValueError::new_err(format!("no command '{name}'")))
}

/// The command whose options are taken.
pub(crate) fn command(application: Application) -> Command {
    application.command("forward_resample", "picture.png")
}

/// Name and first line of the help of each option of a command, as Python spells it.
#[pyfunction]
pub(crate) fn options(name: &str) -> PyResult<Vec<(String, String)>> {
    let command = command(application(name)?);
    let help = |arg: &Arg| arg.get_help().map_or_else(String::new, ToString::to_string);
    Ok(known(&command)
        .filter_map(|arg| Some((arg.get_long()?.replace('-', "_"), help(arg))))
        .collect())
}

/// Name, kind and choices of each option of a command, for typed signatures. Kinds: `flag`; `value`, `optional` (a value or True), `list`
/// (numbers with commas between them), `size`, `several` (lists of values).
#[pyfunction]
pub(crate) fn kinds(name: &str) -> PyResult<Vec<(String, &'static str, Vec<String>)>> {
    let command = command(application(name)?);
    let kind = |arg: &Arg| {
        if !matches!(arg.get_action(), ArgAction::Set | ArgAction::Append) {
            return "flag";
        }
        let count = arg.get_num_args();
        let most = count.map_or(1, |range| range.max_values());
        let least = count.map_or(1, |range| range.min_values());
        if most > 1 || matches!(arg.get_action(), ArgAction::Append) {
            "several"
        } else if least == 0 {
            "optional"
        } else if ["WxH", "CxR"].contains(&value_name(arg)) {
            "size"
        } else if value_name(arg).contains(':') {
            "curve"
        } else if value_name(arg).contains(',') {
            "list"
        } else {
            "value"
        }
    };
    let choices = |arg: &Arg| {
        let values = arg.get_possible_values();
        values
            .iter()
            .map(|value| value.get_name().to_owned())
            .collect()
    };
    Ok(known(&command)
        .filter(|arg| !arg.is_hide_set())
        .filter_map(|arg| Some((arg.get_long()?.replace('-', "_"), kind(arg), choices(arg))))
        .collect())
}

/// The words of keyword arguments, in their order.
pub(crate) fn named(application: Application, given: &Bound<'_, PyDict>) -> PyResult<Vec<Named>> {
    let command = command(application);
    let mut all = Vec::with_capacity(given.len());
    for (name, value) in given {
        let name: String = name.extract()?;
        let arg = argument(&command, application, &name)?;
        let long = arg.get_long().unwrap_or_default().to_owned();
        if let Some(words) = words(arg, &value).map_err(|what| {
            let name = name.trim_end_matches('_');
            PyTypeError::new_err(format!("{name}: {what}"))
        })? {
            all.push((long, words));
        }
    }
    Ok(all)
}

fn known(command: &Command) -> impl Iterator<Item = &Arg> {
    command
        .get_arguments()
        .filter(|arg| arg.get_long().is_some_and(|long| !OWN.contains(&long)))
}

fn argument<'a>(command: &'a Command, application: Application, name: &str) -> PyResult<&'a Arg> {
    // `from` is a word of Python: `from_` stands for it.
    let long = name.trim_end_matches('_').replace('_', "-");
    let has_name = |arg: &&Arg| {
        let aliases = arg.get_all_aliases().unwrap_or_default();
        arg.get_long() == Some(&long) || aliases.contains(&long.as_str())
    };
    if let Some(arg) = known(command).find(has_name) {
        return Ok(arg);
    }
    let mut near: Vec<(f64, &str)> = known(command)
        .filter_map(Arg::get_long)
        .map(|known| (strsim::jaro_winkler(known, &long), known))
        .filter(|(likeness, _)| *likeness >= LIKE)
        .collect();
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    let near: Vec<String> = near
        .iter()
        .take(3)
        .map(|(_, known)| format!("'{}'", known.replace('-', "_")))
        .collect();
    let hint = match near.is_empty() {
        true => String::new(),
        false => format!("; did you mean {}?", near.join(" or ")),
    };
    Err(PyTypeError::new_err(format!(
        "{} has no option '{name}'{hint}",
        application.name()
    )))
}

/// The words of an option; `None` where it is left out.
fn words(arg: &Arg, value: &Bound<'_, PyAny>) -> Result<Option<Vec<OsString>>, String> {
    if value.is_none() {
        return Ok(None);
    }
    let dashed = format!("--{}", arg.get_long().unwrap_or_default());
    if !matches!(arg.get_action(), ArgAction::Set | ArgAction::Append) {
        let Ok(flag) = value.cast::<PyBool>() else {
            return Err("expected True or False".to_owned());
        };
        return Ok(flag.is_true().then(|| vec![dashed.into()]));
    }
    let most = arg.get_num_args().map_or(1, |range| range.max_values());
    // Options of several words, such as `also=("pet.nii", "green")`, and those that may be repeated take lists of them.
    if most > 1 || matches!(arg.get_action(), ArgAction::Append) {
        let is_vector = value_name(arg).contains(',');
        return grouped(&dashed, Shape { most, is_vector }, value).map(Some);
    }
    if let Ok(flag) = value.cast::<PyBool>() {
        // An option whose value may be left out.
        let least = arg.get_num_args().map_or(1, |range| range.min_values());
        return match (flag.is_true(), least) {
            (true, 0) => Ok(Some(vec![dashed.into()])),
            (false, 0) => Ok(None),
            _ => Err("expected a value, not True or False".to_owned()),
        };
    }
    // A size is 800x600, all other lists have commas; pairs in lists have colons.
    let joints = match value_name(arg) {
        "WxH" | "CxR" => ["x"; 2],
        name if name.contains(':') => [",", ":"],
        _ => [","; 2],
    };
    let mut word = OsString::from(format!("{dashed}="));
    word.push(one(value, joints)?);
    // One word, so that a value cannot be taken for another option.
    Ok(Some(vec![word]))
}

/// The name of an option's value in its help.
fn value_name(arg: &Arg) -> &str {
    let names = arg.get_value_names().and_then(|names| names.first());
    names.map_or("", |name| name.as_str())
}

/// The words of an option that may be repeated.
#[derive(Clone, Copy)]
struct Shape {
    /// Words each time.
    most: usize,
    /// A word is a list of numbers, such as a plane.
    is_vector: bool,
}

/// An option each time that it is given.
fn grouped(
    dashed: &str,
    Shape { most, is_vector }: Shape,
    value: &Bound<'_, PyAny>,
) -> Result<Vec<OsString>, String> {
    let items = items(value);
    let is_list_of_groups = items
        .as_ref()
        .is_some_and(|items| items.iter().all(|item| self::items(item).is_some()));
    // A list of numbers is one plane, a list of texts several.
    let is_one = |items: &[Bound<'_, PyAny>]| {
        is_vector && items.iter().all(|item| item.cast::<PyString>().is_err())
    };
    let groups: Vec<Bound<'_, PyAny>> = match items {
        Some(items) if is_list_of_groups || (most == 1 && !is_one(&items)) => items,
        _ => vec![value.clone()],
    };
    let mut words = Vec::new();
    for group in groups {
        words.push(dashed.into());
        match self::items(&group) {
            Some(values) if most > 1 => {
                for value in values {
                    words.push(one(&value, [","; 2])?);
                }
            }
            _ => words.push(one(&group, [","; 2])?),
        }
    }
    Ok(words)
}

fn items<'py>(value: &Bound<'py, PyAny>) -> Option<Vec<Bound<'py, PyAny>>> {
    if let Ok(list) = value.cast::<PyList>() {
        return Some(list.iter().collect());
    }
    if let Ok(tuple) = value.cast::<PyTuple>() {
        return Some(tuple.iter().collect());
    }
    // Small arrays of numbers.
    let is_array = value.hasattr("tolist").unwrap_or(false);
    let list = is_array
        .then(|| value.call_method0("tolist").ok())
        .flatten()?;
    items_of_list(&list)
}

fn items_of_list<'py>(value: &Bound<'py, PyAny>) -> Option<Vec<Bound<'py, PyAny>>> {
    let list = value.cast::<PyList>().ok()?;
    Some(list.iter().collect())
}

/// One value as it is typed: lists with the first joint, lists in lists with the second.
fn one(value: &Bound<'_, PyAny>, [joint, inner]: [&str; 2]) -> Result<OsString, String> {
    if let Ok(text) = value.cast::<PyString>() {
        return text.extract::<String>().map(Into::into).map_err(said);
    }
    if value.cast::<PyDict>().is_ok() {
        return json(value);
    }
    if let Some(values) = items(value) {
        if values.iter().any(|value| value.cast::<PyDict>().is_ok()) {
            return json(value);
        }
        let words: Vec<String> = values
            .iter()
            .map(|value| one(value, [inner; 2]).map(|word| word.to_string_lossy().into_owned()))
            .collect::<Result<_, _>>()?;
        return Ok(words.join(joint).into());
    }
    if let Ok(int) = value.cast::<PyInt>() {
        return int.str().map(|text| text.to_string().into()).map_err(said);
    }
    let path = value.hasattr("__fspath__").unwrap_or(false);
    if path {
        let text = value.call_method0("__fspath__").map_err(said)?;
        return text.extract::<OsString>().map_err(said);
    }
    if value.cast::<PyFloat>().is_ok() || value.hasattr("__float__").unwrap_or(false) {
        let number: f64 = value.extract().map_err(said)?;
        return Ok(number.to_string().into());
    }
    let kind = value.get_type().to_string();
    Err(format!(
        "{kind} is no option: expected a text, a number, a list of numbers, a path or a dict"
    ))
}

fn json(value: &Bound<'_, PyAny>) -> Result<OsString, String> {
    let module = value.py().import("json").map_err(said)?;
    let text = module.call_method1("dumps", (value,)).map_err(said)?;
    text.extract::<String>().map(Into::into).map_err(said)
}

fn said(error: impl std::fmt::Display) -> String {
    error.to_string()
}
