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
use crate::plan::Telling;
use crate::report::Verbosity;

/// A command that draws, ready to draw: its input is read, its cameras are known.
pub(crate) struct Prepared {
    /// One camera per picture.
    pub cameras: Vec<Camera>,
    /// Draws what a camera sees.
    pub render: Box<Render<'static>>,
}

/// A scene whose files are read, to be drawn under one setting after another, and at last as a command says.
pub(crate) enum Opened {
    /// A mesh.
    Mesh(Box<texmap::Open>),
    /// A volume.
    Volume(Box<volsplat::Open>),
    /// Pictures with depth.
    Depth(Box<warp3d::Open>),
}

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

impl Opened {
    /// Reads the files of a command that draws.
    pub(crate) fn read(command: &Command, verbosity: Verbosity) -> Result<Self> {
        match command {
            Command::Texmap(args) => Ok(Self::Mesh(Box::new(texmap::Open::read(args, verbosity)?))),
            Command::Volsplat(args) => {
                let open = volsplat::Open::read(args, verbosity)?;
                open.check_still()?;
                Ok(Self::Volume(Box::new(open)))
            }
            Command::Warp3d(args) => Ok(Self::Depth(Box::new(warp3d::Open::read(args)?))),
            _ => bail!(NOT_DRAWING),
        }
    }

    /// One camera per picture.
    pub(crate) fn cameras(&self) -> &[Camera] {
        match self {
            Self::Mesh(open) => open.cameras(),
            Self::Volume(open) => open.cameras(),
            Self::Depth(open) => open.cameras(),
        }
    }

    /// What a part of a picture is.
    pub(crate) fn parts(&self, command: &Command) -> Parts {
        match (self, command) {
            (Self::Mesh(_), _) => Parts::Windows {
                side_px: 32,
                least: 6,
                guard_px: 0,
            },
            (Self::Volume(_), _) => Parts::Windows {
                side_px: 16,
                least: 6,
                guard_px: 0,
            },
            (Self::Depth(open), Command::Warp3d(args)) if open.has_parts(args) => Parts::Windows {
                side_px: 64,
                least: 4,
                guard_px: 1,
            },
            (Self::Depth(_), _) => Parts::Whole,
        }
    }

    /// Draws what a camera sees as a command says, which may differ from the one that was read in how it is drawn.
    pub(crate) fn draw(&mut self, command: &Command, camera: &Camera) -> Result<Drawn> {
        match (self, command) {
            (Self::Mesh(open), Command::Texmap(args)) => open.draw(args, camera),
            (Self::Volume(open), Command::Volsplat(args)) => open.draw(args, camera),
            (Self::Depth(open), Command::Warp3d(args)) => open.draw(args, camera),
            _ => bail!(NOT_DRAWING),
        }
    }

    /// Draws and writes all pictures as a command says, which may differ likewise, and reports.
    pub(crate) fn finish(self, command: &Command, telling: Telling) -> Result<()> {
        match (self, command) {
            (Self::Mesh(open), Command::Texmap(args)) => open.finish(args, telling),
            (Self::Volume(open), Command::Volsplat(args)) => open.finish(args, telling),
            (Self::Depth(open), Command::Warp3d(args)) => open.finish(args, telling),
            _ => bail!(NOT_DRAWING),
        }
    }
}

/// What is said of a command of another kind.
const NOT_DRAWING: &str = "expected a command that draws: volsplat, texmap or warp3d";

/// Does all of a command but the drawing; for commands that draw one scene.
pub(crate) fn prepared(command: &Command) -> Result<Prepared> {
    match command {
        Command::Texmap(args) => texmap::prepared(args),
        Command::Volsplat(args) => volsplat::prepared(args),
        Command::Warp3d(args) => warp3d::prepared(args),
        _ => bail!(NOT_DRAWING),
    }
}
