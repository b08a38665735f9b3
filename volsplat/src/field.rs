//! The field: voxels that post-classification needs, stored compactly, brick by brick.
//!
//! With post-classification the scalars are reconstructed first and the transfer function is applied to the result,
//! so a voxel matters when any cell within the kernel's reach may hold a visible scalar: a cell does when the range
//! of its eight corners meets the transfer function's support. All other voxels are dropped. What falls into a cell
//! with dropped corners is told by its weights, which no longer sum to 1.

use glam::DAffine3;
use rayon::prelude::*;

use crate::sample::{BRICK_SIDE, Bounds, brick_corners, pack_place};
use crate::support::Support;
use crate::transfer::TransferFunction;
use crate::volume::{Volume, with_voxels};

/// The voxels that a post-classified rendering needs.
#[derive(Clone, Debug)]
pub struct Field {
    /// Bricks that hold at least one needed voxel, in Morton order.
    pub bricks: Vec<FieldBrick>,
    /// Bricks that hold none, and were dropped.
    pub empty: u64,
    /// Needed voxels in all bricks.
    pub count: u64,
    /// Voxels whose own scalar is visible.
    pub non_transparent: u64,
    /// Voxels of the volume.
    pub voxels: u64,
    /// From voxel indices to the world.
    pub world_from_index: DAffine3,
}

/// The needed voxels of one brick.
#[derive(Clone, Debug)]
pub struct FieldBrick {
    /// Where the needed voxels lie.
    pub bounds: Bounds,
    /// Place of each needed voxel in the brick, see [`crate::sample::place`].
    pub places: Vec<u16>,
    /// Their scalars.
    pub values: Vec<f32>,
    non_transparent: u64,
}

impl Field {
    /// The voxels within `reach` (voxels, at least 1) of a cell that may hold a visible scalar.
    pub fn new(volume: &Volume, transfer: &TransferFunction, reach: usize) -> Self {
        let support = Support::new(transfer);
        let corners = brick_corners(volume.dims, BRICK_SIDE);
        let all = corners.len();
        let bricks: Vec<FieldBrick> = corners
            .into_par_iter()
            .filter_map(|corner| {
                with_voxels!(&volume.voxels, slice => {
                    let grid = Grid { voxels: slice, dims: volume.dims };
                    field_brick(&grid, corner, reach, &support)
                })
            })
            .collect();
        Self {
            empty: (all - bricks.len()) as u64,
            count: bricks.iter().map(|b| b.places.len() as u64).sum(),
            non_transparent: bricks.iter().map(|b| b.non_transparent).sum(),
            voxels: volume.len() as u64,
            world_from_index: volume.world_from_index,
            bricks,
        }
    }
}

/// Typed voxels of a volume.
pub(crate) struct Grid<'a, T> {
    pub(crate) voxels: &'a [T],
    pub(crate) dims: [usize; 3],
}

impl<T: Copy + Into<f64>> Grid<'_, T> {
    /// `count` voxels along x, from this one on; all of them must be in the volume.
    #[inline(always)]
    pub(crate) fn row(&self, [x, y, z]: [usize; 3], count: usize) -> &[T] {
        let start = x + self.dims[0] * (y + self.dims[1] * z);
        &self.voxels[start..start + count]
    }

    /// The scalar of a voxel; beyond the volume, that of the nearest one.
    pub(crate) fn at(&self, index: [isize; 3]) -> f32 {
        self.stored(index) as f32
    }

    /// As [`Grid::at`], with all digits.
    pub(crate) fn stored(&self, index: [isize; 3]) -> f64 {
        let [x, y, z] =
            [0, 1, 2].map(|axis| index[axis].clamp(0, self.dims[axis] as isize - 1) as usize);
        self.voxels[x + self.dims[0] * (y + self.dims[1] * z)].into()
    }
}

/// Side of the block of voxels that decides about a brick, at most: the brick and twice the reach around it.
const MAX_SIDE: usize = 32;

