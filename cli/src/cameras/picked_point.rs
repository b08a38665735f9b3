//! The point that a camera of one pixel sees, from its camera z.

use glam::{DVec2, DVec3};
use resample_core::{Camera, Image};

/// The place on the ray of the pixel's centre at this camera z, world units.
pub(crate) fn world_at(pixel: &Camera, depth: f64) -> DVec3 {
    let (origin, direction) = pixel.ray_in_camera(DVec2::new(0.5, 0.5));
    let pos_in_camera = origin + direction * (depth - origin.z) / direction.z;
    pixel
        .camera_from_world
        .inverse()
        .transform_point3(pos_in_camera)
}

/// The place that a picture of one pixel shows; `None` where it shows nothing, or has no depth.
pub(crate) fn in_world(pixel: &Camera, picture: &Image) -> Option<DVec3> {
    let depth = *picture.depth.as_ref()?.first()?;
    depth.is_finite().then(|| world_at(pixel, f64::from(depth)))
}
