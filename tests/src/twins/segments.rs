//! The reference for transfer functions with narrow peaks: rays from cell to cell, in f64 and by definition.
//!
//! A ray is cut at the faces of all cells of the volume, and between them into equal segments. At the ends of a segment
//! the trilinear scalar is read; between them it is taken to change linearly, so that the segment's extinction is the
//! mean of the transfer function over that range of scalars, and its colour the mean weighted by extinction. Both come
//! from Simpson's rule between the knots, for each segment anew: there is no table. Segments are composited front to back.
//! Limits: one sub-pixel a pixel, no light, no clip; opacity by extinction per smallest spacing.

use glam::DVec3;
use rayon::prelude::*;
use volsplat::TransferFunction;

use crate::choices::field;
use crate::twins::field::{extinction, simpson};
use crate::twins::rays::{Ray, RaySource};
use crate::twins::samples::Scene;
use crate::twins::trilinear::{last, scalar};

/// Differences of scalars, as parts of their size, below which the transfer function does not change.
const SAME: f64 = 1e-9;

/// Renders a picture, row by row: premultiplied linear red, green, blue, and opacity.
pub fn render(scene: &Scene) -> Vec<[f64; 4]> {
    let rays = RaySource::new(scene.camera, &scene.volume.world_from_index);
    let count = (1.0 / field(scene.options).slab_voxels).ceil().max(1.0) as usize;
    let spacing = DVec3::from(scene.volume.spacing()).min_element();
    let width = scene.camera.width as usize;
    (0..width * scene.camera.height as usize)
        .into_par_iter()
        .map(|i| {
            let ray = rays.pixel(i % width, i / width);
            let (mut sum, mut left) = ([0.0; 4], 1.0);
            for ends in segments(&ray, scene, count) {
                let scalars = ends.map(|z| {
                    let at = ray.origin + z * ray.direction;
                    scalar(scene.volume, at.clamp(DVec3::ZERO, last(scene.volume)))
                });
                let [r, g, b, strength] = mean(scene.transfer, scalars);
                if !(strength > 0.0) {
                    continue;
                }
                let units = (ends[1] - ends[0]) * ray.world_per_z / spacing;
                let weight = left * -(-strength * units).exp_m1();
                left -= weight;
                for (sum, c) in sum.iter_mut().zip([r, g, b]) {
                    *sum += weight * c / strength;
                }
            }
            sum[3] = 1.0 - left;
            sum
        })
        .collect()
}

/// The ends of all segments of a ray, front to back.
fn segments(ray: &Ray, scene: &Scene, count: usize) -> Vec<[f64; 2]> {
    let dims = scene.volume.dims;
    let (mut first, mut last) = (scene.camera.near, f64::INFINITY);
    let mut faces = Vec::new();
    for (axis, &size) in dims.iter().enumerate() {
        let at = |face: usize| (face as f64 - ray.origin[axis]) / ray.direction[axis];
        let ends = [at(0), at(size - 1)];
        first = first.max(ends[0].min(ends[1]));
        last = last.min(ends[0].max(ends[1]));
        faces.extend((0..size).map(at));
    }
    faces.retain(|z| *z > first && *z < last);
    faces.extend([first, last]);
    faces.sort_by(f64::total_cmp);
    let inside = |pair: &[f64]| {
        let [near, far] = [pair[0], pair[1]];
        let at = move |k: usize| near + (far - near) * k as f64 / count as f64;
        (0..count)
            .map(move |k| [at(k), at(k + 1)])
            .collect::<Vec<_>>()
    };
    if first < last {
        faces.windows(2).flat_map(inside).collect()
    } else {
        Vec::new()
    }
}

/// The means of extinction times red, green and blue, and of extinction, over the scalars between two.
pub fn mean(transfer: &TransferFunction, scalars: [f64; 2]) -> [f64; 4] {
    let [low, high] = [scalars[0].min(scalars[1]), scalars[0].max(scalars[1])];
    let at = |value: f64, channel: usize| {
        let (rgb, opacity) = transfer.sample(value);
        let strength = extinction(opacity);
        if channel < 3 {
            f64::from(rgb[channel]) * strength
        } else {
            strength
        }
    };
    if high - low <= SAME * high.abs().max(low.abs()) {
        return [0, 1, 2, 3].map(|channel| at(low, channel));
    }
    let colours = transfer.colour_knots().iter().map(|knot| knot.value);
    let opacities = transfer.opacity_knots().iter().map(|knot| knot.value);
    let mut knots: Vec<f64> = colours
        .chain(opacities)
        .filter(|v| *v > low && *v < high)
        .collect();
    knots.extend([low, high]);
    knots.sort_by(f64::total_cmp);
    [0, 1, 2, 3].map(|channel| {
        let piece = |ends: &[f64]| simpson(ends[0], ends[1], 32, |value| at(value, channel));
        knots.windows(2).map(piece).sum::<f64>() / (high - low)
    })
}
