//! Bricks of a grid: their order, the places of voxels in them, and the boxes around what they hold.
//!
//! Takes the size of a grid, gives bricks in Morton order, so that a run of bricks is compact in space and touches few
//! screen tiles.

use glam::DVec3;

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
