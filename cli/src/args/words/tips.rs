//! Tips for options that other programs have, for values after a space that belong after an equals sign, and for values that are missing.
//!
//! Takes an error of the command line's parser with the words that were typed, gives it with our tip in place of the parser's guess. A tip never names an option that the command does not have.

use std::ffi::OsString;

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command};

/// Options of other programs, with the name of our argument and a tip on it.
const OF_OTHERS: [(&[&str], &str, &str); 8] = [
    (
        &["--height", "--resolution", "--width"],
        "size",
        "--size WxH is the size of the picture",
    ),
    (
        &["--clim", "--range"],
        "window",
        "--window LOW..HIGH chooses the values that are drawn",
    ),
    (
        &["--label", "--title"],
        "caption",
        "--caption TEXT writes a line of text",
    ),
    (
        &["--overlay", "--with-labels"],
        "also",
        "--also FILE LOOK draws another volume with it, --also FILE labels its labels",
    ),
    (
        &["--depth"],
        "depth",
        "the depth map is the second file: PICTURE DEPTH",
    ),
    (
        &["--ground"],
        "shadows",
        "--shadows=ground draws a shadow on a ground",
    ),
    (
        &["--isosurface"],
        "iso",
        "--iso VALUE draws a surface, --with-iso VALUE one in the volume",
    ),
    (
        &["--rotate"],
        "orbit",
        "--orbit AZ,EL turns the view, --turntable N goes around",
    ),
];

/// Options whose value is often left out, each with an example.
const WITHOUT_VALUE: [(&str, &str); 2] = [
    (
        "--stereo",
        "--stereo 0.06 puts the eyes 0.06 world units apart; --comfort 3 brings them closer where disparities are large",
    ),
    (
        "--sway",
        "--sway 3 swings the view by 3 degrees to both sides",
    ),
];

/// The error with a tip where one is known.
pub(crate) fn with_tip(
    mut error: clap::Error,
    words: &[OsString],
    program: &Command,
) -> clap::Error {
    let Some(ContextValue::String(invalid)) = error.get(ContextKind::InvalidArg) else {
        return error;
    };
    let command = words
        .get(1)
        .and_then(|word| program.find_subcommand(word.to_str()?));
    let option = invalid.split([' ', '=', '[']).next().unwrap_or_default();
    let tip = match (error.kind(), command) {
        (ErrorKind::UnknownArgument, Some(command)) => {
            of_others(option, command).or_else(|| value_behind(invalid, words, command))
        }
        (ErrorKind::InvalidValue, _) if is_without_value(&error) => {
            let known = WITHOUT_VALUE.iter().find(|(name, _)| *name == option);
            known.map(|(_, tip)| (*tip).to_owned())
        }
        _ => None,
    };
    if let Some(tip) = tip {
        error.remove(ContextKind::SuggestedArg);
        let tip = ContextValue::StyledStrs(vec![StyledStr::from(tip)]);
        error.insert(ContextKind::Suggested, tip);
    }
    error
}

fn is_without_value(error: &clap::Error) -> bool {
    matches!(error.get(ContextKind::InvalidValue), Some(ContextValue::String(value)) if value.is_empty())
}

/// The tip for an option of another program, if the command has ours.
fn of_others(option: &str, command: &Command) -> Option<String> {
    let (_, ours, tip) = OF_OTHERS
        .iter()
        .find(|(names, ..)| names.contains(&option))?;
    let has_ours = command.get_arguments().any(|arg| arg.get_id() == ours);
    has_ours.then(|| (*tip).to_owned())
}

/// The tip for a value after a space, of an option that takes its value after an equals sign.
fn value_behind(value: &str, words: &[OsString], command: &Command) -> Option<String> {
    let place = words.iter().position(|word| word.to_str() == Some(value))?;
    let option = words.get(place.checked_sub(1)?)?.to_str()?;
    let long = option.strip_prefix("--")?;
    let is_meant = |arg: &Arg| arg.is_require_equals_set() && arg.get_long() == Some(long);
    let takes_equals = command.get_arguments().any(is_meant);
    takes_equals.then(|| format!("{option} takes its value behind '=': {option}={value}"))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::args::Cli;

    fn tip(words: &str) -> String {
        let words: Vec<OsString> = words.split(' ').map(OsString::from).collect();
        let error = Cli::command()
            .try_get_matches_from(&words)
            .expect_err("bad words");
        with_tip(error, &words, &Cli::command()).to_string()
    }

    #[test]
    fn a_value_behind_a_space_is_put_behind_the_equals_sign() {
        let told = tip("resample volsplat a.nrrd -o a.png --axes box");
        assert!(
            told.contains("tip: --axes takes its value behind '=': --axes=box"),
            "{told}"
        );
        let told = tip("resample volsplat a.nrrd b.nrrd -o a.png");
        assert!(!told.contains("behind '='"), "{told}");
    }

    #[test]
    fn options_of_other_programs_lead_to_ours_where_the_command_has_them() {
        let drawing = [
            "volsplat a",
            "texmap a",
            "warp3d a b",
            "points a",
            "gaussians a",
        ];
        let each = |&(names, ours, tip): &(&'static [&str], _, _)| {
            names.iter().map(move |name| (*name, ours, tip))
        };
        for (name, ours, tip_of_it) in OF_OTHERS.iter().flat_map(each) {
            let mut count = 0;
            for words in drawing {
                let command = words.split(' ').next().expect("a word");
                let known = Cli::command();
                let known = known.find_subcommand(command).expect("a command");
                let has = |name: &str| known.get_arguments().any(|arg| arg.get_id() == name);
                let told = tip(&format!("resample {words} -o a.png {name} x"));
                assert_eq!(
                    told.contains(tip_of_it),
                    has(ours),
                    "{words} {name}: {told}"
                );
                count += usize::from(has(ours));
            }
            assert!(count > 0, "{name}: a command has {ours}");
        }
    }

    #[test]
    fn a_missing_value_has_an_example() {
        let told = tip("resample warp3d a.png b.png -o a.png --stereo");
        assert!(told.contains("--stereo 0.06"), "{told}");
        let told = tip("resample warp3d a.png b.png -o a.png --stereo x");
        assert!(!told.contains("--stereo 0.06"), "{told}");
    }
}
