//! All directions in one picture, drawn as the six faces of a cube.
//!
//! Each face is a little larger than its quarter; the panorama is resampled from them by the cubic of Keys (1981). Its
//! depth is the distance from the eye, because camera z has no meaning behind a camera.

use glam::DVec2;
use rayon::prelude::*;
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
    let focal_px = panorama::focal_px(size);
    gathered(views, size, |pos| {
        let (face, on_plane) = panorama::face_of(panorama::direction(pos, size));
        Some((
            face,
            on_plane * focal_px + 0.5 * views[face].width as f64,
            on_plane,
        ))
    })
}

/// A picture of directions. `place` gives the view that shows a position, the position in it, and the direction on its plane at distance 1; `None` where no view shows it.
pub(super) fn gathered(
    views: &[Image],
    [width, height]: [u32; 2],
    place: impl Fn(DVec2) -> Option<(usize, DVec2, DVec2)> + Sync,
) -> Image {
    let (width, height) = (width as usize, height as usize);
    let mut whole = Image::transparent(width, height);
    let mut nearest = vec![None; width * height];
    let rows = whole.rgba.par_chunks_mut(width);
    let rows = rows.zip(nearest.par_chunks_mut(width)).enumerate();
    rows.for_each(|(y, (pixels, nearest))| {
        for (x, (pixel, nearest)) in pixels.iter_mut().zip(nearest).enumerate() {
            let Some((view, at, on_plane)) = place(DVec2::new(x as f64, y as f64) + 0.5) else {
                continue;
            };
            *pixel = cubic(&views[view], at);
            *nearest = Some(Nearest {
                view,
                index: at.y as usize * views[view].width + at.x as usize,
                ray_length: on_plane.extend(1.0).length() as f32,
            });
        }
    });
    let of = |values: &(dyn Fn(&Nearest) -> f32 + Sync), none: f32| {
        let value = |sample: &Option<Nearest>| sample.as_ref().map_or(none, values);
        nearest.par_iter().map(value).collect()
    };
    let distance = |sample: &Nearest| {
        let z = views[sample.view].depth.as_ref();
        z.map_or(f32::INFINITY, |z| z[sample.index] * sample.ray_length)
    };
    let plane = |(number, plane): (usize, &Plane)| Plane {
        name: plane.name.clone(),
        values: of(
            &|sample| views[sample.view].planes[number].values[sample.index],
            0.0,
        ),
    };
    whole.planes = views[0].planes.iter().enumerate().map(plane).collect();
    whole.depth = (views[0].depth.as_ref()).map(|_| of(&distance, f32::INFINITY));
    whole
}

/// The pixel of a view that is nearest to a pixel of the panorama.
#[derive(Clone, Copy)]
struct Nearest {
    view: usize,
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
