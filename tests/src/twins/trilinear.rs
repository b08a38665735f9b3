//! The trilinear field of a volume, its gradients and its nearest voxels, in f64 and by definition.
//!
//! Takes a volume and positions in voxel indices. A gradient at a voxel is the central difference along each axis, with the
//! voxel at a face repeated, carried to the world by the inverse transpose; between voxels it is mixed as the scalar is.

use glam::DVec3;
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

/// The central difference along the axes of the grid at a voxel, with the voxel at a face repeated.
pub fn difference(volume: &Volume, voxel: [usize; 3]) -> DVec3 {
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
