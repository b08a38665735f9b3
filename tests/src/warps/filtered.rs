//! Analytic scenes as a camera with a Gaussian pixel filter sees them, and a plain warper to compare with.
//!
//! Pictures are made of 16 rays a pixel, weighted by the pixel's Gaussian over its neighbours too, so that edges are mixed
//! pixels as in photographs; depth is that of the ray through the centre. The warper is the strongest simple one:
//! depth forward, cracks closed from the neighbours, colour by a backward cubic lookup.
//!
//! What is seen of a pixel is the share of the same rays, with the same weights, that the reference sees.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image};
use warp3d::Reference;

use crate::warps::scenes::{AnalyticScene, Body, camera};
use crate::warps::truth::{Truth, WarpScene};

/// Rays along a pixel's side.
const RAYS: usize = 4;

/// Sigma of the pixel's Gaussian, px.
const SIGMA_PX: f64 = 0.5;

/// Size and focal length of a view, px, where it stands, and how far it is turned.
type View = ([u32; 2], f64, DVec3, f64);

/// `scene` from `from`, with the true view of `to`.
pub fn filtered_scene(name: &str, scene: &AnalyticScene, from: &Camera, to: &Camera) -> WarpScene {
    let reference = Reference {
        colour: filtered(scene, from),
        ..scene.reference(from)
    };
    let mut truth: Truth = scene.truth(to, from);
    for (pixel, [r, g, b]) in truth.image.rgba.iter_mut().zip(filtered(scene, to)) {
        *pixel = [r, g, b, 1.0];
    }
    truth.seen = gathered(
        to,
        &scene
            .seen(&finer(to), from)
            .iter()
            .map(|&s| [s; 3])
            .collect::<Vec<_>>(),
    )
    .iter()
    .map(|share| share[0])
    .collect();
    WarpScene {
        name: name.into(),
        reference,
        target: *to,
        truth,
    }
}

/// The colours of `scene` from `camera`, filtered.
pub fn filtered(scene: &AnalyticScene, camera: &Camera) -> Vec<[f32; 3]> {
    gathered(camera, &scene.reference(&finer(camera)).colour)
}

/// The same view with [`RAYS`] times as many pixels along each side.
fn finer(camera: &Camera) -> Camera {
    Camera {
        width: camera.width * RAYS as u32,
        height: camera.height * RAYS as u32,
        fx: camera.fx * RAYS as f64,
        fy: camera.fy * RAYS as f64,
        cx: camera.cx * RAYS as f64,
        cy: camera.cy * RAYS as f64,
        ..*camera
    }
}

/// The pixels of `camera` from what its finer view holds, by the pixel's Gaussian.
fn gathered(camera: &Camera, rays: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let [width, height] = [camera.width as usize, camera.height as usize];
    let weights: Vec<f32> = (0..3 * RAYS)
        .map(|i| {
            let offset = (i as f64 + 0.5) / RAYS as f64 - 1.5;
            (-0.5 * (offset / SIGMA_PX).powi(2)).exp() as f32
        })
        .collect();
    let pixel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let mut sum = [0.0f32; 4];
        for (j, wy) in weights.iter().enumerate() {
            for (k, wx) in weights.iter().enumerate() {
                let (u, v) = (
                    (x * RAYS + k).wrapping_sub(RAYS),
                    (y * RAYS + j).wrapping_sub(RAYS),
                );
                if u < width * RAYS && v < height * RAYS {
                    let [r, g, b] = rays[v * width * RAYS + u];
                    for (s, value) in sum.iter_mut().zip([r, g, b, 1.0]) {
                        *s += wx * wy * value;
                    }
                }
            }
        }
        [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]]
    };
    (0..width * height).into_par_iter().map(pixel).collect()
}

/// Scenes of the kinds on which warpers are compared, none of which any setting was chosen on.
pub fn fresh_scenes() -> Vec<WarpScene> {
    let vga = [320, 240];
    let start: View = (vga, 260.0, DVec3::ZERO, 0.0);
    let angle = 50f64.to_radians();
    let aside = DVec3::new(-5.0 * angle.sin(), 0.0, 5.0 - 5.0 * angle.cos());
    let fine: View = ([800, 600], 650.0, DVec3::ZERO, 0.0);
    let coarse: View = ([80, 60], 65.0, DVec3::ZERO, 0.0);
    let room = AnalyticScene::room;
    let scenes: [(&str, AnalyticScene, View, View); 9] = [
        ("stereo", room(), start, (vga, 260.0, DVec3::X * 0.2, 0.0)),
        (
            "6dof",
            room(),
            start,
            (vga, 250.0, DVec3::new(0.25, -0.1, 0.4), 0.08),
        ),
        ("thin", thin(), start, (vga, 260.0, DVec3::X * 0.15, 0.0)),
        (
            "ground",
            AnalyticScene::wall(1.2),
            start,
            (vga, 260.0, DVec3::new(0.1, 0.05, 0.0), 0.0),
        ),
        (
            "rot50",
            AnalyticScene::wall(0.0),
            start,
            (vga, 260.0, aside, -angle),
        ),
        ("min2.5", room(), fine, (vga, 260.0, DVec3::X * 0.2, 0.0)),
        ("mag4", room(), coarse, (vga, 260.0, DVec3::X * 0.1, 0.0)),
        ("mag8", room(), coarse, (vga, 520.0, DVec3::X * 0.1, 0.0)),
        (
            "hd",
            room(),
            ([960, 540], 700.0, DVec3::ZERO, 0.0),
            ([960, 540], 700.0, DVec3::X * 0.2, 0.0),
        ),
    ];
    let of = |(size, focal_px, eye, yaw): View| camera(size, focal_px, eye, yaw);
    scenes
        .iter()
        .map(|(name, scene, from, to)| filtered_scene(name, scene, &of(*from), &of(*to)))
        .collect()
}

