//! A reference view: a picture, its depth and its camera, as every input format leaves them.
//!
//! After input everything is one convention: linear light, camera z as depth, the core's camera. Later stages do not
//! check again.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::Camera;

/// A picture with depth and the camera that took it.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The camera; its width and height are those of the planes.
    pub camera: Camera,
    /// Linear red, green and blue, rows from the top. A sample lies at its pixel's centre.
    pub colour: Vec<[f32; 3]>,
    /// Camera z of each pixel, world units, above 0; NaN where nothing is known.
    pub depth: Vec<f32>,
}

/// Two corners of a box around nothing.
pub const NO_BOUNDS: [DVec3; 2] = [DVec3::INFINITY, DVec3::NEG_INFINITY];

impl Reference {
    /// Two corners of the box around all samples that have a depth, world units.
    pub fn bounds(&self) -> [DVec3; 2] {
        let rows = self
            .depth
            .par_chunks(self.camera.width.max(1) as usize)
            .enumerate();
        rows.map(|(y, depth)| row_bounds(&self.camera, y, depth))
            .reduce(|| NO_BOUNDS, joined)
    }
}

/// The box around two boxes.
pub fn joined(a: [DVec3; 2], b: [DVec3; 2]) -> [DVec3; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Two corners of the box around the samples of row `y`, world units.
pub(crate) fn row_bounds(camera: &Camera, y: usize, depth: &[f32]) -> [DVec3; 2] {
    let world_from_camera = camera.camera_from_world.inverse();
    let mut corners = NO_BOUNDS;
    for (x, &z) in depth.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
        let (origin, direction) = camera.ray_in_camera(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let pos_in_world = world_from_camera.transform_point3(origin + f64::from(z) * direction);
        corners = joined(corners, [pos_in_world; 2]);
    }
    corners
}
