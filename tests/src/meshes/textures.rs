//! The picture of a textured scene by brute force: many f64 rays a pixel, each against every triangle.
//!
//! A pixel is the Gaussian mean (sigma 0.5 px, over five by five pixels) of what rays on a fine grid see: the nearest triangle's
//! texture, reconstructed bilinearly in linear light, times the material's colour. Shares no formula with the
//! renderer: rays meet triangles by Cramer's rule in camera space.
//!
//! Limits: unlit, opaque, base texture only; no near plane; time is pixels times rays times the triangles
//! whose rectangle holds the pixel.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::image::linear_from_srgb;
use resample_core::{Camera, Image, Projection};
use texmap::Scene;
use texmap::scene::{Magnify, Texels, Texture, TextureUse, Wrap};

/// A triangle before the camera, with its texture coordinates in texels.
struct Target<'a> {
    corners: [DVec3; 3],
    /// The part of the screen that it may cover, px: the least and the greatest corner.
    bounds_px: [DVec2; 2],
    uv: [DVec2; 3],
    texture: Option<(&'a Texture, TextureUse)>,
    colour: [f64; 3],
}

/// Pixels along a side of the window that the Gaussian reaches.
const WINDOW: usize = 5;

/// The contributions of one pixel's rays to each pixel of the window around it: red, green, blue, coverage, weight.
type Shares = [[f64; 5]; WINDOW * WINDOW];

/// The picture of `scene` from `camera` with `per_px` x `per_px` rays a pixel.
pub fn reference_picture(scene: &Scene, camera: &Camera, per_px: usize) -> Image {
    let targets = targets(scene, camera);
    let (width, height) = (camera.width as usize, camera.height as usize);
    // Pixels around the picture count too.
    let border = WINDOW / 2;
    let columns = width + 2 * border;
    let cells: Vec<Shares> = (0..columns * (height + 2 * border))
        .into_par_iter()
        .map(|cell| {
            let at = |index: usize| index as f64 - border as f64;
            shares(
                &targets,
                camera,
                DVec2::new(at(cell % columns), at(cell / columns)),
                per_px,
            )
        })
        .collect();
    let mut image = Image::transparent(width, height);
    image
        .rgba
        .par_iter_mut()
        .enumerate()
        .for_each(|(index, pixel)| {
            let mut sum = [0.0; 5];
            for k in 0..WINDOW * WINDOW {
                let cell = (index / width + k / WINDOW) * columns + index % width + k % WINDOW;
                // The cell's window has this pixel on the other side.
                (0..5).for_each(|channel| {
                    sum[channel] += cells[cell][WINDOW * WINDOW - 1 - k][channel]
                });
            }
            *pixel = [0, 1, 2, 3].map(|channel| (sum[channel] / sum[4]) as f32);
        });
    image
}

/// The rays of the pixel whose corner is at `corner`.
fn shares(targets: &[Target], camera: &Camera, corner: DVec2, per_px: usize) -> Shares {
    let near: Vec<&Target> = targets
        .iter()
        .filter(|t| t.bounds_px[0].cmple(corner + 1.0).all() && t.bounds_px[1].cmpge(corner).all())
        .collect();
    let step = 1.0 / per_px as f64;
    let mut shares = [[0.0; 5]; WINDOW * WINDOW];
    for ray in 0..per_px * per_px {
        let offset = DVec2::new((ray % per_px) as f64 + 0.5, (ray / per_px) as f64 + 0.5) * step;
        let colour = seen(&near, camera, corner + offset);
        for (k, share) in shares.iter_mut().enumerate() {
            let middle =
                DVec2::new((k % WINDOW) as f64, (k / WINDOW) as f64) - (WINDOW / 2) as f64 + 0.5;
            let weight = (-2.0 * (offset - middle).length_squared()).exp();
            if let Some(colour) = colour {
                (0..3).for_each(|channel| share[channel] += weight * colour[channel]);
                share[3] += weight;
            }
            share[4] += weight;
        }
    }
    shares
}

