//! Cells: the space between eight voxels each, in bricks that hold at least one visible scalar.
//!
//! The other way to keep a field: where a sheet's sum is gathered, sample by sample, a brick stores the scalars at all
//! its vertices side by side, so that the eight that a sample needs are a few cache lines apart. Bricks whose cells
//! hold no visible scalar are dropped, and the others know the box of their visible cells.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::field::Grid;
use crate::sample::{Bounds, brick_corners};
use crate::support::{Support, count_visible};
use crate::transfer::TransferFunction;
use crate::volume::{Volume, with_voxels};

/// Cells along a brick's side: small enough to hug thin structures, large enough that finding a brick on the screen
/// costs little beside its samples. 4 and 16 were slower on both a dense and a sparse volume.
pub(crate) const CELL_SIDE: usize = 8;

/// Vertices along a brick's side.
pub(crate) const VERTEX_SIDE: usize = CELL_SIDE + 1;

/// Places in a brick's table.
pub(crate) const TABLE_LEN: usize = VERTEX_SIDE * VERTEX_SIDE * VERTEX_SIDE;

/// Place of a brick's last cell. A place that is held below it needs no check of its corners' places.
pub(crate) const LAST_CELL: usize = TABLE_LEN - 1 - (1 + VERTEX_SIDE + VERTEX_SIDE * VERTEX_SIDE);

/// The bricks of a volume that hold visible cells.
#[derive(Clone, Debug)]
pub(crate) struct CellField {
    pub(crate) bricks: Vec<CellBrick>,
    pub(crate) non_transparent: u64,
    pub(crate) voxels: u64,
}

/// A brick of cells.
#[derive(Clone, Debug)]
pub(crate) struct CellBrick {
    /// The box of the visible cells: the brick's first voxel, and the least and greatest vertex.
    pub(crate) bounds: Bounds,
    /// Scalars at the vertices, x fastest, [`VERTEX_SIDE`] a row.
    pub(crate) scalars: Box<[f32; TABLE_LEN]>,
    /// The scalar's gradient at the vertices, per world unit, one table per world axis; only where it was asked for.
    pub(crate) gradients: Option<Box<[[f32; TABLE_LEN]; 3]>>,
}

/// Whether bricks carry gradients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Gradients {
    Without,
    With,
}

impl CellField {
    pub(crate) fn new(volume: &Volume, transfer: &TransferFunction, gradients: Gradients) -> Self {
        // Gradients are covectors: they go to the world by the inverse transpose.
        let world_from_grid = volume.world_from_index.matrix3.inverse().transpose();
        let support = Support::new(transfer);
        let cells = volume.dims.map(|n| n - 1);
        let bricks = brick_corners(cells, CELL_SIDE)
            .into_par_iter()
            .filter_map(|corner| {
                with_voxels!(&volume.voxels, slice => {
                    let grid = Grid { voxels: slice, dims: volume.dims };
                    let brick = cell_brick(&grid, corner, &support);
                    match gradients {
                        Gradients::Without => brick,
                        Gradients::With => brick.map(|brick| with_gradients(brick, &grid, &world_from_grid)),
                    }
                })
            })
            .collect();
        Self { bricks, non_transparent: count_visible(volume, transfer), voxels: volume.len() as u64 }
    }
}

fn cell_brick<T: Copy + Into<f64>>(grid: &Grid<T>, corner: [u32; 3], support: &Support) -> Option<CellBrick> {
    let size: [usize; 3] =
        std::array::from_fn(|axis| CELL_SIDE.min(grid.dims[axis] - 1 - corner[axis] as usize));
    let first = corner.map(|c| c as usize);
    let mut scalars = Box::new([0.0f32; TABLE_LEN]);
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for z in 0..=size[2] {
        for y in 0..=size[1] {
            for x in 0..=size[0] {
                let value = grid.at([first[0] + x, first[1] + y, first[2] + z].map(|i| i as isize));
                (low, high) = (low.min(value), high.max(value));
                scalars[vertex(x, y, z)] = value;
            }
        }
    }
    if !support.meets(low, high) {
        return None;
    }
    let mut bounds = Bounds::nothing(corner);
    let mut any = false;
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let (low, high) = cell_range(&scalars, vertex(x, y, z));
                if support.meets(low, high) {
                    bounds.add([x, y, z]);
                    bounds.add([x + 1, y + 1, z + 1]);
                    any = true;
                }
            }
        }
    }
    any.then_some(CellBrick { bounds, scalars, gradients: None })
}

/// The brick with its gradients: central differences, one-sided by repetition at the volume's faces.
fn with_gradients<T: Copy + Into<f64>>(
    brick: CellBrick,
    grid: &Grid<T>,
    world_from_grid: &DMat3,
) -> CellBrick {
    let mut gradients = Box::new([[0.0f32; TABLE_LEN]; 3]);
    let [_, greatest] = brick.bounds.range().map(|end| end.map(isize::from));
    for z in 0..=greatest[2] {
        for y in 0..=greatest[1] {
            for x in 0..=greatest[0] {
                let at = |offset: [isize; 3]| {
                    let place = [x, y, z];
                    grid.at(std::array::from_fn(|axis| {
                        brick.bounds.corner[axis] as isize + place[axis] + offset[axis]
                    }))
                };
                let difference = DVec3::new(
                    f64::from(at([1, 0, 0]) - at([-1, 0, 0])),
                    f64::from(at([0, 1, 0]) - at([0, -1, 0])),
                    f64::from(at([0, 0, 1]) - at([0, 0, -1])),
                );
                let gradient = (*world_from_grid * (0.5 * difference)).to_array();
                for (table, g) in gradients.iter_mut().zip(gradient) {
                    table[vertex(x as usize, y as usize, z as usize)] = g as f32;
                }
            }
        }
    }
    CellBrick { gradients: Some(gradients), ..brick }
}

/// Place of a vertex in a brick's table.
fn vertex(x: usize, y: usize, z: usize) -> usize {
    x + VERTEX_SIDE * (y + VERTEX_SIDE * z)
}

/// Least and greatest scalar of a cell's corners.
fn cell_range(scalars: &[f32; TABLE_LEN], first: usize) -> (f32, f32) {
    let row = VERTEX_SIDE;
    let layer = row * row;
    let corners = [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1];
    corners.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), offset| {
        let value = scalars[first + offset];
        (low.min(value), high.max(value))
    })
}
