//! The cells of a brick that may be visible: from the least and the greatest value at the corners of each.
//!
//! Ranges are found along one axis after another, all cells side by side: loops that become vector instructions.

use super::cells::{
    CELL_ROWS, CELL_SIDE, CELLS, FACES as FACES_ACROSS_Z, FaceBytes, ShownCells, TABLE_LEN,
    VERTEX_SIDE,
};
use super::scalars::Scalars;
use crate::grid::bounds::Bounds;

/// Vertices of a brick with cells along x, and of those with cells along y too.
const EDGES: usize = CELL_SIDE * VERTEX_SIDE * VERTEX_SIDE;
const FACES: usize = CELL_ROWS * VERTEX_SIDE;

/// The least and the greatest value at the corners of each cell.
pub(super) struct CellRanges {
    least: [f32; CELLS],
    greatest: [f32; CELLS],
}

impl CellRanges {
    #[inline(always)]
    pub(super) fn new(scalars: &Scalars) -> Self {
        match scalars {
            Scalars::Numbers(table) => Self {
                least: over_corners(table, f32::min),
                greatest: over_corners(table, f32::max),
            },
            Scalars::Bytes(faces) => Self {
                least: over_bytes(faces, u32::min),
                greatest: over_bytes(faces, u32::max),
            },
        }
    }

    /// The cells of which this holds, for the least and the greatest value.
    #[inline(always)]
    pub(super) fn select(&self, holds: impl Fn(f32, f32) -> bool) -> ShownCells {
        let mut held = [0; CELLS];
        for (cell, held) in held.iter_mut().enumerate() {
            *held = u8::from(holds(self.least[cell], self.greatest[cell]));
        }
        let (eights, _) = held.as_chunks::<CELL_SIDE>();
        let mut rows = [0; CELL_ROWS];
        for (row, eight) in rows.iter_mut().zip(eights) {
            *row = bits_of(*eight);
        }
        ShownCells::of_rows(rows)
    }
}

/// Eight bytes of 0 or 1 as bits, the first lowest: the product has each of them once in its highest byte.
#[inline(always)]
fn bits_of(eight: [u8; CELL_SIDE]) -> u8 {
    (u64::from_le_bytes(eight).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

/// Combines the bytes at the eight corners of each cell.
#[inline(always)]
fn over_bytes(faces: &FaceBytes, combine: impl Fn(u32, u32) -> u32) -> [f32; CELLS] {
    let mut of_faces = [0u32; FACES_ACROSS_Z];
    for (of_face, &face) in of_faces.iter_mut().zip(faces) {
        let [a, b, c, d] = [0, 8, 16, 24].map(|shift| face >> shift & 0xff);
        *of_face = combine(combine(a, b), combine(c, d));
    }
    let mut cells = [0.0; CELLS];
    for (at, cell) in cells.iter_mut().enumerate() {
        *cell = combine(of_faces[at], of_faces[at + CELL_ROWS]) as f32;
    }
    cells
}

/// Combines the values at the eight corners of each cell.
#[inline(always)]
fn over_corners<T: Copy + Default>(
    table: &[T; TABLE_LEN],
    combine: impl Fn(T, T) -> T,
) -> [T; CELLS] {
    let mut edges = [T::default(); EDGES];
    for (row, vertices) in edges
        .chunks_exact_mut(CELL_SIDE)
        .zip(table.chunks_exact(VERTEX_SIDE))
    {
        for x in 0..CELL_SIDE {
            row[x] = combine(vertices[x], vertices[x + 1]);
        }
    }
    let mut faces = [T::default(); FACES];
    for (layer, rows) in faces
        .chunks_exact_mut(CELL_ROWS)
        .zip(edges.chunks_exact(CELL_SIDE * VERTEX_SIDE))
    {
        for at in 0..CELL_ROWS {
            layer[at] = combine(rows[at], rows[at + CELL_SIDE]);
        }
    }
    let mut cells = [T::default(); CELLS];
    for (at, cell) in cells.iter_mut().enumerate() {
        *cell = combine(faces[at], faces[at + CELL_ROWS]);
    }
    cells
}

/// The cells with a corner that the mask shows.
pub(super) fn unmasked(mask: &[u8; TABLE_LEN]) -> ShownCells {
    let shown = over_corners(mask, |a, b| a | b);
    let mut rows = [0; CELL_ROWS];
    for (cell, &shown) in shown.iter().enumerate() {
        rows[cell / CELL_SIDE] |= u8::from(shown != 0) << (cell % CELL_SIDE);
    }
    ShownCells::of_rows(rows)
}

/// The cells of a block of this size.
pub(super) fn cells_of(size: [usize; 3]) -> ShownCells {
    let mut rows = [0; CELL_ROWS];
    for (number, row) in rows.iter_mut().enumerate() {
        if number % CELL_SIDE < size[1] && number / CELL_SIDE < size[2] {
            *row = (0xff_u32 >> (CELL_SIDE - size[0])) as u8;
        }
    }
    ShownCells::of_rows(rows)
}

/// The box around cells; `None` where there are none.
pub(super) fn box_of(corner: [u32; 3], cells: &ShownCells) -> Option<Bounds> {
    let (mut along_x, mut along_y, mut along_z) = (0u8, 0u8, 0u8);
    for (number, &row) in cells.rows().iter().enumerate() {
        along_x |= row;
        let any = u8::from(row != 0);
        along_y |= any << (number % CELL_SIDE);
        along_z |= any << (number / CELL_SIDE);
    }
    if along_x == 0 {
        return None;
    }
    let least = [along_x, along_y, along_z].map(|bits| bits.trailing_zeros() as u8);
    let greatest = [along_x, along_y, along_z].map(|bits| (u8::BITS - bits.leading_zeros()) as u8);
    Some(Bounds::of_range(corner, [least, greatest]))
}

/// Takes values into the least and the greatest so far.
#[inline(always)]
pub(super) fn take_in<T: Copy + PartialOrd>(least: &mut [T], greatest: &mut [T], values: &[T]) {
    for ((least, greatest), &value) in least.iter_mut().zip(greatest).zip(values) {
        *least = if value < *least { value } else { *least };
        *greatest = if value > *greatest { value } else { *greatest };
    }
}
