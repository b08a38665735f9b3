//! The trait of a scene whose files are read: cameras, options, pictures and the report.
//!
//! A further kind of scene implements [`OpenScene`], and is read in [`super::Opened::read`].

use std::any::Any;

use anyhow::Result;
use glam::DVec3;
use resample_core::{Camera, Stop};
use serde_json::Value;

use crate::args::Drawing;
use crate::cameras::viewpoint;
use crate::open::setting::Setting;
use crate::picture::Drawn;
use crate::plan::{Change, RunLog};
use resample_core::camera::bands::Window;
use resample_io::figure::Figure;
use texmap::background::Background;

/// A scene whose files are read.
pub(crate) trait OpenScene: Any + Send + Sync {
    /// One camera per picture.
    fn cameras(&self) -> &[Camera];

    /// The background of every picture.
    fn background(&self) -> &Background;

    /// The figure of every picture.
    ///
    /// # Errors
    /// Parts of a figure that the scene does not have.
    fn figure(&self) -> Result<Option<Figure>> {
        Ok(None)
    }

    /// The bounding box of the visible part, world units: its least and its greatest corner. `None` for depth images.
    fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        None
    }

    /// How a part of a picture can be drawn.
    fn parts(&self) -> Parts;

    /// Returns true if a picture can be drawn in bands: the cost of a band follows its pixels.
    fn has_bands(&self) -> bool {
        true
    }

    /// Draws with these options from now on.
    ///
    /// # Errors
    /// A setting of another application, and options that the scene cannot be drawn with.
    fn set(&mut self, setting: &Setting) -> Result<()>;

    /// Draws with the look of a command and with its options from now on; its cameras are ignored.
    fn restyle(&mut self, drawing: &Drawing) -> Result<()> {
        self.set(&drawing.setting())
    }

    /// Takes new options of the same command and scene; false where the scene has to be read again for them.
    fn change(&mut self, drawing: &Drawing, change: Change) -> Result<bool>;

    /// Applies the animation state of frame `number`; scenes that stand still have none.
    fn turn_to(&mut self, _number: usize) -> Result<()> {
        Ok(())
    }

    /// Ends frames early once `stop` is asked for, where the application can.
    fn stop_with(&mut self, _stop: Stop) {}

    /// Draws the picture of one camera.
    fn draw(&mut self, camera: &Camera) -> Result<Drawn> {
        self.draw_window(camera, &Window::whole(camera))
    }

    /// Draws a window of the picture of one camera, with all planes that were asked for: the pixels that the whole picture has
    /// there. It begins at edges of tiles. Scenes without bands are asked for the whole picture alone.
    fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Drawn>;

    /// The first visible point on the ray of a camera with one pixel.
    fn probe(&mut self, pixel: &Camera) -> Result<Option<Probed>> {
        let world = viewpoint::in_world(pixel, &self.draw(pixel)?.image);
        Ok(world.map(Probed::of_surface))
    }

    /// Draws and writes all pictures, and reports; `planned` goes into the stats file.
    fn finish(self: Box<Self>, planned: Option<Value>, log: RunLog) -> Result<()>;
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

/// The point under a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Probed {
    /// World position.
    pub(crate) world: DVec3,
    /// Index of the nearest voxel of a volume, and its value.
    pub(crate) voxel: Option<([usize; 3], f64)>,
}

impl Probed {
    /// A point of a surface.
    pub(crate) fn of_surface(world: DVec3) -> Self {
        Self { world, voxel: None }
    }
}
