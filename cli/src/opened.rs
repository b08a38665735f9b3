//! A scene whose files are read: drawn under one setting after another, and at last to its files.

use anyhow::Result;
use resample_core::Camera;
use serde_json::Value;

use crate::args::Drawing;
use crate::commands::{texmap, volsplat, warp3d};
use crate::picture::Drawn;
use crate::plan::{Purpose, RunLog};
use crate::report::Verbosity;
use crate::setting::Setting;

/// A scene whose files are read.
pub(crate) enum Opened {
    /// A mesh.
    Mesh(Box<texmap::Open>),
    /// A volume.
    Volume(Box<volsplat::Open>),
    /// Pictures with depth.
    Depth(Box<warp3d::Open>),
}

/// How a part of a picture can be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parts {
    /// A camera with a smaller picture and a moved principal point shows the same pixels. The fixed cost of a frame
    /// decides how large a part is worth drawing.
    Windows {
        /// Side, px.
        side_px: u32,
        /// Least number of parts that represent the whole.
        least: usize,
        /// Rim of a part that may differ, px: its pixels look at neighbours.
        guard_px: usize,
    },
    /// It cannot be drawn without the rest: several views, or holes that are filled from afar.
    Whole,
}

impl Opened {
    /// Reads the files of a command that draws.
    pub(crate) fn read(drawing: Drawing, purpose: Purpose, verbosity: Verbosity) -> Result<Self> {
        Ok(match drawing {
            Drawing::Texmap(args) => Self::Mesh(Box::new(texmap::Open::read(*args, verbosity)?)),
            Drawing::Volsplat(args) => {
                let open = volsplat::Open::read(*args, verbosity)?;
                if purpose == Purpose::Compare {
                    open.check_still()?;
                }
                Self::Volume(Box::new(open))
            }
            Drawing::Warp3d(args) => Self::Depth(Box::new(warp3d::Open::read(*args, purpose)?)),
        })
    }

    /// One camera per picture.
    pub(crate) fn cameras(&self) -> &[Camera] {
        match self {
            Self::Mesh(open) => open.cameras(),
            Self::Volume(open) => open.cameras(),
            Self::Depth(open) => open.cameras(),
        }
    }

    /// How a part of a picture can be drawn.
    pub(crate) fn parts(&self) -> Parts {
        match self {
            Self::Mesh(_) => Parts::Windows {
                side_px: 32,
                least: 6,
                guard_px: 0,
            },
            Self::Volume(_) => Parts::Windows {
                side_px: 16,
                least: 6,
                guard_px: 0,
            },
            Self::Depth(open) if open.has_parts() => Parts::Windows {
                side_px: 64,
                least: 4,
                guard_px: 1,
            },
            Self::Depth(_) => Parts::Whole,
        }
    }

    /// Draws under this setting from now on.
    pub(crate) fn set(&mut self, setting: &Setting) -> Result<()> {
        match (self, setting) {
            (Self::Mesh(open), Setting::Mesh(render)) => open.set(render),
            (Self::Volume(open), Setting::Volume(render)) => open.set(render),
            (Self::Depth(open), Setting::Depth(render)) => open.set(render),
            _ => anyhow::bail!("a setting of another application"),
        }
    }

    /// Draws what a camera sees.
    pub(crate) fn draw(&mut self, camera: &Camera) -> Result<Drawn> {
        match self {
            Self::Mesh(open) => open.draw(camera),
            Self::Volume(open) => open.draw(camera),
            Self::Depth(open) => open.draw(camera),
        }
    }

    /// Draws and writes all pictures, and reports; `planned` goes into the stats file.
    pub(crate) fn finish(self, planned: Option<Value>, log: RunLog) -> Result<()> {
        match self {
            Self::Mesh(open) => open.finish(planned, log),
            Self::Volume(open) => open.finish(planned, log),
            Self::Depth(open) => open.finish(planned, log),
        }
    }
}
