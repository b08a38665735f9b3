//! The gradient that light follows by default, in f64 and by definition.
//!
//! Takes a volume, gives the gradient at each voxel: half the difference of the voxels on both sides, in a field of means, each over all
//! voxels as a Gaussian weighs them. Along each axis its variance is a quarter of the greatest spacing's square less that of its own
//! spacing. It is cut off at 2.5 deviations, rounded up to a voxel; a deviation is at most 5 voxels, and 0 below 0.3. Beyond a
//! face the field is its own point reflection in the face; where nothing is blurred, the voxel at the face is repeated.

use glam::DVec3;
use rayon::prelude::*;
use volsplat::Volume;

use crate::twins::trilinear::{corners, difference, linear};

/// The gradients of a volume.
pub struct SmoothGradients<'a> {
    volume: &'a Volume,
    /// Along the axes of the grid, at each voxel.
    differences: Vec<DVec3>,
}

impl<'a> SmoothGradients<'a> {
    /// Those of this volume.
    pub fn new(volume: &'a Volume) -> Self {
        let spacing = volume.spacing();
        let greatest = spacing.into_iter().fold(0.0, f64::max);
        let weights = spacing.map(|own| {
            let variance = 0.25 * (greatest * greatest - own * own) / (own * own);
            gaussian(variance.max(0.0).sqrt().min(5.0))
        });
        let is_blurred = weights.iter().any(|weights| weights.len() > 1);
        let [nx, ny, nz] = volume.dims;
        let at = |i: usize| {
            let voxel = [i % nx, i / nx % ny, i / nx / ny];
            if !is_blurred {
                return difference(volume, voxel);
            }
            let along = |axis: usize| {
                let mean = |step: i64| {
                    let mut moved = voxel.map(|k| k as i64);
                    moved[axis] += step;
                    mean(volume, &weights, moved)
                };
                0.5 * (mean(1) - mean(-1))
            };
            DVec3::new(along(0), along(1), along(2))
        };
        Self {
            volume,
            differences: (0..nx * ny * nz).into_par_iter().map(at).collect(),
        }
    }

    /// The gradient, per world unit, at a position inside the volume.
    pub fn at(&self, at: DVec3) -> DVec3 {
        let mixed: DVec3 = corners(self.volume, at)
            .iter()
            .map(|&(voxel, weight)| weight * self.differences[linear(self.volume, voxel)])
            .sum();
        self.volume.world_from_index.matrix3.inverse().transpose() * mixed
    }
}

/// The mean around a voxel.
fn mean(volume: &Volume, weights: &[Vec<(i64, f64)>; 3], [x, y, z]: [i64; 3]) -> f64 {
    let mut sum = 0.0;
    for &(by_x, of_x) in &weights[0] {
        for &(by_y, of_y) in &weights[1] {
            for &(by_z, of_z) in &weights[2] {
                sum += of_x * of_y * of_z * beyond(volume, [x + by_x, y + by_y, z + by_z]);
            }
        }
    }
    sum
}

/// Offsets and weights.
fn gaussian(deviation: f64) -> Vec<(i64, f64)> {
    if deviation < 0.3 {
        return vec![(0, 1.0)];
    }
    let radius = (2.5 * deviation).ceil() as i64;
    let weight = |offset: i64| (-0.5 * (offset as f64 / deviation).powi(2)).exp();
    let sum: f64 = (-radius..=radius).map(weight).sum();
    (-radius..=radius)
        .map(|offset| (offset, weight(offset) / sum))
        .collect()
}

/// The value at a voxel that may lie beyond the volume.
fn beyond(volume: &Volume, voxel: [i64; 3]) -> f64 {
    for axis in 0..3 {
        let last = volume.dims[axis] as i64 - 1;
        let face = voxel[axis].clamp(0, last);
        if face != voxel[axis] {
            let at = |place: i64| {
                let mut moved = voxel;
                moved[axis] = place.clamp(0, last);
                beyond(volume, moved)
            };
            return 2.0 * at(face) - at(2 * face - voxel[axis]);
        }
    }
    volume.value(linear(volume, voxel.map(|i| i as usize)))
}
