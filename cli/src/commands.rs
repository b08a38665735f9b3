//! The commands, one file each: what was typed, turned into options, calls and a report.

pub(crate) mod bench;
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
use crate::picture::Render;

/// A command that draws, ready to draw: its input is read, its cameras are known.
pub(crate) struct Prepared {
    /// One camera per picture.
    pub cameras: Vec<Camera>,
    /// Draws what a camera sees.
    pub render: Box<Render<'static>>,
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
