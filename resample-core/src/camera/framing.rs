//! Framing: the camera that shows all of a box from a side.
//!
//! The view is fitted to the sphere around the box and not to the box itself, so that pictures from all sides have the
//! same scale and a turntable does not jump.

use glam::DVec3;

use crate::camera::{Camera, CameraError, LookAt};

/// From which side, and through which lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// From the middle of the box to the eye; any length above 0.
    pub towards_eye: DVec3,
    /// The up direction in the picture; not along `towards_eye`.
    pub up: DVec3,
    /// Vertical field of view, radians.
    pub fov_y_rad: f64,
}

impl Framing {
    /// A perspective camera that shows the box between two corners.
    ///
    /// [`CameraError`] where the box is empty or the direction, the lens or the size are none.
    ///
    /// ```
    /// use glam::DVec3;
    /// use resample_core::Framing;
    ///
    /// let framing = Framing {
    ///     towards_eye: DVec3::Z,
    ///     up: DVec3::Y,
    ///     fov_y_rad: 0.5,
    /// };
    /// let camera = framing.camera([DVec3::ZERO, DVec3::ONE], [64, 64])?;
    /// assert!(camera.eye_in_world().z > 1.0);
    /// # Ok::<(), resample_core::CameraError>(())
    /// ```
    pub fn camera(&self, [low, high]: [DVec3; 2], size: [u32; 2]) -> Result<Camera, CameraError> {
        let middle = 0.5 * (low + high);
        let radius = 0.5 * (high - low).length();
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        // The sphere touches the nearer pair of edges.
        let half_tangent = (0.5 * self.fov_y_rad).tan() * aspect.min(1.0);
        let distance = radius / half_tangent.atan().sin();
        let pose = LookAt {
            position: middle + distance * self.towards_eye.normalize_or_zero(),
            target: middle,
            up: self.up,
        };
        Camera::perspective(&pose, self.fov_y_rad, size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_the_box_are_in_the_picture() {
        let bounds = [DVec3::new(-3.0, 1.0, 2.0), DVec3::new(5.0, 2.0, 9.0)];
        for size in [[64, 64], [90, 40], [40, 90]] {
            let framing = Framing {
                towards_eye: DVec3::new(0.3, 0.5, 1.0),
                up: DVec3::Y,
                fov_y_rad: 0.6,
            };
            let camera = framing.camera(bounds, size).expect("a box and a lens");
            for corner in 0..8 {
                let at = |axis: usize| bounds[corner >> axis & 1][axis];
                let corner = DVec3::new(at(0), at(1), at(2));
                let at_px =
                    camera.screen_from_camera(camera.camera_from_world.transform_point3(corner));
                assert!(
                    at_px.cmpge(glam::DVec2::ZERO).all()
                        && at_px.x <= f64::from(size[0])
                        && at_px.y <= f64::from(size[1]),
                    "{corner} falls on {at_px} of {size:?}"
                );
            }
        }
    }

    #[test]
    fn a_point_has_no_camera() {
        let framing = Framing {
            towards_eye: DVec3::Z,
            up: DVec3::Y,
            fov_y_rad: 0.6,
        };
        assert!(framing.camera([DVec3::ONE; 2], [8, 8]).is_err());
    }

    #[test]
    fn the_ball_around_the_box_fills_the_narrower_side() {
        let bounds = [DVec3::new(-3.0, 1.0, 2.0), DVec3::new(5.0, 2.0, 9.0)];
        let framing = Framing {
            towards_eye: DVec3::new(0.0, 0.0, 2.0),
            up: DVec3::Y,
            fov_y_rad: 0.6,
        };
        let camera = framing.camera(bounds, [90, 40]).expect("a box and a lens");
        let middle = camera
            .camera_from_world
            .transform_point3(0.5 * (bounds[0] + bounds[1]));
        // A ball is as wide as the angle whose sine is its radius over its distance.
        let radius = 0.5 * (64.0f64 + 1.0 + 49.0).sqrt();
        let wanted = DVec3::new(0.0, 0.0, radius / 0.3f64.sin());
        assert!(
            middle.distance(wanted) < 1e-12 * radius,
            "{middle} against {wanted}"
        );
    }
}
