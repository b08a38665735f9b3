//! The voxels of a brick by face: four bytes in one number, so that a sample reads its cell at twice.

use super::cells::{CELL_ROWS, CELL_SIDE, FACES, FaceBytes, TABLE_LEN, Table, VERTEX_SIDE};

/// The bytes at the corners of each face across z: pairs along x, then pairs of those along y.
pub(super) fn face_bytes(scalars: &Table) -> Box<FaceBytes> {
    const LAYER: usize = VERTEX_SIDE * VERTEX_SIDE;
    let mut pairs = [0u16; TABLE_LEN];
    for (pair, ends) in pairs.iter_mut().zip(scalars.windows(2)) {
        *pair = ends[0] as u16 | (ends[1] as u16) << 8;
    }
    let mut faces = Box::new([0; FACES]);
    for (layer, faces) in faces.chunks_exact_mut(CELL_ROWS).enumerate() {
        for (row, faces) in faces.chunks_exact_mut(CELL_SIDE).enumerate() {
            let first = layer * LAYER + row * VERTEX_SIDE;
            let (near, far) = (&pairs[first..], &pairs[first + VERTEX_SIDE..]);
            for (x, face) in faces.iter_mut().enumerate() {
                *face = u32::from(near[x]) | u32::from(far[x]) << 16;
            }
        }
    }
    faces
}