/// Poles of one to three pixels before a wall.
fn thin() -> AnalyticScene {
    let wall = Body::Card(DVec3::Z * 8.0, DVec3::X * 12.0, DVec3::Y * 9.0);
    let mut bodies = vec![(wall, 1.5, [0.8, 0.7, 0.6])];
    for i in 0..8 {
        let x = -1.9 + 0.55 * f64::from(i);
        let half = 0.008 * f64::from(i % 4 + 1);
        let pole = Body::Card(DVec3::new(x, 0.0, 4.0), DVec3::X * half, DVec3::Y * 3.0);
        bodies.push((pole, 0.9, [0.2, 0.3 + 0.08 * f64::from(i), 0.9]));
    }
    AnalyticScene(bodies)
}

/// Depth forward, nearest sample wins; colour backward by the cubic of Keys.
pub fn forward_backward(reference: &Reference, target: &Camera) -> Image {
    let [width, height] = [target.width as usize, target.height as usize];
    let mut depth = vec![f32::INFINITY; width * height];
    let from = &reference.camera;
    let to_world = from.camera_from_world.inverse();
    for (i, &z) in reference
        .depth
        .iter()
        .enumerate()
        .filter(|(_, z)| **z > 0.0)
    {
        let at = DVec2::new(
            (i % from.width as usize) as f64 + 0.5,
            (i / from.width as usize) as f64 + 0.5,
        );
        let in_world = to_world.transform_point3(f64::from(z) * from.ray_in_camera(at).1);
        let in_target = target.camera_from_world.transform_point3(in_world);
        let screen = target.screen_from_camera(in_target);
        if in_target.z > 0.0 && screen.cmpge(DVec2::ZERO).all() {
            let (x, y) = (screen.x as usize, screen.y as usize);
            if x < width && y < height {
                let slot = &mut depth[y * width + x];
                *slot = slot.min(in_target.z as f32);
            }
        }
    }
    let closed: Vec<f32> = (0..depth.len())
        .map(|i| closed(&depth, [width, height], i))
        .collect();
    let mut image = Image::transparent(width, height);
    for (i, &z) in closed.iter().enumerate().filter(|(_, z)| z.is_finite()) {
        let pixel = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let in_target = f64::from(z) * target.ray_in_camera(pixel).1;
        let in_world = target
            .camera_from_world
            .inverse()
            .transform_point3(in_target);
        let at = from.screen_from_camera(from.camera_from_world.transform_point3(in_world));
        let [r, g, b] = keys(reference, at);
        image.rgba[i] = [r, g, b, 1.0];
    }
    image.depth = Some(closed);
    image
}

/// The depth of a pixel, or the nearest one around it where there are five of eight.
fn closed(depth: &[f32], [width, height]: [usize; 2], i: usize) -> f32 {
    if depth[i].is_finite() {
        return depth[i];
    }
    let (x, y) = (i % width, i / width);
    let around = (0..9)
        .filter(|k| *k != 4)
        .map(|k| ((x + k % 3).wrapping_sub(1), (y + k / 3).wrapping_sub(1)));
    let known: Vec<f32> = around
        .filter(|&(u, v)| u < width && v < height)
        .map(|(u, v)| depth[v * width + u])
        .filter(|z| z.is_finite())
        .collect();
    if known.len() >= 5 {
        known.iter().copied().fold(f32::INFINITY, f32::min)
    } else {
        f32::INFINITY
    }
}

fn keys(reference: &Reference, at: DVec2) -> [f32; 3] {
    let size = [reference.camera.width, reference.camera.height].map(i64::from);
    let corner = at - 0.5;
    let base = corner.floor();
    let weights = |t: f64| {
        let (t2, t3) = (t * t, t * t * t);
        [
            0.5 * (-t3 + 2.0 * t2 - t),
            0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
            0.5 * (-3.0 * t3 + 4.0 * t2 + t),
            0.5 * (t3 - t2),
        ]
    };
    let (wx, wy) = (weights(corner.x - base.x), weights(corner.y - base.y));
    let mut sum = [0.0; 3];
    for (j, wy) in wy.iter().enumerate() {
        for (i, wx) in wx.iter().enumerate() {
            let x = (base.x as i64 + i as i64 - 1).clamp(0, size[0] - 1);
            let y = (base.y as i64 + j as i64 - 1).clamp(0, size[1] - 1);
            let sample = reference.colour[(y * size[0] + x) as usize];
            for (s, value) in sum.iter_mut().zip(sample) {
                *s += (wx * wy) as f32 * value;
            }
        }
    }
    [sum[0].max(0.0), sum[1].max(0.0), sum[2].max(0.0)]
}
