//! The trilinear field of a volume, its gradients and its nearest voxels, in f64 and by definition.
//!
//! Takes a volume and positions in voxel indices. A gradient at a voxel is the central difference along each axis, with the
//! voxel at a face repeated, carried to the world by the inverse transpose; between voxels it is mixed as the scalar is.

use glam::DVec3;
use rayon::prelude::*;
use volsplat::Volume;

/// The linear index of a voxel.
pub fn linear(volume: &Volume, [i, j, k]: [usize; 3]) -> usize {
    (k * volume.dims[1] + j) * volume.dims[0] + i
}

/// The last voxel index along each axis.
pub fn last(volume: &Volume) -> DVec3 {
    DVec3::from(volume.dims.map(|n| (n - 1) as f64))
}

/// The eight voxels around a position inside the volume, with their weights.
pub fn corners(volume: &Volume, at: DVec3) -> [([usize; 3], f64); 8] {
    let cell: [usize; 3] =
        std::array::from_fn(|axis| (at[axis] as usize).min(volume.dims[axis] - 2));
    std::array::from_fn(|corner| {
        let voxel: [usize; 3] = std::array::from_fn(|axis| cell[axis] + (corner >> axis & 1));
        let weight = (0..3)
            .map(|axis| 1.0 - (at[axis] - voxel[axis] as f64).abs())
            .product();
        (voxel, weight)
    })
}

/// The trilinear scalar at a position inside the volume.
pub fn scalar(volume: &Volume, at: DVec3) -> f64 {
    corners(volume, at)
        .iter()
        .map(|&(voxel, weight)| weight * volume.value(linear(volume, voxel)))
        .sum()
}

/// The trilinear scalar in which each voxel counts by how far the scalar of another volume is above its least.
pub fn weighted(volume: &Volume, weights: &Volume, at: DVec3) -> f64 {
    let least = weights.value_range().0;
    let (mut sum, mut total) = (0.0, 0.0);
    for (voxel, weight) in corners(volume, at) {
        let index = linear(volume, voxel);
        let weight = weight * (weights.value(index) - least);
        sum += weight * volume.value(index);
        total += weight;
    }
    if total > 0.0 { sum / total } else { 0.0 }
}

/// The gradient, per world unit, at a position inside the volume.
pub fn gradient(volume: &Volume, at: DVec3) -> DVec3 {
    let mixed: DVec3 = corners(volume, at)
        .iter()
        .map(|&(voxel, weight)| weight * difference(volume, voxel))
        .sum();
    volume.world_from_index.matrix3.inverse().transpose() * mixed
}

/// The value of the voxel nearest to a position inside the volume.
pub fn nearest(volume: &Volume, at: DVec3) -> f64 {
    let voxel = std::array::from_fn(|axis| ((at[axis] + 0.5) as usize).min(volume.dims[axis] - 1));
    volume.value(linear(volume, voxel))
}

fn difference(volume: &Volume, voxel: [usize; 3]) -> DVec3 {
    let along = |axis: usize| {
        let at = |offset: isize| {
            let mut index = voxel;
            index[axis] = index[axis]
                .saturating_add_signed(offset)
                .min(volume.dims[axis] - 1);
            volume.value(linear(volume, index))
        };
        0.5 * (at(1) - at(-1))
    };
    DVec3::new(along(0), along(1), along(2))
}

/// The gradients of a volume that light follows by default: half the difference of the voxels on both sides, in a field of means, each over
/// all voxels as a Gaussian weighs them. Along each axis its variance is a quarter of the greatest spacing's square less that of its own
/// spacing. It is cut off at 2.5 deviations, rounded up to a voxel; a deviation is at most 5 voxels, and 0 below 0.3. Beyond a
/// face the field is its own point reflection in the face; where nothing is blurred, the voxel at the face is repeated.
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
