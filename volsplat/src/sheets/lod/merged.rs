//! Merged blocks: what the steps of a ray read there.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};

use super::Merged;
use super::blocks::STARTS;
use super::samples::SIDES;
use super::walk::Rays;
use crate::cells::CELL_SIDE;
use crate::sheets::cell_sample::{CellBox, LANES};

/// Colour and strength of the blocks at some planes of the rays.
#[inline(always)]
pub(super) fn read_blocks<S: Simd>(
    simd: S,
    (cells, merged): (&CellBox, Merged),
    rays: &Rays<S>,
    plane: f32x8<S>,
) -> [f32x8<S>; 4] {
    let constant = |v: f32| f32x8::splat(simd, v);
    let side = SIDES[merged.level - 1];
    let per_voxel = constant(side as f32 / CELL_SIDE as f32);
    let block = |axis: usize| {
        let p = plane.mul_add(rays.step[axis], rays.start[axis]) - constant(cells.corner[axis]);
        (p * per_voxel)
            .max(constant(0.0))
            .min(constant((side - 1) as f32))
            .trunc()
    };
    let row = constant(side as f32);
    let place = block(2).mul_add(row, block(1)).mul_add(row, block(0))
        + constant(STARTS[merged.level - 1] as f32);
    let places = place.to_int::<i32x8<S>>().to_array();
    let mut codes = [[0.0f32; LANES]; 4];
    for lane in 0..LANES {
        let block = merged.blocks.code(places[lane] as usize);
        for channel in 0..4 {
            codes[channel][lane] = f32::from(block[channel]);
        }
    }
    let scales = merged.blocks.scales;
    let load =
        |channel: usize| f32x8::from_slice(simd, &codes[channel]) * constant(scales[channel]);
    [load(0), load(1), load(2), load(3)]
}
