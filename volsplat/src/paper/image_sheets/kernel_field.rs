//! The voxels that a post-classified sum of wide kernels needs, stored compactly, brick by brick.
//!
//! A kernel reaches over [`REACH`] voxels, so a place may be visible when the scalars within its reach range over a visible
//! one; every voxel that reaches such a place is *needed*. A place next to it is reached by some needed voxels as well, and
//! would be classified from a part of its neighbours: so the voxels around the needed ones are kept too, without being
//! needed, and what no needed voxel reaches is known to be invisible. The volume is continued beyond its faces by its
//! outermost voxels, so that sums are complete up to them; indices count from [`MARGIN`] before the first voxel.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_volume::volume::Grid;
use resample_volume::volume::{Volume, with_voxels};

use crate::bricks::support::Support;
use crate::grid::bounds::{BRICK_SIDE, Bounds, brick_corners, pack_place, place};
use crate::look::transfer::TransferFunction;
use crate::look::visible_values::count_visible;
use crate::paper::samples::sample::{Brick, Samples};

/// Voxels that a kernel reaches to either side: the largest radius is 2, and the kernel is 0 there.
const REACH: usize = 2;

/// Voxels added before and behind the volume along each axis.
const MARGIN: usize = REACH;

/// Voxels around a brick that decide about it: a voxel is kept when a needed one lies within twice the reach, which is
/// needed for a cell within the reach, which looks at voxels one less than the reach around it.
const HALO: usize = 4 * REACH - 1;

const SIDE: usize = BRICK_SIDE + 2 * HALO;

/// The voxels that the kernels' sum needs. A sample's value is what its kernel is multiplied with (its scalar, or the
/// coefficient given for it), 1, whether it is needed, and its scalar.
pub(crate) fn kernel_samples(
    volume: &Volume,
    transfer: &TransferFunction,
    coefficients: Option<&[f32]>,
) -> Samples {
    let support = Support::new(transfer);
    let dims = volume.dims.map(|n| n + 2 * MARGIN);
    let corners = brick_corners(dims, BRICK_SIDE);
    let all = corners.len();
    let bricks: Vec<Brick> = corners
        .into_par_iter()
        .filter_map(|corner| {
            with_voxels!(&volume.voxels, slice => {
                let grid = Grid { voxels: slice, dims: volume.dims };
                let first = corner.map(|c| c as isize - (HALO + MARGIN) as isize);
                let scalars = block(|at| grid.at([0, 1, 2].map(|axis| first[axis] + at[axis] as isize)));
                let mut brick = brick(&scalars, corner, dims, &support)?;
                if let Some(voxels) = coefficients {
                    set_coefficients(&mut brick, &Grid { voxels, dims: volume.dims });
                }
                Some(brick)
            })
        })
        .collect();
    let shift = DAffine3::from_translation(DVec3::splat(-(MARGIN as f64)));
    Samples {
        empty: (all - bricks.len()) as u64,
        bricks,
        voxels: volume.len() as u64,
        count: count_visible(volume, transfer),
        world_from_index: volume.world_from_index * shift,
        index_from_voxel: [1.0, MARGIN as f64],
    }
}

/// Gives each sample of a brick its coefficient; beyond the volume, that of the nearest voxel.
fn set_coefficients(brick: &mut Brick, grid: &Grid<f32>) {
    for (&packed, value) in brick.places.iter().zip(&mut brick.values) {
        let at = place(packed);
        let index =
            |axis: usize| brick.bounds.corner[axis] as isize + at[axis] as isize - MARGIN as isize;
        value[0] = grid.at([0, 1, 2].map(index));
    }
}

fn block(scalar: impl Fn([usize; 3]) -> f32) -> Vec<f32> {
    (0..SIDE * SIDE * SIDE)
        .map(|i| scalar([i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)]))
        .collect()
}

fn brick(scalars: &[f32], corner: [u32; 3], dims: [usize; 3], support: &Support) -> Option<Brick> {
    let range = scalars
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    if !support.meets(range.0, range.1) {
        return None;
    }
    let reach = REACH as isize;
    // The voxels that a place between voxels c and c + 1 depends on.
    let around_cell = [1 - reach, reach];
    let low = spread(scalars, around_cell, f32::min);
    let high = spread(scalars, around_cell, f32::max);
    let visible: Vec<bool> = low
        .iter()
        .zip(&high)
        .map(|(&low, &high)| support.meets(low, high))
        .collect();
    let either = |a: bool, b: bool| a | b;
    let needed = spread(&visible, [-reach, reach - 1], either);
    let kept = spread(&needed, [-2 * reach, 2 * reach], either);
    let size: [usize; 3] =
        std::array::from_fn(|axis| BRICK_SIDE.min(dims[axis] - corner[axis] as usize));
    let (mut places, mut values) = (Vec::new(), Vec::new());
    let mut bounds = Bounds::nothing(corner);
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let at = x + HALO + SIDE * (y + HALO + SIDE * (z + HALO));
                if kept[at] {
                    places.push(pack_place([x, y, z]));
                    values.push([
                        scalars[at],
                        1.0,
                        if needed[at] { 1.0 } else { 0.0 },
                        scalars[at],
                    ]);
                    bounds.add([x, y, z]);
                }
            }
        }
    }
    (!places.is_empty()).then_some(Brick {
        bounds,
        places,
        values,
        gradients: Vec::new(),
    })
}

/// For each place of a block, the join of the values from `offsets[0]` to `offsets[1]` around it, axis by axis; beyond the
/// block there is nothing to join.
fn spread<T: Copy>(block: &[T], offsets: [isize; 2], join: impl Fn(T, T) -> T) -> Vec<T> {
    let mut from = block.to_vec();
    for stride in [1, SIDE, SIDE * SIDE] {
        let mut to = from.clone();
        for (i, joined) in to.iter_mut().enumerate() {
            let at = (i / stride % SIDE) as isize;
            let first = (at + offsets[0]).max(0);
            let last = (at + offsets[1]).min(SIDE as isize - 1);
            let start = i as isize - at * stride as isize;
            let value = |k: isize| from[(start + k * stride as isize) as usize];
            *joined = (first + 1..=last).fold(value(first), |sum, k| join(sum, value(k)));
        }
        from = to;
    }
    from
}
