//! Places in a grid of voxels: its bricks, their order, and the boxes around their contents; and the unit in which lengths are counted.
//!
//! Bricks are in Morton order, so that a run of bricks is compact in space and touches few screen tiles.
//! The world's unit is the user's: metres for molecules, or parsecs. Samples count lengths in a power of two near their
//! spacing, so that squares and cubes are far from the ends of f32, and a scene in another unit is the same numbers.

use glam::{DAffine3, DMat3, DVec3};
use resample_core::Camera;

use crate::Error;

/// Voxels along a brick's side. 16^3 samples project in one batch that fits the first-level cache; a brick of them is
/// large enough to be worth a visibility test and small enough to hug a surface.
pub(crate) const BRICK_SIDE: usize = 16;

/// Bits of a sample's place in its brick, per axis.
const PLACE_BITS: u32 = BRICK_SIDE.trailing_zeros();
const _: () = assert!(BRICK_SIDE.is_power_of_two() && 3 * PLACE_BITS <= u16::BITS);

/// Where the samples of a brick lie.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Index of the brick's first voxel.
    pub corner: [u32; 3],
    /// Least place along each axis that holds a sample.
    least: [u8; 3],
    /// Greatest such place.
    greatest: [u8; 3],
}

/// Packs a place in a brick.
pub(crate) fn pack_place([x, y, z]: [usize; 3]) -> u16 {
    (x | y << PLACE_BITS | z << (2 * PLACE_BITS)) as u16
}

/// The place (x, y, z) in a brick of a packed place.
#[inline(always)]
pub(crate) fn place(packed: u16) -> [u16; 3] {
    const MASK: u16 = BRICK_SIDE as u16 - 1;
    [
        packed & MASK,
        packed >> PLACE_BITS & MASK,
        packed >> (2 * PLACE_BITS),
    ]
}

impl Bounds {
    /// The bounds of no sample, in the brick with this first voxel.
    pub(crate) fn nothing(corner: [u32; 3]) -> Self {
        Self {
            corner,
            least: [u8::MAX; 3],
            greatest: [0; 3],
        }
    }

    /// The bounds with this least and greatest place along each axis.
    pub(crate) fn of_range(corner: [u32; 3], [least, greatest]: [[u8; 3]; 2]) -> Self {
        Self {
            corner,
            least,
            greatest,
        }
    }

    /// Least and greatest place along each axis.
    pub(crate) fn range(&self) -> [[u8; 3]; 2] {
        [self.least, self.greatest]
    }

    /// Takes a sample in.
    pub(crate) fn add(&mut self, place: [usize; 3]) {
        for (axis, at) in place.into_iter().enumerate() {
            self.least[axis] = self.least[axis].min(at as u8);
            self.greatest[axis] = self.greatest[axis].max(at as u8);
        }
    }

    /// The eight corners of the box of the samples' positions, grown by `margin` on all sides, in grid units.
    pub fn corners_in_grid(&self, margin: f64) -> [DVec3; 8] {
        let [least, greatest] = [self.least, self.greatest].map(|end| {
            DVec3::from(std::array::from_fn::<f64, 3, _>(|axis| {
                f64::from(self.corner[axis]) + f64::from(end[axis])
            }))
        });
        let (low, high) = (least - margin, greatest + margin);
        std::array::from_fn(|i| {
            let at = |axis: usize| {
                if i >> axis & 1 == 0 {
                    low[axis]
                } else {
                    high[axis]
                }
            };
            DVec3::new(at(0), at(1), at(2))
        })
    }
}

/// The first voxels of all bricks of `side` voxels of a grid, in Morton order.
pub(crate) fn brick_corners(dims: [usize; 3], side: usize) -> Vec<[u32; 3]> {
    let bricks = dims.map(|n| n.div_ceil(side) as u32);
    let mut corners = Vec::with_capacity(bricks.iter().map(|&n| n as usize).product());
    let whole = bricks.into_iter().max().map_or(1, u32::next_power_of_two);
    add_octants(&mut corners, bricks, [0; 3], whole);
    for corner in &mut corners {
        *corner = corner.map(|brick| brick * side as u32);
    }
    corners
}

/// Adds the bricks of a cube of bricks, octant by octant, x fastest: those inside the grid.
fn add_octants(list: &mut Vec<[u32; 3]>, bricks: [u32; 3], first: [u32; 3], side: u32) {
    if (0..3).any(|axis| first[axis] >= bricks[axis]) {
        return;
    }
    if side == 1 {
        list.push(first);
        return;
    }
    let half = side / 2;
    for octant in 0..8 {
        let along = |axis: usize| first[axis] + (octant >> axis & 1) * half;
        add_octants(list, bricks, [along(0), along(1), along(2)], half);
    }
}

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
