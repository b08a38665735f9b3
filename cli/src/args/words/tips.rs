//! Tips for options that other programs have, and for values that stand where they are not looked for.
//!
//! Takes an error of the command line's parser with the words that were typed, gives it with our tip in place of the parser's guess.

use std::ffi::OsString;

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command};

/// Options of other programs, each with ours.
const OF_OTHERS: [(&str, &str); 14] = [
    (
        "--clim",
        "--window LOW..HIGH chooses the values that are drawn",
    ),
    ("--depth", "the depth map is the second file: PICTURE DEPTH"),
    ("--ground", "--shadows=ground draws a shadow on a ground"),
    ("--height", "--size WxH is the size of the picture"),
    (
        "--isosurface",
        "--iso VALUE draws a surface, --with-iso VALUE one in the volume",
    ),
    (
        "--label",
        "--caption TEXT writes a line of text, --labels says that values are labels",
    ),
    ("--mask", "--also FILE labels lays labels over a volume"),
    ("--overlay", "--also FILE LOOK draws another volume with it"),
    (
        "--range",
        "--window LOW..HIGH chooses the values that are drawn",
    ),
    ("--resolution", "--size WxH is the size of the picture"),
    (
        "--rotate",
        "--orbit AZ,EL turns the view, --turntable N goes around",
    ),
    ("--title", "--caption TEXT writes a line of text"),
    ("--width", "--size WxH is the size of the picture"),
    (
        "--with-labels",
        "--also FILE labels lays labels over a volume",
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
    let option = invalid.split([' ', '=', '[']).next().unwrap_or_default();
    let listed = |tips: &[(&str, &str)]| {
        let known = tips.iter().find(|(name, _)| *name == option);
        known.map(|(_, tip)| (*tip).to_owned())
    };
    let tip = match error.kind() {
        ErrorKind::UnknownArgument => {
            listed(&OF_OTHERS).or_else(|| value_behind(invalid, words, program))
        }
        ErrorKind::InvalidValue => listed(&WITHOUT_VALUE).filter(|_| {
            matches!(error.get(ContextKind::InvalidValue), Some(ContextValue::String(value)) if value.is_empty())
        }),
        _ => None,
    };
    if let Some(tip) = tip {
        error.remove(ContextKind::SuggestedArg);
        let tip = ContextValue::StyledStrs(vec![StyledStr::from(tip)]);
        error.insert(ContextKind::Suggested, tip);
    }
    error
}

/// The tip for a value behind a space, of an option that takes its value behind an equals sign.
fn value_behind(value: &str, words: &[OsString], program: &Command) -> Option<String> {
    let place = words.iter().position(|word| word.to_str() == Some(value))?;
    let option = words.get(place.checked_sub(1)?)?.to_str()?;
    let command = program.find_subcommand(words.get(1)?.to_str()?)?;
    let is_meant = |arg: &&Arg| {
        arg.is_require_equals_set()
            && arg
                .get_long()
                .is_some_and(|long| option.strip_prefix("--") == Some(long))
    };
    command.get_arguments().find(is_meant)?;
    Some(format!(
        "{option} takes its value behind '=': {option}={value}"
    ))
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
    fn options_of_other_programs_lead_to_ours() {
        for (name, tip_of_it) in OF_OTHERS {
            let told = tip(&format!("resample warp3d a.png b.png -o a.png {name} x"));
            assert!(told.contains(tip_of_it), "{name}: {told}");
            assert!(!told.contains("similar argument"), "{told}");
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
