//! The channels of a picture: `--channel` chooses components of the file, `--also` adds volumes, and each has the words of its look.

use std::fmt;
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use clap::error::ErrorKind;
use clap::{ArgMatches, Args, Command, FromArgMatches};

use crate::values::input_file::InputFile;

/// The volumes of a picture that have a look of their own.
#[derive(Clone, Debug, Default)]
pub struct ChannelArgs {
    /// The values of `--channel`.
    pub components: Vec<ComponentLook>,
    /// The pairs of `--also`.
    pub also: Vec<VolumeLook>,
}

/// A channel or component of the file, and its look.
#[derive(Clone, Debug, PartialEq)]
pub struct ComponentLook {
    /// Its number, counted from 0, or its name.
    pub channel: String,
    /// How it looks.
    pub look: LookWords,
}

/// A further volume, and its look.
#[derive(Clone, Debug)]
pub struct VolumeLook {
    /// The file, and its part.
    pub file: InputFile,
    /// How it looks.
    pub look: LookWords,
}

/// How a channel looks: a word for its colours, and what changes them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LookWords {
    /// A transfer function (.json), a colour map, a colour, or `labels`.
    pub word: Option<String>,
    /// The value that shows nothing, and the one that is shown in full.
    pub window: Option<[f64; 2]>,
    /// Power of the share of the window.
    pub gamma: Option<f64>,
    /// Opacity at the upper end of the window, 0 to 1.
    pub opacity: Option<f64>,
}

/// How a look is written.
const LOOK: &str = "LOOK[:LOW,HIGH][:gamma=G][:opacity=O], each part optional";

impl FromStr for LookWords {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut look = Self::default();
        for part in text.split(':').filter(|part| !part.is_empty()) {
            let number = |name: &str, text: &str| {
                let number = text.trim().parse::<f64>().ok();
                number.filter(|number| number.is_finite()).with_context(|| {
                    format!("{text}: expected a number for the {name} of a channel")
                })
            };
            if let Some(text) = part.strip_prefix("gamma=") {
                look.gamma = Some(number("gamma", text)?);
            } else if let Some(text) = part.strip_prefix("opacity=") {
                look.opacity = Some(number("opacity", text)?);
            } else if let Some((low, high)) = part.split_once(',') {
                look.window = Some([number("window", low)?, number("window", high)?]);
            } else if look.word.replace(part.to_owned()).is_some() {
                bail!("{text}: two looks; expected {LOOK}");
            }
        }
        Ok(look)
    }
}

impl fmt::Display for LookWords {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let parts = [
            self.word.clone(),
            self.window.map(|[low, high]| format!("{low},{high}")),
            self.gamma.map(|gamma| format!("gamma={gamma}")),
            self.opacity.map(|opacity| format!("opacity={opacity}")),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        f.write_str(&parts.join(":"))
    }
}

impl FromStr for ComponentLook {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let (channel, look) = text.split_once(':').unwrap_or((text, ""));
        if channel.trim().is_empty() {
            bail!(
                "expected the number of a channel, counted from 0, or its name, and then a colon and {LOOK}"
            );
        }
        Ok(Self {
            channel: channel.trim().to_owned(),
            look: look.parse()?,
        })
    }
}

/// The words as clap parses them.
#[derive(Args)]
#[group(skip)]
#[command(next_help_heading = "Channels, labels, masks")]
struct Words {
    /// Draw this channel of the file, by its number from 0 on or its name, such as GFP:green:200,4000:gamma=0.8:opacity=1
    ///
    /// May be given several times, and then stands for all channels. Every part behind the channel may be left out. LOOK is a colour such as green or #ff8000, a colour map, a transfer
    /// function (.json) or labels. The next part is a window, LOW,HIGH: LOW shows nothing and HIGH full
    /// colour.
    #[arg(long, value_name = "CHANNEL:LOOK",
        conflicts_with_all = ["labels", "transfer", "window", "preset", "colormap", "show_transfer"])]
    channel: Vec<ComponentLook>,
    /// Also draw this volume (FILE or FILE#PART) with LOOK as in --channel, resampled where it lies on another grid; may be given several times
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
        let also = pairs(&words.also).map(|[file, look]| {
            Ok(VolumeLook {
                file: InputFile::of(file.into()),
                look: look.parse()?,
            })
        });
        let refused = |error: anyhow::Error| {
            clap::Error::raw(ErrorKind::ValueValidation, format!("--also: {error}\n"))
        };
        Ok(Self {
            components: words.channel,
            also: also.collect::<Result<_>>().map_err(refused)?,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_are_read_and_written_the_same() {
        for text in [
            "",
            "green",
            "#ff8000:10,200:gamma=0.7:opacity=0.5",
            "-3.5,1e3",
            "inferno:opacity=0",
        ] {
            let look: LookWords = text.parse().expect("right");
            let again: LookWords = look.to_string().parse().expect("right");
            assert_eq!(look, again, "{text}");
        }
        let channel: ComponentLook = "Alexa 488:green:10,200".parse().expect("right");
        assert_eq!(channel.channel, "Alexa 488");
        assert_eq!(channel.look.word.as_deref(), Some("green"));
        assert_eq!(channel.look.window, Some([10.0, 200.0]));
        for wrong in [
            "",
            ":green",
            "0:green:red",
            "0:1,x",
            "0:gamma=nan",
            "0:opacity=",
        ] {
            assert!(wrong.parse::<ComponentLook>().is_err(), "{wrong}");
        }
    }
}
