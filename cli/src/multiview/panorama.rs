//! All directions in one picture: longitude along x, latitude along y (equirectangular).
//!
//! The middle of the picture is the camera's forward direction, the left edge the one behind it, the top edge up. A
//! panorama is drawn as the six faces of a cube, each a little larger than its quarter, and resampled from them by the
//! cubic of Keys (1981). Its depth is the distance from the eye, because camera z has no meaning behind a camera.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use resample_core::{Camera, Image, Plane};

use crate::values::Size;

/// Pixels of a face that lie beyond its quarter on each side: what the cubic reads.
const MARGIN_PX: f64 = 2.0;

/// Pixels of a face to an equirectangular pixel where faces are coarsest, at their centres. One would be the picture's
/// own scale; a quarter more keeps the cubic's loss at the highest frequencies small.
const FACE_SCALE: f64 = 1.25;

/// Right, down and forward of the six faces in the panorama's axes: front, right, back, left, up, down.
const FACES: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::NEG_Z, DVec3::Y, DVec3::X],
    [DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z],
    [DVec3::Z, DVec3::Y, DVec3::NEG_X],
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::X, DVec3::NEG_Z, DVec3::Y],
];

/// Width and height of a panorama, px: those that were asked for, or those of the camera's scale at its centre.
pub fn size(camera: &Camera, asked: Option<Size>) -> [u32; 2] {
    asked.map_or_else(
        || {
            let half_turn = (std::f64::consts::PI * camera.fx).round() as u32;
            [2 * half_turn, half_turn]
        },
        |size| [size.width, size.height],
    )
}

/// The cameras of the six faces of a panorama of the sheet's size, at the sheet's pose.
pub fn faces(sheet: &Camera) -> Vec<Camera> {
    let per_radian = f64::from(sheet.width) / std::f64::consts::TAU;
    let per_latitude = f64::from(sheet.height) / std::f64::consts::PI;
    faces_of(sheet, FACE_SCALE * per_radian.max(per_latitude), MARGIN_PX)
}

/// Six faces with this focal length, px, at the pose of `pose`.
pub fn faces_of(pose: &Camera, focal_px: f64, margin_px: f64) -> Vec<Camera> {
    let half_px = (focal_px + margin_px).ceil();
    let face = |&[right, down, forward]: &[DVec3; 3]| {
        let turn = DMat3::from_cols(right, down, forward).transpose();
        Camera {
            projection: resample_core::Projection::Perspective,
            width: 2 * half_px as u32,
            height: 2 * half_px as u32,
            fx: focal_px,
            fy: focal_px,
            cx: half_px,
            cy: half_px,
            camera_from_world: DAffine3::from_mat3(turn) * pose.camera_from_world,
            near: pose.near,
        }
    };
    FACES.iter().map(face).collect()
}

/// The direction of a position in a panorama, px, in its axes: x right, y down, z forward.
pub fn direction(pos: DVec2, size: [u32; 2]) -> DVec3 {
    let longitude = (pos.x / f64::from(size[0]) - 0.5) * std::f64::consts::TAU;
    let latitude = (0.5 - pos.y / f64::from(size[1])) * std::f64::consts::PI;
    let (sin, cos) = longitude.sin_cos();
    DVec3::new(latitude.cos() * sin, -latitude.sin(), latitude.cos() * cos)
}

/// The panorama of the pictures of its faces.
pub(super) fn put_together(sheet: &Camera, views: &[Image]) -> Image {
    let size = [sheet.width, sheet.height];
    let (width, height) = (size[0] as usize, size[1] as usize);
    let focal_px = faces(sheet)[0].fx;
    let mut whole = Image::transparent(width, height);
    let mut depth = vec![f32::INFINITY; width * height];
    let names = views[0].planes.iter().map(|plane| plane.name.clone());
    whole.planes = names
        .map(|name| Plane {
            name,
            values: vec![0.0; width * height],
        })
        .collect();
    for index in 0..width * height {
        let pos = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
        let towards = direction(pos, size);
        let (face, on_plane) = face_of(towards);
        let view = &views[face];
        let at = on_plane * focal_px + 0.5 * view.width as f64;
        whole.rgba[index] = cubic(view, at);
        let nearest = at.y as usize * view.width + at.x as usize;
        if let Some(z) = &view.depth {
            depth[index] = z[nearest] * on_plane.extend(1.0).length() as f32;
        }
        for (whole, own) in whole.planes.iter_mut().zip(&view.planes) {
            whole.values[index] = own.values[nearest];
        }
    }
    whole.depth = views[0].depth.is_some().then_some(depth);
    whole
}

/// The face that a direction meets, and where on its plane at distance 1.
fn face_of(towards: DVec3) -> (usize, DVec2) {
    let ahead = |face: usize| towards.dot(FACES[face][2]);
    let face = (0..6)
        .max_by(|&a, &b| ahead(a).total_cmp(&ahead(b)))
        .unwrap_or(0);
    let [right, down, _] = FACES[face];
    let on_plane = DVec2::new(towards.dot(right), towards.dot(down)) / ahead(face);
    (face, on_plane)
}

/// A picture at a place, by the cubic of Keys; colour stays within its alpha.
fn cubic(view: &Image, at: DVec2) -> [f32; 4] {
    let corner = at - 0.5;
    let base = corner.floor();
    let [wx, wy] = [corner.x - base.x, corner.y - base.y].map(keys);
    let place = |base: f64, step: usize, count: usize| {
        (base as i64 + step as i64 - 1).clamp(0, count as i64 - 1) as usize
    };
    let mut sum = [0.0f32; 4];
    for (dy, wy) in wy.into_iter().enumerate() {
        for (dx, wx) in wx.into_iter().enumerate() {
            let pixel = view.pixel(
                place(base.x, dx, view.width),
                place(base.y, dy, view.height),
            );
            for (sum, value) in sum.iter_mut().zip(pixel) {
                *sum += wx * wy * value;
            }
        }
    }
    let [red, green, blue, alpha] = sum.map(|value| value.max(0.0));
    [red, green, blue, alpha.min(1.0)]
}

/// Weights of four samples around a place `t` past the second (a = -1/2).
fn keys(t: f64) -> [f32; 4] {
    let t = t as f32;
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}
