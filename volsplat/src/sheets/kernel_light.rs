//! Gradients of voxels for sums of kernels, and the light on voxels that are classified by themselves.
//!
//! A voxel's gradient is laid down with the same weights as its scalar, so that its sum, over that of the weights, is the
//! gradient at the pixel. It is a difference of fourth order over five voxels. On fields with a formula that was nearer than
//! the usual difference over three voxels for every kernel, and than the kernel's own derivative for all but the wide kernels
//! at the limit of what the voxels can carry (see the accuracy ladder); and it serves points too, which have no derivative.
//! Where kernels interpolate, the differences are those of the coefficients.
//! Beyond the volume its outermost voxels go on: across its faces the gradient is half of the one inside.

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, f32x8};
use fearless_simd_macros::simd;
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::Projection;

use super::frame::SheetSettings;
use crate::field::Grid;
use crate::sample::{Brick, Samples, place};

const LANES: usize = 8;

/// The gradients, in the world, at the samples of each brick. `grid` holds what the kernels are multiplied with.
pub(super) fn gradients<T: Copy + Into<f64> + Sync>(
    samples: &Samples,
    grid: &Grid<T>,
    world_from_index: &DMat3,
) -> Vec<Vec<[f32; 3]>> {
    // Gradients are covectors: they go to the world by the inverse transpose.
    let world_from_gradient = world_from_index.inverse().transpose();
    let [_, shift] = samples.index_from_voxel;
    let of_brick = |brick: &Brick| -> Vec<[f32; 3]> {
        let at = |&packed: &u16| {
            let place = place(packed);
            let voxel =
                [0, 1, 2].map(|axis| f64::from(brick.bounds.corner[axis]) + f64::from(place[axis]) - shift);
            (world_from_gradient * gradient_at(grid, voxel)).as_vec3().to_array()
        };
        brick.places.iter().map(at).collect()
    };
    samples.bricks.par_iter().map(of_brick).collect()
}

/// The gradient at a voxel, or in the middle of a cell, where it is the mean of those at the corners; per voxel.
fn gradient_at<T: Copy + Into<f64>>(grid: &Grid<T>, voxel: [f64; 3]) -> DVec3 {
    let first = voxel.map(f64::floor);
    let is_voxel = first == voxel;
    let corners = if is_voxel { 1 } else { 8 };
    let sum: DVec3 = (0..corners)
        .map(|i| {
            let corner = [0, 1, 2].map(|axis| {
                // What lies beyond the volume has the gradient of the nearest voxel.
                (first[axis] as isize + (i >> axis & 1)).clamp(0, grid.dims[axis] as isize - 1)
            });
            difference(grid, corner)
        })
        .sum();
    sum / corners as f64
}

/// The difference of fourth order at a voxel.
fn difference<T: Copy + Into<f64>>(grid: &Grid<T>, voxel: [isize; 3]) -> DVec3 {
    DVec3::from([0, 1, 2].map(|axis| {
        let at = |offset: isize| {
            let mut place = voxel;
            place[axis] += offset;
            grid.stored(place)
        };
        (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / 12.0
    }))
}

/// Where the samples of a brick lie in camera space: its first, and the movement along each axis.
#[derive(Clone, Copy)]
pub(super) struct BrickInCamera {
    pub(super) first: DVec3,
    pub(super) axes: [Vec3; 3],
    pub(super) projection: Projection,
}

/// The colours and strengths of a brick's samples as light and the ramp over the gradient leave them.
pub(super) fn lit_values(
    settings: &SheetSettings,
    brick: &Brick,
    gradients: &[[f32; 3]],
    in_camera: &BrickInCamera,
) -> Vec<[f32; 4]> {
    let mut values = brick.values.clone();
    let parts = values.chunks_mut(LANES).zip(brick.places.chunks(LANES)).zip(gradients.chunks(LANES));
    for ((values, places), gradients) in parts {
        let rays = places.iter().map(|&packed| in_camera.ray(settings, packed));
        let mut lanes = [[0.0; LANES]; 6];
        for (lane, (gradient, ray)) in gradients.iter().zip(rays).enumerate() {
            for (k, value) in gradient.iter().chain(&ray).enumerate() {
                lanes[k][lane] = *value;
            }
        }
        let [factors, bodies, highlights] =
            dispatch!(settings.level, simd => light_lanes(simd, settings, &lanes));
        for (lane, value) in values.iter_mut().enumerate() {
            for channel in &mut value[..3] {
                *channel = *channel * bodies[lane] + highlights[lane];
            }
            value[3] *= factors[lane];
        }
    }
    values
}

/// For gradients and unit rays: the factor of the strength, that of the colour, and the highlight.
#[simd]
fn light_lanes<S: Simd>(simd: S, settings: &SheetSettings, lanes: &[[f32; LANES]; 6]) -> [[f32; LANES]; 3] {
    let load = |k: usize| f32x8::from_slice(simd, &lanes[k]);
    let gradient = [load(0), load(1), load(2)];
    let one = f32x8::splat(simd, 1.0);
    let factor = settings.gradient_ramp.map_or(one, |ramp| ramp.factor(simd, gradient));
    match &settings.shade {
        None => [factor.to_array(), one.to_array(), [0.0; LANES]],
        Some(shade) => {
            let lit = shade.light(simd, gradient, [load(3), load(4), load(5)]);
            [factor.to_array(), lit.body.to_array(), lit.highlight.to_array()]
        }
    }
}

impl BrickInCamera {
    /// The unit direction, in the world, of the ray to a sample.
    fn ray(&self, settings: &SheetSettings, packed: u16) -> [f32; 3] {
        let direction = match self.projection {
            Projection::Orthographic => DVec3::Z,
            Projection::Perspective => {
                let at = Vec3::from(place(packed).map(f32::from));
                let [x, y, z] = self.axes;
                (self.first + (at.x * x + at.y * y + at.z * z).as_dvec3()).normalize_or_zero()
            }
        };
        (settings.world_from_camera * direction).as_vec3().to_array()
    }
}
