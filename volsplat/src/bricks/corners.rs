//! The voxels of a brick by cell: eight bytes in one number, so that a sample reads its cell at once.

use super::cells::{CELL_SIDE, CELLS, CornerBytes, TABLE_LEN, Table, VERTEX_SIDE};

/// The bytes at the corners of each cell: pairs along x, then pairs of those along y, then along z.
pub(super) fn corner_bytes(scalars: &Table) -> Box<CornerBytes> {
    const LAYER: usize = VERTEX_SIDE * VERTEX_SIDE;
    let mut pairs = [0u16; TABLE_LEN];
    for (pair, ends) in pairs.iter_mut().zip(scalars.windows(2)) {
        *pair = ends[0] as u16 | (ends[1] as u16) << 8;
    }
    let mut fours = [0u32; TABLE_LEN];
    for (four, rows) in fours.iter_mut().zip(pairs.windows(VERTEX_SIDE + 1)) {
        *four = u32::from(rows[0]) | u32::from(rows[VERTEX_SIDE]) << 16;
    }
    let mut corners = Box::new([0; CELLS]);
    for (row, corners) in corners.chunks_exact_mut(CELL_SIDE).enumerate() {
        let first = row % CELL_SIDE * VERTEX_SIDE + row / CELL_SIDE * LAYER;
        let (front, back) = (&fours[first..], &fours[first + LAYER..]);
        for (x, eight) in corners.iter_mut().enumerate() {
            *eight = u64::from(front[x]) | u64::from(back[x]) << 32;
        }
    }
    corners
}
