//! The commands, one file each: what was typed, turned into options, calls and a report.

pub(crate) mod bench;
pub(crate) mod calibrate;
pub(crate) mod compare;
pub(crate) mod demo;
pub(crate) mod info;
pub(crate) mod texmap;
pub(crate) mod trade;
pub(crate) mod volsplat;
pub(crate) mod warp3d;

use anyhow::{Result, bail};
use resample_core::Camera;

use crate::args::Command;
use crate::picture::{Drawn, Render};

/// A command that draws, ready to draw: its input is read, its cameras are known.
pub(crate) struct Prepared {
    /// One camera per picture.
    pub cameras: Vec<Camera>,
    /// Draws what a camera sees.
    pub render: Box<Render<'static>>,
}

/// A scene whose files are read, to be drawn under one setting after another.
pub(crate) struct Opened {
    /// One camera per picture.
    pub cameras: Vec<Camera>,
    /// What a part of a picture is.
    pub parts: Parts,
    /// Draws what a camera sees as a command says, which may differ from the opened one in how it is drawn.
    pub draw: Box<DrawAs>,
}

/// Draws what a camera sees as a command says.
pub(crate) type DrawAs = dyn FnMut(&Command, &Camera) -> Result<Drawn>;

/// What a part of a picture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parts {
    /// A camera with a smaller picture and a moved principal point shows the same pixels. What a frame costs however
    /// small it is decides how large a part is worth drawing.
    Windows {
        /// Side, px.
        side_px: u32,
        /// Least number of parts that tell what the whole is like.
        least: usize,
        /// Rim of a part that may differ, px: its pixels look at neighbours.
        guard_px: usize,
    },
    /// It cannot be drawn without the rest: several views, or holes that are filled from afar.
    Whole,
}

/// Reads the files of a command that draws.
pub(crate) fn opened(command: &Command) -> Result<Opened> {
    match command {
        Command::Texmap(args) => texmap::opened(args),
        Command::Volsplat(args) => volsplat::opened(args),
        Command::Warp3d(args) => warp3d::opened(args),
        _ => bail!("expected a command that draws: volsplat, texmap or warp3d"),
    }
}

/// Does all of a command but the drawing; for commands that draw one scene.
pub(crate) fn prepared(command: &Command) -> Result<Prepared> {
    match command {
        Command::Texmap(args) => texmap::prepared(args),
        Command::Volsplat(args) => volsplat::prepared(args),
        Command::Warp3d(args) => warp3d::prepared(args),
        _ => bail!("expected a command that draws: volsplat, texmap or warp3d"),
    }
}
