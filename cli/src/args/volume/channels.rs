//! The pairs of `--channel` and `--also`: clap parses two words each, this file makes one value of them.

use clap::error::ErrorKind;
use clap::{ArgMatches, Args, Command, FromArgMatches};

use crate::values::input_file::InputFile;

/// The volumes of a picture that have a look of their own.
#[derive(Clone, Debug, Default)]
pub struct ChannelArgs {
    /// The pairs of `--channel`.
    pub components: Vec<ComponentLook>,
    /// The pairs of `--also`.
    pub also: Vec<VolumeLook>,
}

/// A component of the file, and its look.
#[derive(Clone, Debug)]
pub struct ComponentLook {
    /// The component, counted from 0.
    pub number: usize,
    /// A word for its look.
    pub look: String,
}

/// A further volume, and its look.
#[derive(Clone, Debug)]
pub struct VolumeLook {
    /// The file, and its part.
    pub file: InputFile,
    /// A word for its look.
    pub look: String,
}

/// The words as clap parses them.
#[derive(Args)]
#[group(skip)]
#[command(next_help_heading = "Channels, labels, masks")]
struct Words {
    /// Draw component N of the file with LOOK: a transfer function (.json), a colour map, a colour such as green or
    /// #ff8000, or labels; once for each component that is drawn
    #[arg(long, num_args = 2, value_names = ["N", "LOOK"],
        conflicts_with_all = ["labels", "transfer", "window", "preset", "colormap", "show_transfer"])]
    channel: Vec<String>,
    /// Also draw this volume (FILE or FILE#PART), on the same grid, with LOOK as in --channel; may be given several times
    #[arg(long, num_args = 2, value_names = ["FILE", "LOOK"])]
    also: Vec<String>,
}

impl Args for ChannelArgs {
    fn augment_args(command: Command) -> Command {
        Words::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Words::augment_args_for_update(command)
    }
}

impl FromArgMatches for ChannelArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let words = Words::from_arg_matches(matches)?;
        Ok(Self {
            components: pairs(&words.channel)
                .map(|[number, look]| component(number, look))
                .collect::<Result<_, _>>()?,
            also: pairs(&words.also)
                .map(|[file, look]| VolumeLook {
                    file: InputFile::of(file.into()),
                    look: look.clone(),
                })
                .collect(),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The words in twos: clap takes no other number.
fn pairs(words: &[String]) -> impl Iterator<Item = &[String; 2]> {
    words.as_chunks().0.iter()
}

fn component(number: &str, look: &str) -> Result<ComponentLook, clap::Error> {
    match number.parse() {
        Ok(number) => Ok(ComponentLook {
            number,
            look: look.to_owned(),
        }),
        Err(_) => Err(clap::Error::raw(
            ErrorKind::ValueValidation,
            format!(
                "--channel {number}: expected the number of a component, counted from 0, and then its look\n"
            ),
        )),
    }
}
