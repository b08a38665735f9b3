//! A scene whose files are read: drawn under one setting after another, and at last to its files.
//!
//! `open_scene` is the face of the applications (`volume`, `gaussians`, `mesh`, `depth`, `points`), each of which has a folder; a `setting` holds the
//! options of an opened scene. [`volume()`] and [`mesh()`] make scenes of data in memory.

pub(crate) mod figure;
pub mod setting;
pub(crate) mod open_scene;
pub(crate) mod volume;
pub(crate) mod gaussians;
pub(crate) mod mesh;
pub(crate) mod depth;
pub(crate) mod points;

use std::any::Any;

use anyhow::{Result, bail};
use glam::DVec3;
use resample_core::{Camera, Image, Stop};
use resample_io::figure::Figure;
use serde_json::Value;
use texmap::{Loaded, Scene};
use volsplat::{Lattice, Volume, Voxels};

use crate::args::{Drawing, TexmapArgs, VolsplatArgs};
use crate::open::depth::OpenDepth;
use crate::open::gaussians::OpenGaussians;
use crate::open::mesh::{OpenMesh, load_options};
use crate::open::open_scene::{OpenScene, Probed};
use crate::open::points::OpenPoints;
use crate::open::setting::Setting;
use crate::open::volume::{OpenVolume, file};
use crate::picture;
use crate::picture::Drawn;
use crate::plan::{Change, Purpose, RunLog};
use crate::process::report::Verbosity;
use resample_core::camera::bands::Window;

pub use crate::open::depth::fed::FedFilm;
pub use crate::open::open_scene::Parts;

/// A scene whose files are read.
pub struct Opened {
    scene: Box<dyn OpenScene>,
}

impl Opened {
    /// Reads the files of a command that draws.
    pub fn read(drawing: Drawing, purpose: Purpose, verbosity: Verbosity) -> Result<Self> {
        let opened = Self {
            scene: match drawing {
                Drawing::Texmap(args) => Box::new(OpenMesh::read(*args, verbosity)?),
                Drawing::Volsplat(args) => Box::new(OpenVolume::read(*args, purpose, verbosity)?),
                Drawing::Gaussians(args) => Box::new(OpenGaussians::read(*args, verbosity)?),
                Drawing::Warp3d(args) => Box::new(OpenDepth::read(*args, purpose, verbosity)?),
                Drawing::Points(args) => Box::new(OpenPoints::read(*args, purpose, verbosity)?),
            },
        };
        opened.check_figure()?;
        Ok(opened)
    }

    /// One camera per picture.
    pub fn cameras(&self) -> &[Camera] {
        self.scene.cameras()
    }

    /// How a part of a picture can be drawn.
    pub fn parts(&self) -> Parts {
        self.scene.parts()
    }

    /// Returns true if a picture can be drawn in bands: a warp casts all of its samples for each, and an order of samples may divide
    /// them otherwise.
    pub fn has_bands(&self) -> bool {
        self.scene.has_bands()
    }

    /// The volume, if it is one.
    pub(crate) fn volume(&self) -> Option<&OpenVolume> {
        let scene: &dyn Any = &*self.scene;
        scene.downcast_ref()
    }

    /// The values and colours, linear light, of a colour bar; `None` where the scene has no single scale of colours.
    pub fn colour_scale(&self) -> Option<([f64; 2], Vec<[f32; 3]>)> {
        self.volume()?.colour_scale()
    }

    /// The bounding box of the visible part, world units: its least and its greatest corner. `None` for depth images.
    pub fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        self.scene.bounds_in_world()
    }

    /// Draws under this setting from now on.
    pub fn set(&mut self, setting: &Setting) -> Result<()> {
        self.scene.set(setting)
    }

    /// Draws with the look and the options of a command from now on; its cameras are ignored.
    pub(crate) fn restyle(&mut self, drawing: &Drawing) -> Result<()> {
        self.scene.restyle(drawing)
    }

    /// Takes new options of the same command and scene; false where the scene has to be read again for them.
    pub fn change(&mut self, drawing: &Drawing, change: Change) -> Result<bool> {
        let is_changed = self.scene.change(drawing, change)?;
        self.check_figure()?;
        Ok(is_changed)
    }

    /// Applies the animation state of frame `number`.
    pub fn turn_to(&mut self, number: usize) -> Result<()> {
        self.scene.turn_to(number)
    }

    /// Ends frames early once `stop` is asked for, where the application can.
    pub(crate) fn stop_with(&mut self, stop: Stop) {
        self.scene.stop_with(stop);
    }

    /// Draws the picture of one camera.
    pub fn draw(&mut self, camera: &Camera) -> Result<Drawn> {
        self.scene.draw(camera)
    }

    /// Draws a window of the picture of one camera, with all planes that were asked for: the pixels that the whole picture has
    /// there. It begins at edges of tiles ([`TILE_SIDE`](resample_core::camera::bands::TILE_SIDE)).
    pub fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Drawn> {
        if *window != Window::whole(camera) && !self.has_bands() {
            bail!("this scene cannot be tiled; split the work with --frames");
        }
        self.scene.draw_window(camera, window)
    }

    /// A picture of a camera over its background and under its figure.
    pub fn finished(&self, image: Image, camera: &Camera) -> Image {
        let figure = self.figure();
        picture::finished(
            image,
            (camera, [0, 0]),
            self.scene.background(),
            figure.as_ref(),
        )
    }

    /// The figure of every picture.
    pub(crate) fn figure(&self) -> Option<Figure> {
        // It was checked when the options were taken.
        self.scene.figure().ok().flatten()
    }

    /// Refuses a figure that the pictures cannot have.
    fn check_figure(&self) -> Result<()> {
        match self.scene.figure()? {
            Some(figure) => figure::check(&figure, self.scene.cameras()),
            None => Ok(()),
        }
    }

    /// The first visible point on the ray of a camera with one pixel.
    pub(crate) fn probe(&mut self, pixel: &Camera) -> Result<Option<Probed>> {
        self.scene.probe(pixel)
    }

    /// Draws and writes all pictures, and reports; `planned` goes into the stats file.
    pub fn finish(self, planned: Option<Value>, log: RunLog) -> Result<()> {
        self.scene.finish(planned, log)
    }
}

/// Makes the volume that `args` ask for of voxels in memory; errors name the input of `args`.
pub fn volume(args: &VolsplatArgs, lattice: Lattice, voxels: Voxels) -> Result<Volume> {
    let gate = args.volume.reading.gate();
    let options = file::load_options(&args.volume, &args.input, &gate)?;
    let made = volsplat::input::of_memory(&args.input.path, lattice, voxels, &options);
    Ok(made?)
}

/// Makes the scene that `args` ask for of triangles in memory; errors name the input of `args`.
pub fn mesh(args: &TexmapArgs, scene: Scene) -> Result<Loaded> {
    let options = load_options(args, 0, &args.model.reading.gate());
    let made = texmap::input::of_memory(&args.input.path, scene, &options);
    Ok(made?)
}