fn field_brick<T: Copy + Into<f64>>(
    grid: &Grid<T>,
    corner: [u32; 3],
    reach: usize,
    support: &Support,
) -> Option<FieldBrick> {
    let side = BRICK_SIDE + 2 * reach;
    assert!(side <= MAX_SIDE, "a row of cells is kept in 32 bits");
    let first = corner.map(|c| c as isize - reach as isize);
    let mut block = vec![0.0f32; side * side * side];
    for (i, value) in block.iter_mut().enumerate() {
        let at = [i % side, i / side % side, i / (side * side)];
        *value = grid.at([0, 1, 2].map(|axis| first[axis] + at[axis] as isize));
    }
    let visible = |low: f32, high: f32| support.meets(low, high);
    let range = block
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    if !visible(range.0, range.1) {
        return None;
    }
    let rows = needed_rows(&block, side, reach, visible);
    collect_needed(grid.dims, corner, (&block, side, reach), &rows, visible)
}

/// For each voxel row (y, z) of the brick, the bits of its needed voxels.
fn needed_rows(
    block: &[f32],
    side: usize,
    reach: usize,
    visible: impl Fn(f32, f32) -> bool,
) -> [[u32; BRICK_SIDE]; BRICK_SIDE] {
    let at = |x: usize, y: usize, z: usize| block[x + side * (y + side * z)];
    let mut rows = [[0u32; BRICK_SIDE]; BRICK_SIDE];
    for z in 0..side - 1 {
        for y in 0..side - 1 {
            // Bit x: the cell between voxels x and x + 1 may be visible.
            let mut cells = 0u32;
            let edge = |x: usize| {
                let corners = [
                    at(x, y, z),
                    at(x, y + 1, z),
                    at(x, y, z + 1),
                    at(x, y + 1, z + 1),
                ];
                corners
                    .iter()
                    .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| {
                        (l.min(v), h.max(v))
                    })
            };
            let mut left = edge(0);
            for x in 0..side - 1 {
                let right = edge(x + 1);
                cells |= u32::from(visible(left.0.min(right.0), left.1.max(right.1))) << x;
                left = right;
            }
            // A cell at x reaches the voxels x + 1 - reach ..= x + reach; voxel v of the brick is v + reach here, so
            // that its bit v gathers the cells v ..= v + 2 reach - 1.
            let spread = (0..2 * reach).fold(0, |bits, shift| bits | cells >> shift);
            for row_z in reached(z, reach) {
                for row_y in reached(y, reach) {
                    rows[row_z][row_y] |= spread;
                }
            }
        }
    }
    rows
}

/// The voxels of the brick, along one axis, that a cell of the block reaches.
fn reached(cell: usize, reach: usize) -> std::ops::Range<usize> {
    (cell + 1).saturating_sub(2 * reach)..(cell + 1).min(BRICK_SIDE)
}

fn collect_needed(
    dims: [usize; 3],
    corner: [u32; 3],
    (block, side, reach): (&[f32], usize, usize),
    rows: &[[u32; BRICK_SIDE]; BRICK_SIDE],
    visible: impl Fn(f32, f32) -> bool,
) -> Option<FieldBrick> {
    let size: [usize; 3] =
        std::array::from_fn(|axis| BRICK_SIDE.min(dims[axis] - corner[axis] as usize));
    let (mut places, mut values) = (Vec::new(), Vec::new());
    let mut bounds = Bounds::nothing(corner);
    let mut non_transparent = 0;
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in (0..size[0]).filter(|x| rows[z][y] >> x & 1 == 1) {
                let value = block[x + reach + side * (y + reach + side * (z + reach))];
                places.push(pack_place([x, y, z]));
                values.push(value);
                bounds.add([x, y, z]);
                non_transparent += u64::from(visible(value, value));
            }
        }
    }
    places.shrink_to_fit();
    values.shrink_to_fit();
    (!places.is_empty()).then_some(FieldBrick {
        bounds,
        places,
        values,
        non_transparent,
    })
}
