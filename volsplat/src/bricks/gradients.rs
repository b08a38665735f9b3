//! Gradients of a brick at its vertices.
//!
//! Takes the voxels of a volume and what each of them stands for, reads those of a brick and one more on all sides, and
//! differences them. Differences of bytes are kept as they are, whole numbers, three in four bytes; they become a gradient
//! where a sample is lit. That takes a quarter of the memory of vectors.

use std::array::from_fn;

use glam::{DMat3, DVec3};
use resample_volume::volume::Grid;

use super::layout::{TABLE_LEN, VERTEX_SIDE};
use crate::grid::bounds::Bounds;
use crate::light::gradient_in_f32;

/// The gradients at the vertices of a brick.
#[derive(Clone, Debug)]
pub(crate) enum Gradients {
    /// Of any scalars.
    Vectors(Box<GradientTable>),
    /// Of bytes.
    Differences(Box<DifferenceTable>),
}

/// A vector for each vertex of a brick, along the world's axes, per unit in which pictures count lengths. The fourth number is 0:
/// so one load takes a vector.
pub(crate) type GradientTable = [[f32; 4]; TABLE_LEN];

/// The differences of the bytes on both sides of each vertex, of a brick, along the axes of the grid: x in the lowest 11 bits, y
/// in the next 11, z in the highest 10, each with its sign.
pub(crate) type DifferenceTable = [u32; TABLE_LEN];

/// How far the differences along each axis are shifted to the left, and then to the right, with their sign.
pub(crate) const SHIFTS: [[u32; 2]; 3] = [[21, 21], [10, 21], [0, 22]];

/// Vertices of a brick along an axis with one more on either side.
const AROUND: usize = VERTEX_SIDE + 2;
const LAYER: usize = AROUND * AROUND;

/// The values of a brick's voxels and of those around it, x fastest.
type Around<V> = [V; AROUND * AROUND * AROUND];

impl Gradients {
    /// Bytes of memory of the gradients of a brick.
    pub(crate) fn size(are_bytes: bool) -> usize {
        if are_bytes {
            size_of::<DifferenceTable>()
        } else {
            size_of::<GradientTable>()
        }
    }
}

/// Gradients of a function of the voxels, up to the greatest vertex: central differences, one-sided by repetition at the
/// volume's faces.
pub(crate) fn vectors<T: Copy + Into<f64>>(
    grid: &Grid<T>,
    value: impl Fn(f64) -> f32,
    bounds: &Bounds,
    gradient_from_differences: &DMat3,
) -> Gradients {
    let around = around(grid, |voxel: T| value(voxel.into()), bounds);
    let mut table = Box::new([[0.0f32; 4]; TABLE_LEN]);
    let [_, greatest] = bounds.range().map(|end| end.map(usize::from));
    for z in 0..=greatest[2] {
        for y in 0..=greatest[1] {
            let middle = middle_of_row(y, z);
            let row = &mut table[vertex(0, y, z)..][..=greatest[0]];
            for (x, gradient) in row.iter_mut().enumerate() {
                let along =
                    |step: usize| f64::from(around[middle + x + step] - around[middle + x - step]);
                let difference = DVec3::new(along(1), along(AROUND), along(LAYER));
                let [gx, gy, gz] = gradient_in_f32(*gradient_from_differences * (0.5 * difference));
                *gradient = [gx, gy, gz, 0.0];
            }
        }
    }
    Gradients::Vectors(table)
}

/// The same differences of bytes.
pub(crate) fn differences(grid: &Grid<u8>, bounds: &Bounds) -> Gradients {
    let around = around(grid, |byte| byte, bounds);
    let mut table = Box::new([0; TABLE_LEN]);
    let [_, greatest] = bounds.range().map(|end| end.map(usize::from));
    for z in 0..=greatest[2] {
        for y in 0..=greatest[1] {
            let middle = middle_of_row(y, z);
            let row = |at: usize| &around[at..at + VERTEX_SIDE];
            // Whole rows: loops of a known length become vector instructions.
            let along = |step: usize| {
                let (below, above) = (row(middle - step), row(middle + step));
                let mut along = [0i32; VERTEX_SIDE];
                for x in 0..VERTEX_SIDE {
                    along[x] = i32::from(above[x]) - i32::from(below[x]);
                }
                along
            };
            let [x, y_along, z_along] = [along(1), along(AROUND), along(LAYER)];
            let row = &mut table[vertex(0, y, z)..][..VERTEX_SIDE];
            for k in 0..VERTEX_SIDE {
                row[k] = packed([x[k], y_along[k], z_along[k]]);
            }
        }
    }
    Gradients::Differences(table)
}

/// Three differences in one number.
#[inline(always)]
fn packed([x, y, z]: [i32; 3]) -> u32 {
    const MASK: u32 = (1 << 11) - 1;
    x as u32 & MASK | (y as u32 & MASK) << 11 | (z as u32) << 22
}

/// The place of the first vertex of a row in what is around a brick.
fn middle_of_row(y: usize, z: usize) -> usize {
    1 + (y + 1) * AROUND + (z + 1) * LAYER
}

/// Reads a brick up to one vertex beyond the greatest.
fn around<T: Copy, V: Copy + Default>(
    grid: &Grid<T>,
    value: impl Fn(T) -> V,
    bounds: &Bounds,
) -> Around<V> {
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
    let mut around = [V::default(); AROUND * AROUND * AROUND];
    for (z, &index_z) in indices[2][..count[2]].iter().enumerate() {
        for (y, &index_y) in indices[1][..count[1]].iter().enumerate() {
            let voxels = grid.row([0, index_y, index_z], grid.dims[0]);
            let row = &mut around[(y + z * AROUND) * AROUND..][..AROUND];
            let first = indices[0][0];
            // Inside the volume the voxels of a row lie side by side.
            if let (true, Some(voxels)) = (
                indices[0][AROUND - 1] == first + AROUND - 1,
                voxels.get(first..first + AROUND),
            ) {
                for x in 0..AROUND {
                    row[x] = value(voxels[x]);
                }
                continue;
            }
            for (entry, &index_x) in row.iter_mut().zip(&indices[0]) {
                *entry = value(voxels[index_x]);
            }
        }
    }
    around
}

/// Place of a vertex in a brick's table.
pub(super) fn vertex(x: usize, y: usize, z: usize) -> usize {
    x + VERTEX_SIDE * (y + VERTEX_SIDE * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_keep_their_signs() {
        for difference in [
            [-255, 255, -255],
            [255, -255, 255],
            [0, -1, 1],
            [17, -130, -254],
        ] {
            let whole = packed(difference);
            let unpacked = SHIFTS.map(|[left, right]| (whole << left) as i32 >> right);
            assert_eq!(unpacked, difference);
        }
    }
}
