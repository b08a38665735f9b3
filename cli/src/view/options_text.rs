//! From the words after `resample view` to a command that draws, and back to words.
//!
//! The file decides which command that is. The page changes options by their names; they are parsed as if they had been
//! typed, so every option has one spelling, one range and one error.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{ArgMatches, Args, Command, FromArgMatches};
use glam::DVec3;
use serde_json::Value;
use volsplat::transfer::ColourMap;

use crate::args::words::content;
use crate::args::words::content::Application;
use crate::args::words::session;
use crate::args::words::typed::Typed;
use crate::args::{ComponentLook, Drawing, GlobalArgs, ServeArgs};
use crate::cameras::viewpoint::Viewpoint;
use crate::open::depth::photo;
use crate::values;
use crate::values::BackgroundWord;
use crate::values::input_file::Held;

/// Options that the page may set. None of them names a file.
const FROM_PAGE: [&str; 39] = [
    "axes",
    "background",
    "blend",
    "caption",
    "channel",
    "clip-plane",
    "color-by",
    "colour-bar",
    "colormap",
    "crop",
    "crop-voxels",
    "environment-turn",
    "exposure",
    "fill",
    "gradient-filter",
    "gradient-opacity",
    "iso",
    "iso-colour",
    "iso-opacity",
    "light",
    "method",
    "min-transmittance",
    "occlusion",
    "opacity-scale",
    "opacity-unit",
    "order",
    "preset",
    "samples",
    "scale-bar",
    "shade",
    "shadows",
    "slab",
    "slab-error",
    "subpixels",
    "textures",
    "tone-map",
    "window",
    "with-iso",
    "with-slice",
];

/// Options of which only one can say how values become colour and opacity.
const LOOKS: [&str; 6] = [
    "transfer",
    "transfer-space",
    "rescale-transfer",
    "window",
    "preset",
    "colormap",
];

/// Options that are on without a value.
const SWITCHES: [&str; 5] = ["axes", "colour-bar", "occlusion", "scale-bar", "shadows"];

/// Blendings that show a scalar of each ray, without light.
const UNLIT: [&str; 3] = ["maximum", "minimum", "average"];

/// Options of the viewer and of the program, which no command that draws has.
const OWN: [&str; 9] = [
    "session",
    "no-open",
    "port",
    "token-file",
    "bind",
    "allow-host",
    "threads",
    "quiet",
    "verbose",
];

/// Options that the page's camera, size and file name replace.
const REPLACED: [&str; 9] = [
    "output",
    "save-camera",
    "size",
    "camera",
    "orbit",
    "fov",
    "up",
    "projection",
    "to",
];

/// The name under which the command line is parsed; nothing of that name is written.
const OUTPUT: &str = "view.png";

/// The typed words.
#[derive(Clone, Debug)]
pub(crate) struct Words {
    pub(crate) application: Application,
    typed: Typed,
    pub(crate) serve: ServeArgs,
    pub(crate) global: GlobalArgs,
    /// The scene, where it is no file.
    held: Option<Held>,
    /// The lens of a picture, where none was typed.
    lens: Option<Viewpoint>,
}

/// Files that hold what the page has edited.
#[derive(Clone, Debug, Default)]
pub(crate) struct Files {
    /// In place of the transfer function.
    pub(crate) transfer: Option<PathBuf>,
    /// In place of the colours of labels.
    pub(crate) labels: Option<PathBuf>,
}

impl Files {
    fn words(&self) -> impl Iterator<Item = OsString> {
        let transfer = self.transfer.iter().flat_map(|path| {
            let space = ["--transfer-space".into(), "srgb".into()];
            space.into_iter().chain(["--transfer".into(), path.into()])
        });
        let labels = self
            .labels
            .iter()
            .flat_map(|path| ["--label-colours".into(), path.into()]);
        transfer.chain(labels)
    }
}

/// Options by name, as the page sets them.
pub(crate) type Changes = BTreeMap<String, Vec<String>>;

