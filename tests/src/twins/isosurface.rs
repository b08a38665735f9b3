//! The reference for a surface of one scalar: each ray followed in small steps through the trilinear field, in f64.
//!
//! Takes a scene, gives per pixel colour, opacity and mean depth, lit from the camera by Lambert's cosine of the smooth gradient.
//! A ray's first crossing is found between steps a sixteenth of the renderer's, and by bisection to the last digit. Where
//! steps of the renderer's length may miss a crossing the pixel says so: that limit is admitted.
//! Limits: opaque surfaces; a headlight; a fixed number of sub-pixels.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use volsplat::{Blend, Subpixels};

use crate::choices::field;
use crate::twins::clip::keeps;
use crate::twins::rays::{Ray, RaySource};
use crate::twins::samples::Scene;
use crate::twins::trilinear::{SmoothGradients, last, scalar};

/// Ambient and diffuse share of the light, as the shading's documentation gives them.
const AMBIENT: f64 = 0.3;
const DIFFUSE: f64 = 0.7;

/// Reference steps in a step of the renderer.
const FINER: u32 = 16;

/// The value of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IsoPixel {
    /// Light on the surface, times coverage: the red, green or blue of a white surface.
    pub light: f64,
    /// Sub-pixels that see the surface, as a share.
    pub coverage: f64,
    /// Mean camera z of the hits; NaN where there is none.
    pub depth: f64,
    /// Sub-pixels, as a share, of which a step of the renderer's length may miss what is seen.
    pub doubtful: f64,
}

/// Renders a picture, row by row.
///
/// # Panics
/// Where the options ask for automatic sub-pixels or for another blend mode.
pub fn render(scene: &Scene) -> Vec<IsoPixel> {
    let Subpixels::Fixed(n) = scene.options.subpixels else {
        panic!("the reference wants a fixed number of sub-pixels");
    };
    let rays = RaySource::new(scene.camera, &scene.volume.world_from_index);
    let light = -scene.camera.forward_in_world();
    let gradients = SmoothGradients::new(scene.volume);
    let width = scene.camera.width as usize;
    let pixel = |i: usize| {
        let mut sum = IsoPixel::default();
        let share = 1.0 / f64::from(n * n);
        for part in 0..n * n {
            let inside =
                DVec2::new(f64::from(part % n) + 0.5, f64::from(part / n) + 0.5) / f64::from(n);
            let ray = rays.ray(DVec2::new((i % width) as f64, (i / width) as f64) + inside);
            let (hit, is_doubtful) = first_hit(scene, &ray);
            sum.doubtful += if is_doubtful { share } else { 0.0 };
            if let Some(z) = hit {
                let end = last(scene.volume);
                let normal = gradients.at((ray.origin + z * ray.direction).clamp(DVec3::ZERO, end));
                sum.light +=
                    share * (AMBIENT + DIFFUSE * normal.normalize_or_zero().dot(light).abs());
                sum.coverage += share;
                sum.depth += share * z;
            }
        }
        IsoPixel {
            depth: sum.depth / sum.coverage,
            ..sum
        }
    };
    (0..width * scene.camera.height as usize)
        .into_par_iter()
        .map(pixel)
        .collect()
}

/// Camera z of the first crossing, and whether there are two within a step of the renderer, or one next to a face.
fn first_hit(scene: &Scene, ray: &Ray) -> (Option<f64>, bool) {
    let Blend::Isosurface(iso) = field(scene.options).blend else {
        panic!("the reference knows surfaces only")
    };
    let smallest = DVec3::from(scene.volume.spacing()).min_element();
    let step = field(scene.options).slab_voxels * smallest / f64::from(FINER);
    let end = last(scene.volume);
    let far = (ray.origin.length() + end.length() + 1.0) / ray.direction.length();
    let start = scene.camera.near.max(-far);
    let value = |z: f64| {
        let at = ray.origin + z * ray.direction;
        let inside = at.cmpge(DVec3::ZERO).all() && at.cmple(end).all() && keeps(scene, at, 0.0);
        inside.then(|| scalar(scene.volume, at) - iso.value)
    };
    let count = ((far - start) / step) as u64;
    let samples: Vec<Option<f64>> = (0..count).map(|i| value(start + i as f64 * step)).collect();
    let crosses = |i: usize| match (samples[i], samples[i + 1]) {
        (Some(a), Some(b)) => (a >= 0.0) != (b >= 0.0),
        _ => false,
    };
    let crossings: Vec<usize> = (0..samples.len().saturating_sub(1))
        .filter(|&i| crosses(i))
        .collect();
    let near_a_face = |i: usize| {
        let from = i.saturating_sub(1);
        samples[from..(i + 3).min(samples.len())]
            .iter()
            .any(Option::is_none)
    };
    // A surface that a ray grazes between two reference steps: both are within a step's change of it.
    let grazes = samples.windows(3).any(|w| match (w[0], w[1], w[2]) {
        (Some(a), Some(b), Some(c)) => {
            b.abs() < 2.0 * (a - b).abs().max((c - b).abs()) && (a - b) * (c - b) > 0.0
        }
        _ => false,
    });
    let at_a_face = samples.windows(2).any(|w| match (w[0], w[1]) {
        (None, Some(v)) | (Some(v), None) => v.abs() < 0.05,
        _ => false,
    });
    let double = crossings
        .windows(2)
        .any(|pair| pair[1] - pair[0] <= FINER as usize);
    let hit = crossings
        .first()
        .map(|&i| bisect(start + i as f64 * step, step, &value));
    (
        hit,
        double || grazes || at_a_face || crossings.first().is_some_and(|&i| near_a_face(i)),
    )
}

fn bisect(near: f64, step: f64, value: &dyn Fn(f64) -> Option<f64>) -> f64 {
    let (mut near, mut far) = (near, near + step);
    let above = value(near).is_some_and(|v| v >= 0.0);
    for _ in 0..50 {
        let middle = 0.5 * (near + far);
        if value(middle).is_some_and(|v| v >= 0.0) == above {
            near = middle;
        } else {
            far = middle;
        }
    }
    0.5 * (near + far)
}
