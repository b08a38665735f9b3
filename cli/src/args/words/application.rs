//! The three commands that draw, for front ends that take the words of one of them without the program's own.

use clap::{ArgMatches, Args, Command, FromArgMatches};

use crate::args::{Drawing, TexmapArgs, VolsplatArgs, Warp3dArgs};

/// The command that draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Application {
    /// `volsplat`.
    Volume,
    /// `texmap`.
    Mesh,
    /// `warp3d`.
    Depth,
}

impl Application {
    /// The name of the command.
    pub fn name(self) -> &'static str {
        match self {
            Self::Volume => "volsplat",
            Self::Mesh => "texmap",
            Self::Depth => "warp3d",
        }
    }

    /// The command's arguments, of which none has to name the picture: it is `output` unless it is typed.
    pub fn command(self, name: &'static str, output: &'static str) -> Command {
        let command = Command::new(name)
            .no_binary_name(true)
            .args_override_self(true);
        let command = match self {
            Self::Volume => VolsplatArgs::augment_args(command),
            Self::Mesh => TexmapArgs::augment_args(command),
            Self::Depth => Warp3dArgs::augment_args(command),
        };
        command.mut_arg("output", |arg| {
            arg.required(false).default_value(output).hide(true)
        })
    }

    /// The parsed arguments as the command they belong to.
    pub fn drawing(self, matches: &ArgMatches) -> Result<Drawing, clap::Error> {
        Ok(match self {
            Self::Volume => Drawing::Volsplat(Box::new(VolsplatArgs::from_arg_matches(matches)?)),
            Self::Mesh => Drawing::Texmap(Box::new(TexmapArgs::from_arg_matches(matches)?)),
            Self::Depth => Drawing::Warp3d(Box::new(Warp3dArgs::from_arg_matches(matches)?)),
        })
    }
}