/// The command with the options of the viewer. Nothing is written until the page asks for it, and then under names of its own.
fn command(application: Application) -> Command {
    let command = application.command("resample view", OUTPUT);
    ServeArgs::augment_args(GlobalArgs::augment_args(command))
}

impl Words {
    /// Parses what was typed; errors and `--help` end the process as they do in every command.
    pub(crate) fn of(words: &[OsString]) -> Result<Self> {
        let (application, words) = content::drawn(words)?;
        Ok(Self::taken(application, &words, None).unwrap_or_else(|error| error.exit()))
    }

    /// Parses the words of another program, which may also give the scene.
    pub(crate) fn of_program(
        application: Application,
        words: &[OsString],
        held: Option<Held>,
    ) -> Result<Self> {
        Self::taken(application, words, held).map_err(plain)
    }

    fn taken(
        application: Application,
        words: &[OsString],
        held: Option<Held>,
    ) -> Result<Self, clap::Error> {
        let command = command(application);
        let matches = command.clone().try_get_matches_from(words)?;
        let mut words = Self {
            application,
            serve: ServeArgs::from_arg_matches(&matches)?,
            global: GlobalArgs::from_arg_matches(&matches)?,
            typed: Typed::of(command, &matches),
            held,
            lens: None,
        };
        if let Drawing::Warp3d(args) = words.parsed(&matches)?
            && args.cameras.from.is_none()
            && args.cameras.intrinsics.is_none()
        {
            words.lens = Some(photo::lens_of_view(&args));
        }
        Ok(words)
    }

    /// The state of the page in the session that was opened.
    pub(crate) fn page_of_session(&self) -> Value {
        let path = self.global.session.as_ref();
        path.and_then(|path| session::page(path).ok())
            .unwrap_or(Value::Null)
    }

    /// The command as it was typed.
    pub(crate) fn first_drawing(&self) -> Result<Drawing> {
        let words = self.typed.words(|name| OWN.contains(&name));
        let matches = command(self.application)
            .try_get_matches_from(words)
            .map_err(plain)?;
        self.parsed(&matches).map_err(plain)
    }

    /// The command with the page's changes.
    pub(crate) fn drawing(&self, changes: &Changes, files: &Files) -> Result<Drawing> {
        let kept = self.kept(changes, files).into_iter();
        let mut words: Vec<OsString> = kept.map(OsString::from).collect();
        words.extend(changed(changes)?.into_iter().map(OsString::from));
        words.extend(files.words());
        let matches = command(self.application)
            .try_get_matches_from(words)
            .map_err(plain)?;
        self.parsed(&matches).map_err(plain)
    }

    /// The words of the command that repeats a picture, except its camera, its size and its name.
    pub(crate) fn line(&self, changes: &Changes, files: &Files) -> Result<Vec<String>> {
        let mut words = vec![self.application.name().to_owned()];
        words.extend(self.kept(changes, files));
        if let Some(lens) = &self.lens {
            words.extend(["--from".to_owned(), lens.to_string()]);
        }
        words.extend(changed(changes)?);
        let files = files.words();
        words.extend(files.map(|word| word.to_string_lossy().into_owned()));
        Ok(words)
    }

    /// The typed words that still hold.
    fn kept(&self, changes: &Changes, files: &Files) -> Vec<String> {
        let has_look =
            files.transfer.is_some() || changes.keys().any(|name| LOOKS.contains(&name.as_str()));
        let mut words = self.typed.words(|name| {
            OWN.contains(&name)
                || REPLACED.contains(&name)
                || changes.contains_key(name)
                || (self.application == Application::Volume && is_overridden(name, changes))
                || (has_look && LOOKS.contains(&name))
                || (files.labels.is_some() && name == "label-colours")
        });
        // The page's camera replaces the axis that was typed; the heights of points are still counted along it.
        if self.application == Application::Points && !self.typed.has("height-axis") {
            let up = self.typed.words(|name| name != "up").into_iter().nth(1);
            words.extend(up.map(|axis| format!("--height-axis={axis}")));
        }
        words
    }

