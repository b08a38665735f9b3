//! `--preset list` and `--colormap list`: the word `list` asks what there is.
//!
//! Takes an error of the command line, gives the list that it asks for, if it asks for one.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use volsplat::transfer::{ColourMap, Preset};

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
