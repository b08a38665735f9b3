//! Places of the world on the screen.

use glam::{DAffine3, DVec2, DVec3};
use resample_core::{Camera, Projection};

/// From the world to camera space; `None` where the camera has no such map.
pub(super) fn camera_from_world(camera: &Camera) -> Option<DAffine3> {
    let map = camera.camera_from_world;
    map.is_finite().then_some(map)
}

/// Screen position, px, and camera z of a place; `None` behind the eye.
pub(super) fn projected(camera: &Camera, pos_in_world: DVec3) -> Option<(DVec2, f64)> {
    let camera_from_world = camera_from_world(camera)?;
    let place = camera_from_world.transform_point3(pos_in_world);
    (place.z > camera.near).then(|| (camera.screen_from_camera(place), place.z))
}

/// Pixels of a world unit across the view at a place; `None` behind the eye.
pub(super) fn px_per_unit(camera: &Camera, pos_in_world: DVec3) -> Option<f64> {
    let (_, z) = projected(camera, pos_in_world)?;
    Some(match camera.projection {
        Projection::Perspective => camera.fx / z,
        Projection::Orthographic => camera.fx,
    })
}