/// The colour of the nearest triangle on the ray through a screen position.
fn seen(targets: &[&Target], camera: &Camera, pos_in_screen: DVec2) -> Option<[f64; 3]> {
    let (origin, direction) = camera.ray_in_camera(pos_in_screen);
    let mut nearest: Option<(f64, &Target, DVec3)> = None;
    for &target in targets {
        let [a, b, c] = target.corners;
        // origin + t direction = a + p (b - a) + q (c - a)
        let matrix = DMat3::from_cols(-direction, b - a, c - a);
        if matrix.determinant() == 0.0 {
            continue;
        }
        let hit = matrix.inverse() * (origin - a);
        let (t, p, q) = (hit.x, hit.y, hit.z);
        let inside = p >= 0.0 && q >= 0.0 && p + q <= 1.0 && t > 0.0;
        if inside && nearest.as_ref().is_none_or(|(before, ..)| t < *before) {
            nearest = Some((t, target, DVec3::new(1.0 - p - q, p, q)));
        }
    }
    let (_, target, share) = nearest?;
    let texel = target
        .texture
        .as_ref()
        .map_or([1.0; 3], |(texture, texture_use)| {
            let uv = target.uv[0] * share.x + target.uv[1] * share.y + target.uv[2] * share.z;
            reconstructed(texture, texture_use, uv)
        });
    Some([0, 1, 2].map(|k| texel[k] * target.colour[k]))
}

fn targets<'a>(scene: &'a Scene, camera: &Camera) -> Vec<Target<'a>> {
    let mut targets = Vec::new();
    for mesh in &scene.meshes {
        let material = &scene.materials[mesh.material];
        let texture = material
            .base_texture
            .map(|t| (&scene.textures[t.texture], t));
        for triangle in &mesh.triangles {
            let corners = triangle.map(|i| {
                let position = DVec3::from(mesh.positions[i as usize].map(f64::from));
                camera.camera_from_world.transform_point3(position)
            });
            let uv = triangle.map(|i| {
                let Some((picture, texture_use)) = &texture else {
                    return DVec2::ZERO;
                };
                let uv = DVec2::from(mesh.uvs[texture_use.uv_set][i as usize].map(f64::from));
                let size = DVec2::new(picture.width as f64, picture.height as f64);
                (texture_use.uv_linear * uv + texture_use.uv_offset) * size
            });
            let [r, g, b, _] = material.base_colour.map(f64::from);
            targets.push(Target {
                corners,
                bounds_px: bounds_px(camera, &corners),
                uv,
                texture,
                colour: [r, g, b],
            });
        }
    }
    targets
}

/// The rectangle around the corners' places; everything if one of them is not before the eye.
fn bounds_px(camera: &Camera, corners: &[DVec3; 3]) -> [DVec2; 2] {
    if camera.projection == Projection::Perspective && corners.iter().any(|corner| corner.z <= 0.0)
    {
        return [DVec2::NEG_INFINITY, DVec2::INFINITY];
    }
    let w = |corner: &DVec3| {
        if camera.projection == Projection::Perspective {
            corner.z
        } else {
            1.0
        }
    };
    let places = corners.map(|corner| {
        DVec2::new(camera.fx * corner.x, camera.fy * corner.y) / w(&corner)
            + DVec2::new(camera.cx, camera.cy)
    });
    [
        places[0].min(places[1]).min(places[2]),
        places[0].max(places[1]).max(places[2]),
    ]
}

/// The texture's own reconstruction at `uv` (texels).
fn reconstructed(texture: &Texture, texture_use: &TextureUse, uv: DVec2) -> [f64; 3] {
    let texel = |i: f64, j: f64| {
        let column = wrapped(i, texture.width, texture_use.wrap[0]);
        let row = wrapped(j, texture.height, texture_use.wrap[1]);
        linear(texture, row * texture.width + column)
    };
    if texture_use.magnify == Magnify::Nearest {
        return texel(uv.x.floor(), uv.y.floor());
    }
    let at = uv - DVec2::splat(0.5);
    let (first, share) = (at.floor(), at - at.floor());
    let mut sum = [0.0; 3];
    for (di, dj) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let weight = (1.0 - (share.x - di).abs()) * (1.0 - (share.y - dj).abs());
        let value = texel(first.x + di, first.y + dj);
        (0..3).for_each(|k| sum[k] += weight * value[k]);
    }
    sum
}

fn wrapped(index: f64, count: usize, wrap: Wrap) -> usize {
    let n = count as f64;
    let folded = match wrap {
        Wrap::Repeat => index.rem_euclid(n),
        Wrap::Clamp => index.clamp(0.0, n - 1.0),
        Wrap::Mirror => {
            let twice = index.rem_euclid(2.0 * n);
            twice.min(2.0 * n - 1.0 - twice)
        }
    };
    folded as usize
}

fn linear(texture: &Texture, index: usize) -> [f64; 3] {
    match &texture.texels {
        Texels::LinearF32(texels) => [0, 1, 2].map(|k| f64::from(texels[index][k])),
        Texels::Srgb8(texels) => {
            [0, 1, 2].map(|k| f64::from(linear_from_srgb(f32::from(texels[index][k]) / 255.0)))
        }
    }
}
