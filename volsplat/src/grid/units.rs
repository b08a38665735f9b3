//! Lengths: what f32 and f64 hold of them, and the unit that a picture is computed in.
//!
//! The world's unit is the user's: metres for molecules, or parsecs. Samples count lengths in a power of two near their
//! spacing, so that squares and cubes are far from the ends of f32, and a scene in another unit is the same numbers.

use glam::{DAffine3, DMat3, DVec3};
use resample_core::Camera;

use crate::Error;

/// Farthest a camera may be, spacings. There f64 counts 1/4 spacing, so that nothing is where it should be.
const FARTHEST: f64 = (1u64 << 51) as f64;

/// The largest power of two that is not above a length.
pub(crate) fn power_of_two(length: f64) -> f64 {
    // Without its fraction, a normal number above 0 is a power of two.
    f64::from_bits(length.to_bits() & 0x7ff0_0000_0000_0000)
}

/// A grid of the world, whose lengths are counted in this unit.
pub(crate) fn in_unit(world_from_index: &DAffine3, unit: f64) -> DAffine3 {
    let mut placed = *world_from_index;
    placed.matrix3 *= 1.0 / unit;
    placed.translation /= unit;
    placed
}

/// From differences along the axes of a grid to gradients in the world's directions, per unit that pictures of the grid count
/// lengths in: per world unit, f32 may not hold them.
pub(crate) fn gradient_from_differences(world_from_index: &DMat3) -> DMat3 {
    let [x, y, z] = [0, 1, 2].map(|axis| world_from_index.col(axis).length());
    let unit = power_of_two(x.min(y).min(z));
    // Gradients are covectors: they go to the world by the inverse transpose.
    (*world_from_index * (1.0 / unit)).inverse().transpose()
}

/// Refuses a camera from which f64 cannot tell voxels apart.
pub(crate) fn check_distance(
    camera: &Camera,
    bounds_in_world: Option<[DVec3; 2]>,
    smallest_spacing: f64,
) -> Result<(), Error> {
    let Some([low, high]) = bounds_in_world else {
        return Ok(());
    };
    let middle = camera
        .camera_from_world
        .transform_point3(0.5 * low + 0.5 * high);
    let place = camera.camera_from_world.translation;
    let distance = middle.abs().max_element().max(place.abs().max_element());
    if distance <= FARTHEST * smallest_spacing {
        return Ok(());
    }
    Err(Error::Option(format!(
        "the camera or the volume is {distance:.1e} world units away, and voxels are {smallest_spacing:.1e} apart: numbers \
         have 16 digits, so that no voxel has a place of its own; move the camera nearer, or the origin"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_two_are_below_their_lengths() {
        for length in [1.0, 1.5, 2.0, 1e-11, 3e30, 0.999] {
            let power = power_of_two(length);
            assert!(
                power <= length && length < 2.0 * power,
                "{power} of {length}"
            );
            assert_eq!(power.log2(), power.log2().round());
        }
    }
}
