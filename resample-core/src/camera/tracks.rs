//! Cameras in motion: the numbers of a row of cameras, each passed through smoothly.
//!
//! Takes cameras at keys, gives one between them. A camera with a target moves by its target, its direction and its distance; another by its
//! eye. Lengths move on a logarithmic scale.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::camera::spline;
use crate::camera::spline::Moment;
use crate::camera::{Camera, CameraError, Projection};

/// The numbers of cameras, key by key.
#[derive(Clone, Debug)]
pub struct CameraTracks {
    template: Camera,
    /// Each number along the keys: pivot x, y, z; then logarithms of distance, focal lengths and near plane; then the
    /// principal point.
    numbers: Vec<Vec<f64>>,
    orientations: Vec<DQuat>,
    /// True if the eye is away from the pivot.
    orbits: bool,
}

impl CameraTracks {
    /// The tracks of at least one camera; `distances` are from each eye to its target, where there is one.
    pub fn new(cameras: &[Camera], distances: impl Iterator<Item = Option<f64>>) -> Self {
        let distances: Vec<f64> = distances.map(Option::unwrap_or_default).collect();
        let orbits = distances.iter().all(|&distance| distance > 0.0);
        let mut numbers = vec![Vec::new(); 9];
        for (camera, distance) in cameras.iter().zip(distances) {
            let distance = if orbits { distance } else { 0.0 };
            let pivot = camera.eye_in_world() + distance * camera.forward_in_world();
            let logarithms = [distance.max(f64::MIN_POSITIVE), camera.fx, camera.fy].map(f64::ln);
            // An orthographic camera's near plane may be 0 or less.
            let near = if orthographic(camera) {
                camera.near
            } else {
                camera.near.ln()
            };
            let all = pivot
                .to_array()
                .into_iter()
                .chain(logarithms)
                .chain([near, camera.cx, camera.cy]);
            numbers
                .iter_mut()
                .zip(all)
                .for_each(|(track, value)| track.push(value));
        }
        let orientation =
            |camera: &Camera| DQuat::from_mat3(&camera.camera_from_world.matrix3.transpose());
        Self {
            template: cameras[0],
            numbers,
            orientations: cameras.iter().map(orientation).collect(),
            orbits,
        }
    }

    /// The camera at a moment between keys at these times.
    ///
    /// # Errors
    /// Numbers between the keys that make no camera.
    pub fn camera(&self, times_s: &[f64], at: Moment) -> Result<Camera, CameraError> {
        let number = |track: usize| spline::number(times_s, &self.numbers[track], at);
        let world_from_camera =
            DMat3::from_quat(spline::orientation(times_s, &self.orientations, at));
        let distance = if self.orbits { number(3).exp() } else { 0.0 };
        let eye = DVec3::new(number(0), number(1), number(2)) - distance * world_from_camera.z_axis;
        let rotation = world_from_camera.transpose();
        let near = if orthographic(&self.template) {
            number(6)
        } else {
            number(6).exp()
        };
        let camera = Camera {
            camera_from_world: DAffine3::from_mat3_translation(rotation, rotation * -eye),
            fx: number(4).exp(),
            fy: number(5).exp(),
            near,
            cx: number(7),
            cy: number(8),
            ..self.template
        };
        camera.validated()
    }
}

fn orthographic(camera: &Camera) -> bool {
    camera.projection == Projection::Orthographic
}
