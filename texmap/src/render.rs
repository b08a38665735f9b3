//! The renderer: a scene prepared once, then one picture per camera.

use glam::DVec3;
use resample_core::{Camera, Image};

use crate::options::RenderOptions;
use crate::stats::{FrameStats, StageClock};
use crate::{Error, Scene};

/// Renders one prepared scene, frame after frame.
#[derive(Clone, Debug)]
pub struct Renderer {
    options: RenderOptions,
    bounds_in_world: Option<[DVec3; 2]>,
}

/// A picture and what it cost.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The picture.
    pub image: Image,
    /// Counts and times.
    pub stats: FrameStats,
}

impl Renderer {
    /// Prepares `scene` for rendering with `options`.
    ///
    /// # Errors
    /// [`Error::Option`] if an option is outside its range.
    pub fn new(scene: &Scene, options: &RenderOptions) -> Result<Self, Error> {
        options.validate()?;
        Ok(Self { options: options.clone(), bounds_in_world: bounds_in_world(scene) })
    }

    /// The box, in the world, of the vertices that triangles use; `None` if there are none.
    pub fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        self.bounds_in_world
    }

    /// Renders one frame.
    ///
    /// # Errors
    /// [`Error::Option`] if the camera is none.
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        let camera = camera.validated().map_err(|e| Error::Option(e.to_string()))?;
        let whole = StageClock::start();
        let mut stats = FrameStats::default();
        let image = Image::transparent(camera.width as usize, camera.height as usize);
        let _ = &self.options;
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }
}

fn bounds_in_world(scene: &Scene) -> Option<[DVec3; 2]> {
    let corners = scene.meshes.iter().flat_map(|mesh| {
        mesh.triangles.iter().flatten().map(|&i| DVec3::from(mesh.positions[i as usize].map(f64::from)))
    });
    corners.fold(None, |bounds, p| match bounds {
        None => Some([p, p]),
        Some([low, high]) => Some([low.min(p), high.max(p)]),
    })
}
