//! The reference for the greatest, the least and the mean scalar of a ray, in f64.
//!
//! Takes a scene, gives for each component of a pixel the least and the greatest that it may be: the statistic over the
//! samples that are surely inside and over those that may be, with the error of the renderer's table on both sides, and the
//! transfer function sampled between.
//! Limits: a fixed number of sub-pixels.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use volsplat::{Blend, Subpixels};

use crate::choices::field;
use crate::twins::clip::keeps;
use crate::twins::field::extinction;
use crate::twins::rays::{Ray, RaySource};
use crate::twins::samples::Scene;
use crate::twins::trilinear::{last, scalar};

/// Error of a position, voxels.
const POSITION_ERROR: f64 = 2e-5;

/// Places at which the transfer function is looked at between two scalars.
const PLACES: u32 = 32;

/// Least and greatest red, green, blue and opacity of a pixel.
pub type Interval = [[f64; 4]; 2];

/// Renders a picture, row by row.
///
/// # Panics
/// Where the options ask for automatic sub-pixels or for another blend mode.
pub fn render(scene: &Scene) -> Vec<Interval> {
    let Subpixels::Fixed(n) = scene.options.subpixels else {
        panic!("the reference wants a fixed number of sub-pixels");
    };
    let rays = RaySource::new(scene.camera, &scene.volume.world_from_index);
    let (width, height) = (scene.camera.width as usize, scene.camera.height as usize);
    let pixel = |i: usize| {
        let mut sum = [[0.0; 4]; 2];
        for part in 0..n * n {
            let inside =
                DVec2::new(f64::from(part % n) + 0.5, f64::from(part / n) + 0.5) / f64::from(n);
            let add = ray(
                scene,
                &rays.ray(DVec2::new((i % width) as f64, (i / width) as f64) + inside),
            );
            for (sum, add) in sum.iter_mut().flatten().zip(add.into_iter().flatten()) {
                *sum += add / f64::from(n * n);
            }
        }
        sum
    };
    (0..width * height).into_par_iter().map(pixel).collect()
}

fn ray(scene: &Scene, ray: &Ray) -> Interval {
    let (low, high) = scene.volume.value_range();
    let error = 0.5 * (high - low) / 4095.0
        + (3.0 * POSITION_ERROR + 4e-6) * (high - low)
        + 1e-6 * low.abs();
    let [sure, possible] =
        [-POSITION_ERROR, POSITION_ERROR].map(|wider| statistic(scene, ray, wider));
    let ends: Vec<f64> = sure.into_iter().chain(possible).collect();
    let from = ends.iter().fold(f64::INFINITY, |a, b| a.min(*b)) - error;
    let to = ends.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b)) + error;
    let mut interval = [[f64::INFINITY; 4], [f64::NEG_INFINITY; 4]];
    let mut take = |pixel: [f64; 4]| {
        for k in 0..4 {
            interval[0][k] = interval[0][k].min(pixel[k]);
            interval[1][k] = interval[1][k].max(pixel[k]);
        }
    };
    if sure.is_none() {
        take([0.0; 4]);
    }
    if possible.is_some() {
        for place in 0..=PLACES {
            let (rgb, opacity) = scene
                .transfer
                .sample(from + (to - from) * f64::from(place) / f64::from(PLACES));
            let opacity = -(-extinction(opacity)).exp_m1();
            let [r, g, b] = rgb.map(|c| opacity * f64::from(c));
            take([r, g, b, opacity]);
        }
    }
    interval
}

/// The statistic over the samples in the volume and the clip, both `wider` on all sides; `None` where there is none.
fn statistic(scene: &Scene, ray: &Ray, wider: f64) -> Option<f64> {
    let smallest = DVec3::from(scene.volume.spacing()).min_element();
    let thickness = field(scene.options).slab_voxels * smallest;
    let end = last(scene.volume);
    let far = (ray.origin.length() + end.length() + 1.0) / ray.direction.length();
    let first = (scene.camera.near.max(-far) / thickness - 0.5).ceil();
    let count = ((far / thickness) - first).max(0.0) as u64;
    let values: Vec<f64> = (0..count)
        .map(|i| ray.origin + (first + i as f64 + 0.5) * thickness * ray.direction)
        .filter(|at| {
            at.cmpge(DVec3::splat(-wider)).all()
                && at.cmple(end + wider).all()
                && keeps(scene, *at, wider)
        })
        .map(|at| scalar(scene.volume, at.clamp(DVec3::ZERO, end)))
        .collect();
    let folded = match field(scene.options).blend {
        Blend::Maximum => values.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b)),
        Blend::Minimum => values.iter().fold(f64::INFINITY, |a, b| a.min(*b)),
        Blend::Average => values.iter().sum::<f64>() / values.len() as f64,
        Blend::Emission | Blend::Isosurface(_) => panic!("the reference knows statistics only"),
    };
    (!values.is_empty()).then_some(folded)
}
