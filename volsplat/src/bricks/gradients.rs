//! Gradients of a brick at its vertices.
//!
//! Takes the voxels of a volume and what each of them stands for, reads those of a brick and one more on all sides, and
//! differences them.

use std::array::from_fn;

use glam::{DMat3, DVec3};
use resample_volume::volume::grid::Grid;

use super::cells::{GradientTable, TABLE_LEN, VERTEX_SIDE};
use crate::grid::bounds::Bounds;
use crate::light::gradient_in_f32;

/// Vertices of a brick along an axis with one more on either side.
const AROUND: usize = VERTEX_SIDE + 2;

/// The values of a brick's voxels and of those around it, x fastest.
type Around = [f32; AROUND * AROUND * AROUND];

/// Gradients of a function of the voxels, up to the greatest vertex: central differences, one-sided by repetition at the
/// volume's faces.
pub(super) fn gradients<T: Copy + Into<f64>>(
    grid: &Grid<T>,
    value: impl Fn(f64) -> f32,
    bounds: &Bounds,
    gradient_from_differences: &DMat3,
) -> Box<GradientTable> {
    const ROW: usize = AROUND;
    const LAYER: usize = AROUND * AROUND;
    let around = around(grid, value, bounds);
    let mut table = Box::new([[0.0f32; 4]; TABLE_LEN]);
    let [_, greatest] = bounds.range().map(|end| end.map(usize::from));
    for z in 0..=greatest[2] {
        for y in 0..=greatest[1] {
            let middle = 1 + (y + 1) * ROW + (z + 1) * LAYER;
            let row = &mut table[vertex(0, y, z)..][..=greatest[0]];
            for (x, gradient) in row.iter_mut().enumerate() {
                let along =
                    |step: usize| f64::from(around[middle + x + step] - around[middle + x - step]);
                let difference = DVec3::new(along(1), along(ROW), along(LAYER));
                let [gx, gy, gz] = gradient_in_f32(*gradient_from_differences * (0.5 * difference));
                *gradient = [gx, gy, gz, 0.0];
            }
        }
    }
    table
}

/// Reads a brick up to one vertex beyond the greatest.
fn around<T: Copy + Into<f64>>(
    grid: &Grid<T>,
    value: impl Fn(f64) -> f32,
    bounds: &Bounds,
) -> Box<Around> {
    let count: [usize; 3] = bounds.range()[1].map(|end| usize::from(end) + 3);
    // Indices in the volume along each axis.
    let indices: [[usize; AROUND]; 3] = from_fn(|axis| {
        let last = grid.dims[axis] - 1;
        from_fn(|i| {
            (bounds.corner[axis] as usize + i)
                .saturating_sub(1)
                .min(last)
        })
    });
    let mut around = Box::new([0.0; AROUND * AROUND * AROUND]);
    for (z, &index_z) in indices[2][..count[2]].iter().enumerate() {
        for (y, &index_y) in indices[1][..count[1]].iter().enumerate() {
            let voxels = grid.row([0, index_y, index_z], grid.dims[0]);
            let row = &mut around[(y + z * AROUND) * AROUND..][..count[0]];
            for (entry, &index_x) in row.iter_mut().zip(&indices[0]) {
                *entry = value(voxels[index_x].into());
            }
        }
    }
    around
}

/// Place of a vertex in a brick's table.
pub(super) fn vertex(x: usize, y: usize, z: usize) -> usize {
    x + VERTEX_SIDE * (y + VERTEX_SIDE * z)
}
