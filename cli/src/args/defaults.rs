//! The values of options that are not typed, as their attributes have them.

use clap::{Args, Command, FromArgMatches};

/// A group of which no option is typed. It must not require any.
pub(super) fn defaults<T: Args + FromArgMatches>() -> T {
    let matches = T::augment_args(Command::new("defaults").no_binary_name(true))
        .get_matches_from(std::iter::empty::<&str>());
    T::from_arg_matches(&matches).expect("a group of optional options")
}
