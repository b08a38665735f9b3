//! Blocks of 4x4 pixels of a tile: which pixels of them take samples of a brick, and on which of its planes.
//!
//! The rays of a block are cut with the box of the brick's visible cells, all at once; the planes between the first
//! entry and the last exit are those on which samples can lie inside, give or take the rounding of positions.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, mask32x16};
use resample_core::tile::TILE_PX;

use super::rule::PackedRule;
use crate::field::settings::TileContext;
use crate::field::walk::cell_sample::CellBox;
use crate::field::walk::gather::{GatherScratch, POSITION_ERROR, Window};
use crate::slabs::view::{BLOCK_PX, PlaneView};

/// Blocks along a tile's side.
pub(crate) const BLOCKS: usize = TILE_PX / BLOCK_PX;

/// Least movement per plane along an axis, voxels: below it, a ray is taken to run along the faces of that axis.
const LEAST_STEP: f32 = 1e-20;

/// The pixels of each block that take samples, a bit for each.
pub(crate) type OpenBlocks = [[u64; BLOCKS]; BLOCKS];

/// The pixels of each block that take samples of the brick.
#[inline(always)]
pub(crate) fn open_blocks<S: Simd, R: PackedRule>(
    simd: S,
    job: &TileContext,
    window: Window,
    scratch: &GatherScratch,
) -> OpenBlocks {
    let mut open = [[0; BLOCKS]; BLOCKS];
    for row in window.rows[0]..window.rows[1] {
        let bits = R::open(simd, job, scratch, row).to_bitmask();
        let of_row = &mut open[row / BLOCK_PX];
        for (x, block) in of_row.iter_mut().enumerate() {
            let four = bits >> (x * BLOCK_PX) & ((1 << BLOCK_PX) - 1);
            *block |= four << (row % BLOCK_PX * BLOCK_PX);
        }
    }
    open
}

/// Where a block of a plane lies in the grid, relative to the anchor. Positions come out the same for every brick, so that
/// a sample on a face belongs to one.
#[inline(always)]
pub(crate) fn positions<S: Simd>(simd: S, plane: &PlaneView, [x, y]: [usize; 2]) -> [f32x16<S>; 3] {
    let mut positions = [f32x16::splat(simd, 0.0); 3];
    for (axis, position) in positions.iter_mut().enumerate() {
        let columns = &plane.lanes[axis][x * BLOCK_PX..(x + 1) * BLOCK_PX];
        let columns = f32x16::block_splat(f32x4::from_slice(simd, columns));
        *position = columns + f32x16::from_slice(simd, &plane.block_rows[axis][y]);
    }
    positions
}

/// How large the terms of a block's positions along an axis may be: that of the first pixel, and the steps along both sides.
#[inline(always)]
fn magnitude(plane: &PlaneView, axis: usize) -> f32 {
    let [left, right] = [0, TILE_PX - 1].map(|lane| plane.lanes[axis][lane].abs());
    plane.first[axis].abs() + TILE_PX as f32 * plane.step_y[axis].abs() + left.max(right)
}

/// The first plane and the last of a brick, as a tile sees them, and how many there are from one to the other.
pub(crate) struct Ends<'a> {
    pub(crate) planes: [&'a PlaneView; 2],
    pub(crate) count: u32,
}

/// By how much of its terms f32 may move a position far beyond the brick: each of the three terms is rounded, and their sums; on
/// the plane in question and on both ends.
const FAR_ERROR: f32 = 7.5 * f32::EPSILON;

/// The planes, counted from the first, on which samples of a block can lie in the box. With `FAR`, pixels or
/// planes may lie so many voxels apart that positions have lost digits.
#[inline(always)]
pub(crate) fn planes_inside<S: Simd, const FAR: bool>(
    simd: S,
    ends: &Ends<'_>,
    cells: &CellBox,
    at: [usize; 2],
    open: u64,
) -> Range<u32> {
    if ends.count <= 1 {
        return 0..ends.count;
    }
    let constant = |v: f32| f32x16::splat(simd, v);
    let last = (ends.count - 1) as f32;
    let (from, to) = (
        positions(simd, ends.planes[0], at),
        positions(simd, ends.planes[1], at),
    );
    let (mut near, mut far) = (constant(0.0), constant(last));
    for axis in 0..3 {
        let step = (to[axis] - from[axis]) * constant(1.0 / last);
        let tiny = step.abs().simd_lt(constant(LEAST_STEP));
        let inverse = constant(1.0) / tiny.select(constant(LEAST_STEP), step);
        let low = (constant(cells.low[axis]) - from[axis]) * inverse;
        let high = (constant(cells.high[axis]) - from[axis]) * inverse;
        let mut position_error = constant(POSITION_ERROR);
        if FAR {
            let [from, to] = ends.planes.map(|plane| magnitude(plane, axis));
            position_error += constant(FAR_ERROR * from.max(to));
        }
        let error = position_error * inverse.abs();
        near = near.max(low.min(high) - error);
        far = far.min(low.max(high) + error);
    }
    let crosses = near.simd_le(far) & mask32x16::from_bitmask(simd, open);
    if crosses.all_false() {
        return 0..0;
    }
    let first = least(crosses.select(near, constant(last)));
    let end = -least(crosses.select(-far, constant(0.0)));
    first as u32..end as u32 + 1
}

/// The least of all lanes.
#[inline(always)]
fn least<S: Simd>(lanes: f32x16<S>) -> f32 {
    let (a, b) = lanes.split();
    let (a, b) = a.min(b).split();
    let [a, b, c, d] = a.min(b).to_array();
    a.min(b).min(c.min(d))
}
