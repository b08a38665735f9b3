//! Directions in a panorama, longitude along x and latitude along y (equirectangular), and the six faces around an eye.
//!
//! The middle of the picture is forward, its left and right edge behind, its top edge up. Axes are a camera's: x right, y
//! down, z forward.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3};
use resample_core::{Camera, Projection};

/// Right, down and forward of the six faces in the panorama's axes: front, right, back, left, up, down.
const FACES: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::NEG_Z, DVec3::Y, DVec3::X],
    [DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z],
    [DVec3::Z, DVec3::Y, DVec3::NEG_X],
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::X, DVec3::NEG_Z, DVec3::Y],
];

/// Pixels of a face to a pixel of the panorama where faces are coarsest, at their centres. One would be the panorama's
/// own scale; a quarter more keeps small what two resamplings lose at the highest frequencies.
const FACE_SCALE: f64 = 1.25;

/// Focal length, px, of the faces that hold a panorama of this size.
///
/// ```
/// use warp3d::panorama::focal_px;
///
/// assert!(focal_px([4096, 2048]) > 4096.0 / std::f64::consts::TAU);
/// ```
pub fn focal_px(size: [u32; 2]) -> f64 {
    let [per_longitude, per_latitude] = [f64::from(size[0]) / TAU, f64::from(size[1]) / PI];
    FACE_SCALE * per_longitude.max(per_latitude)
}

/// The cameras of six faces at a world-to-camera pose; each shows `margin_px` more than its quarter on every side.
pub fn faces(camera_from_world: DAffine3, near: f64, focal_px: f64, margin_px: f64) -> [Camera; 6] {
    let half_px = (focal_px + margin_px).ceil();
    FACES.map(|axes| Camera {
        projection: Projection::Perspective,
        width: 2 * half_px as u32,
        height: 2 * half_px as u32,
        fx: focal_px,
        fy: focal_px,
        cx: half_px,
        cy: half_px,
        camera_from_world: DAffine3::from_mat3(face_from_panorama(axes)) * camera_from_world,
        near,
    })
}

/// The face that a direction meets, and where on its plane at distance 1.
///
/// ```
/// use glam::DVec3;
/// use warp3d::panorama::face_of;
///
/// let (ahead, _) = face_of(DVec3::Z);
/// let (back, _) = face_of(-DVec3::Z);
/// assert_ne!(ahead, back);
/// ```
pub fn face_of(towards: DVec3) -> (usize, DVec2) {
    let ahead = |face: usize| towards.dot(FACES[face][2]);
    let face = (0..6)
        .max_by(|&a, &b| ahead(a).total_cmp(&ahead(b)))
        .unwrap_or(0);
    let [right, down, _] = FACES[face];
    let on_plane = DVec2::new(towards.dot(right), towards.dot(down)) / ahead(face);
    (face, on_plane)
}

/// The direction of a position in a panorama, px.
///
/// ```
/// use glam::{DVec2, DVec3};
/// use warp3d::panorama::{direction, position};
///
/// let size = [400, 200];
/// let ahead = direction(DVec2::new(200.0, 100.0), size);
/// assert!((ahead - DVec3::Z).length() < 1e-12);
/// assert!((position(ahead, size) - DVec2::new(200.0, 100.0)).length() < 1e-9);
/// ```
pub fn direction(pos: DVec2, size: [u32; 2]) -> DVec3 {
    let longitude = (pos.x / f64::from(size[0]) - 0.5) * TAU;
    let latitude = (0.5 - pos.y / f64::from(size[1])) * PI;
    let (sin, cos) = longitude.sin_cos();
    DVec3::new(latitude.cos() * sin, -latitude.sin(), latitude.cos() * cos)
}

/// The position of a direction in a panorama, px.
pub fn position(towards: DVec3, size: [u32; 2]) -> DVec2 {
    let longitude = towards.x.atan2(towards.z);
    let latitude = (-towards.y).atan2(towards.x.hypot(towards.z));
    let part = DVec2::new(longitude / TAU + 0.5, 0.5 - latitude / PI);
    part * DVec2::new(f64::from(size[0]), f64::from(size[1]))
}

/// From the panorama's axes to those of face `index`.
#[cfg(feature = "input")]
pub(crate) fn turn_of(index: usize) -> DMat3 {
    face_from_panorama(FACES[index])
}

fn face_from_panorama([right, down, forward]: [DVec3; 3]) -> DMat3 {
    DMat3::from_cols(right, down, forward).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_is_where_its_face_and_its_position_say() {
        let size = [200, 100];
        let faces = faces(DAffine3::IDENTITY, 0.1, 50.0, 3.0);
        for index in 0..200 * 100 {
            let pos = DVec2::new(f64::from(index % 200), f64::from(index / 200)) + 0.5;
            let towards = direction(pos, size);
            assert!((position(towards, size) - pos).length() < 1e-9, "{pos}");
            let (face, on_plane) = face_of(towards);
            let camera = &faces[face];
            let seen =
                camera.screen_from_camera(camera.camera_from_world.transform_point3(towards));
            assert!(
                (seen - (on_plane * 50.0 + 53.0)).length() < 1e-9,
                "{pos}: face {face}"
            );
        }
        let near = |pos: [f64; 2], expected: DVec3| {
            (direction(pos.into(), size) - expected).length() < 1e-12
        };
        assert!(
            near([100.0, 50.0], DVec3::Z)
                && near([150.0, 50.0], DVec3::X)
                && near([7.0, 0.0], DVec3::NEG_Y)
        );
    }
}
