//! All directions in one picture, drawn as the six faces of a cube.
//!
//! Each face is a little larger than its quarter; the panorama is resampled from them by the cubic of Keys (1981). Its
//! depth is the distance from the eye, because camera z has no meaning behind a camera.

use glam::DVec2;
use resample_core::{Camera, Image, Plane};

use crate::view::keys::weights;
use crate::view::panorama;

/// Pixels of a face beyond its quarter on each side, for the outer samples of the cubic.
const MARGIN_PX: f64 = 2.0;

/// Width and height of a panorama, px: those that were asked for, or those of the camera's scale at its centre.
pub(crate) fn size(camera: &Camera, asked: Option<[u32; 2]>) -> [u32; 2] {
    asked.unwrap_or_else(|| {
        let half_turn = (std::f64::consts::PI * camera.fx).round() as u32;
        [2 * half_turn, half_turn]
    })
}

/// The cameras of the six faces of a panorama of the sheet's size, at the sheet's pose.
pub(crate) fn faces(sheet: &Camera) -> Vec<Camera> {
    let focal_px = panorama::focal_px([sheet.width, sheet.height]);
    panorama::faces(sheet.camera_from_world, sheet.near, focal_px, MARGIN_PX).to_vec()
}

/// The panorama of the pictures of its faces.
pub(crate) fn put_together(sheet: &Camera, views: &[Image]) -> Image {
    let size = [sheet.width, sheet.height];
    let (width, height) = (size[0] as usize, size[1] as usize);
    let focal_px = panorama::focal_px(size);
    let mut whole = Image::transparent(width, height);
    let mut nearest = Vec::with_capacity(width * height);
    for (index, pixel) in whole.rgba.iter_mut().enumerate() {
        let pos = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
        let (face, on_plane) = panorama::face_of(panorama::direction(pos, size));
        let view = &views[face];
        let at = on_plane * focal_px + 0.5 * view.width as f64;
        *pixel = cubic(view, at);
        nearest.push(Nearest {
            view,
            index: at.y as usize * view.width + at.x as usize,
            ray_length: on_plane.extend(1.0).length() as f32,
        });
    }
    let distance = |sample: &Nearest| {
        let z = sample.view.depth.as_ref();
        z.map_or(f32::INFINITY, |z| z[sample.index] * sample.ray_length)
    };
    let plane = |(number, plane): (usize, &Plane)| Plane {
        name: plane.name.clone(),
        values: (nearest.iter())
            .map(|sample| sample.view.planes[number].values[sample.index])
            .collect(),
    };
    whole.planes = views[0].planes.iter().enumerate().map(plane).collect();
    whole.depth = (views[0].depth.as_ref()).map(|_| nearest.iter().map(distance).collect());
    whole
}

/// The pixel of a face that is nearest to a pixel of the panorama.
struct Nearest<'a> {
    view: &'a Image,
    index: usize,
    /// Length of its ray from the eye to camera z = 1.
    ray_length: f32,
}

/// A picture at a place, by the cubic of Keys; colour stays within its alpha.
fn cubic(view: &Image, at: DVec2) -> [f32; 4] {
    let corner = at - 0.5;
    let base = corner.floor();
    let [wx, wy] = [corner.x - base.x, corner.y - base.y].map(weights);
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