    fn parsed(&self, matches: &ArgMatches) -> Result<Drawing, clap::Error> {
        let mut drawing = self.application.drawing(matches)?;
        drawing.keep_in_memory();
        if let Some(held) = &self.held {
            drawing.hold(held);
        }
        if let Drawing::Warp3d(args) = &mut drawing {
            let cameras = &mut args.cameras;
            cameras.from = cameras.from.take().or_else(|| self.lens.clone());
            if cameras.to.is_none() {
                cameras.to = Some(Viewpoint::Shift(DVec3::ZERO));
            }
        }
        Ok(drawing)
    }
}

/// Returns true if a typed option cannot stand beside the page's changes, which are newer.
fn is_overridden(name: &str, changes: &Changes) -> bool {
    let chosen = |option: &str| changes.get(option)?.first().map(String::as_str);
    let is_surface = |blend| blend == "isosurface";
    match name {
        // A preset brings its light and its blending; a surface shows none of its colours.
        "shade" | "blend" | "iso" | "iso-colour" | "iso-opacity" if chosen("preset").is_some() => {
            true
        }
        "shade" => chosen("blend").is_some_and(|blend| UNLIT.contains(&blend)),
        "shadows" | "occlusion" | "light-size" => {
            let is_off = name == "light-size" && chosen("shadows") == Some("off");
            is_off || chosen("blend").is_some_and(|blend| UNLIT.contains(&blend))
        }
        "blend" => chosen("iso").is_some() || chosen("shade").is_some_and(|shade| shade != "none"),
        "iso" | "iso-colour" | "iso-opacity" => {
            chosen("blend").is_some_and(|blend| !is_surface(blend))
        }
        _ => false,
    }
}

/// The page's changes as words; an option with no value is left out.
fn changed(changes: &Changes) -> Result<Vec<String>> {
    let mut words = Vec::new();
    for (name, values) in changes {
        if !FROM_PAGE.contains(&name.as_str()) {
            bail!("--{name} is not for the page: give it on the command line");
        }
        for value in values {
            if name == "background" && !is_colour(value) {
                bail!("--background={value}: expected a colour; a picture is for the command line");
            }
            if SWITCHES.contains(&name.as_str()) && ["on", "off"].contains(&value.as_str()) {
                words.extend((value == "on").then(|| format!("--{name}")));
                continue;
            }
            if name == "channel" {
                check_channel(value)?;
            }
            // One word, so that a value cannot be taken for another option.
            words.push(format!("--{name}={value}"));
        }
    }
    Ok(words)
}

/// A channel of the page has a look that is no name of a file.
fn check_channel(value: &str) -> Result<()> {
    let channel: ComponentLook = value.parse()?;
    let is_look = channel.look.word.is_none_or(|look| {
        look == "labels" || look.parse::<ColourMap>().is_ok() || values::colour(&look).is_ok()
    });
    if !is_look {
        bail!(
            "--channel {value}: expected a colour, a colour map or labels; files are for the command line"
        );
    }
    Ok(())
}

/// Returns true if a background is no name of a file.
fn is_colour(word: &str) -> bool {
    matches!(
        values::background(word),
        Ok(BackgroundWord::Colour(_) | BackgroundWord::Transparent)
    )
}

/// The message of a parser without its usage lines.
fn plain(error: clap::Error) -> anyhow::Error {
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default();
    anyhow::anyhow!("{}", line.trim_start_matches("error: "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_option_belongs_to_a_command() {
        let applications = [
            Application::Volume,
            Application::Gaussians,
            Application::Mesh,
            Application::Depth,
            Application::Points,
        ];
        let commands = applications.map(command);
        let exists = |name: &str| {
            let mut arguments = commands.iter().flat_map(Command::get_arguments);
            arguments.any(|argument| argument.get_long() == Some(name))
        };
        let lists: [&[&str]; 4] = [&FROM_PAGE, &LOOKS, &OWN, &REPLACED];
        for name in lists.into_iter().flatten() {
            assert!(exists(name), "--{name} is not an option");
        }
    }
}
