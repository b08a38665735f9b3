//! A scene whose files are read: drawn under one setting after another, and at last to its files.
//!
//! One folder for each application (`volume`, `mesh`, `depth`); a `setting` changes options of an opened scene; `memory` checks scenes that
//! a program holds in memory.

pub mod setting;
pub(crate) mod volume;
pub(crate) mod mesh;
pub(crate) mod depth;
pub mod memory;

use anyhow::{Result, bail};
use glam::DVec3;
use resample_core::{Camera, Image};
use serde_json::Value;

use crate::args::Drawing;
use crate::open::setting::Setting;
use crate::picture::Drawn;
use crate::picture::bands::Window;
use crate::plan::{Change, Purpose, RunLog};
use crate::process::report::Verbosity;

/// A scene whose files are read.
pub struct Opened {
    scene: Scene,
}

enum Scene {
    Mesh(Box<mesh::Open>),
    Volume(Box<volume::Open>),
    Depth(Box<depth::Open>),
}

/// How a part of a picture can be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parts {
    /// A camera with a smaller picture and a moved principal point shows the same pixels. The fixed cost of a frame
    /// decides how large a part is worth drawing.
    Windows {
        /// Side, px.
        side_px: u32,
        /// Rim of a part that may differ, px: its pixels look at neighbours.
        guard_px: usize,
    },
    /// It cannot be drawn without the rest: several views, or holes that are filled from afar.
    Whole,
}

impl Opened {
    /// Reads the files of a command that draws.
    pub fn read(drawing: Drawing, purpose: Purpose, verbosity: Verbosity) -> Result<Self> {
        let scene = match drawing {
            Drawing::Texmap(args) => Scene::Mesh(Box::new(mesh::Open::read(*args, verbosity)?)),
            Drawing::Volsplat(args) => {
                let open = volume::Open::read(*args, purpose, verbosity)?;
                if purpose != Purpose::Draw {
                    open.check_still()?;
                }
                Scene::Volume(Box::new(open))
            }
            Drawing::Warp3d(args) => {
                Scene::Depth(Box::new(depth::Open::read(*args, purpose, verbosity)?))
            }
        };
        Ok(Self { scene })
    }

    /// One camera per picture.
    pub fn cameras(&self) -> &[Camera] {
        match &self.scene {
            Scene::Mesh(open) => open.cameras(),
            Scene::Volume(open) => open.cameras(),
            Scene::Depth(open) => open.cameras(),
        }
    }

    /// How a part of a picture can be drawn.
    pub fn parts(&self) -> Parts {
        match &self.scene {
            Scene::Mesh(_) => Parts::Windows {
                side_px: 16,
                guard_px: 0,
            },
            // Means of pixels are corrected by their neighbours.
            Scene::Volume(_) => Parts::Windows {
                side_px: 8,
                guard_px: 1,
            },
            Scene::Depth(open) if open.has_parts() => Parts::Windows {
                side_px: 32,
                guard_px: 1,
            },
            Scene::Depth(_) => Parts::Whole,
        }
    }

    /// Draws under this setting from now on.
    pub fn set(&mut self, setting: &Setting) -> Result<()> {
        match (&mut self.scene, setting) {
            (Scene::Mesh(open), Setting::Mesh(render)) => open.set(render),
            (Scene::Volume(open), Setting::Volume(render)) => open.set(render),
            (Scene::Depth(open), Setting::Depth(render)) => open.set(render),
            _ => bail!("a setting of another application"),
        }
    }

    /// The volume, if it is one.
    pub(crate) fn volume(&mut self) -> Option<&mut volume::Open> {
        match &mut self.scene {
            Scene::Volume(open) => Some(open),
            Scene::Mesh(_) | Scene::Depth(_) => None,
        }
    }

    /// The mesh, if it is one.
    pub(crate) fn mesh(&mut self) -> Option<&mut mesh::Open> {
        match &mut self.scene {
            Scene::Mesh(open) => Some(open),
            Scene::Volume(_) | Scene::Depth(_) => None,
        }
    }

    /// The bounding box of the visible part, world units: its least and its greatest corner. `None` for depth images.
    pub fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        match &self.scene {
            Scene::Volume(open) => Some(open.bounds_in_world()),
            Scene::Mesh(open) => open.bounds_in_world(),
            Scene::Depth(_) => None,
        }
    }

    /// Draws the picture of one camera.
    pub fn draw(&mut self, camera: &Camera) -> Result<Drawn> {
        match &mut self.scene {
            Scene::Mesh(open) => open.draw(camera),
            Scene::Volume(open) => open.draw(camera),
            Scene::Depth(open) => open.draw(camera),
        }
    }

    /// Applies the animation state of frame `number`.
    pub fn turn_to(&mut self, number: usize) -> Result<()> {
        match &mut self.scene {
            Scene::Mesh(open) => open.turn_to(number),
            Scene::Volume(open) => open.turn_to(number),
            Scene::Depth(open) => open.turn_to(number),
        }
    }

    /// Draws a window of the picture of one camera, with all planes that were asked for: the pixels that the whole picture has
    /// there. It begins at edges of tiles ([`TILE_SIDE`](crate::picture::bands::TILE_SIDE)).
    pub fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Drawn> {
        if *window != Window::whole(camera) && !self.has_bands() {
            bail!("this scene cannot be tiled; split the work with --frames");
        }
        match &mut self.scene {
            Scene::Mesh(open) => open.draw_window(camera, window),
            Scene::Volume(open) => open.draw_window(camera, window),
            Scene::Depth(open) => open.draw(camera),
        }
    }

    /// A picture with its background behind it.
    pub fn finished(&self, image: Image) -> Image {
        let background = match &self.scene {
            Scene::Mesh(open) => open.background(),
            Scene::Volume(open) => open.background(),
            Scene::Depth(open) => open.background(),
        };
        background.behind(image)
    }

    /// Returns true if a picture can be drawn in bands: a warp casts all of its samples for each, and an order of samples may divide
    /// them otherwise.
    pub fn has_bands(&self) -> bool {
        match &self.scene {
            Scene::Mesh(_) => true,
            Scene::Volume(open) => open.is_field(),
            Scene::Depth(_) => false,
        }
    }

    /// Takes new options of the same command and scene; false where the scene has to be read again for them.
    pub fn change(&mut self, drawing: &Drawing, change: Change) -> Result<bool> {
        match (&mut self.scene, drawing) {
            (Scene::Volume(open), Drawing::Volsplat(args)) => {
                open.change((**args).clone(), change)?;
                Ok(true)
            }
            (Scene::Mesh(open), Drawing::Texmap(args)) => {
                open.change((**args).clone(), change)?;
                Ok(true)
            }
            // New cameras may need another arrangement of the references.
            _ => Ok(false),
        }
    }

    /// Draws and writes all pictures, and reports; `planned` goes into the stats file.
    pub fn finish(self, planned: Option<Value>, log: RunLog) -> Result<()> {
        match self.scene {
            Scene::Mesh(open) => open.finish(planned, log),
            Scene::Volume(open) => open.finish(planned, log),
            Scene::Depth(open) => open.finish(planned, log),
        }
    }
}
