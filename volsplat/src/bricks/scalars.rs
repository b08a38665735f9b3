//! The scalars of a brick at its vertices: numbers, or bytes by face.
//!
//! Bytes take four in one number for each face of a cell: a sample reads its cell at twice, and a brick takes four fifths of
//! the memory of one number a vertex.

use super::layout::{
    CELL_CORNERS, CELL_ROWS, CELL_SIDE, CELLS, FACES, FaceBytes, TABLE_LEN, Table, VERTEX_SIDE,
};

/// Scalars at the vertices of a brick, or the numbers of labels in a palette.
#[derive(Clone, Debug)]
pub(crate) enum Scalars {
    /// Voxels that are whole numbers of eight bits, by face.
    Bytes(Box<FaceBytes>),
    /// All others, x fastest, [`VERTEX_SIDE`] a row.
    Numbers(Box<Table>),
}

/// A byte for each vertex of a brick.
pub(crate) type ByteTable = [u8; TABLE_LEN];

/// The place of a cell's first vertex as the number of the cell, both x fastest.
#[inline(always)]
pub(crate) fn cell_of(vertex: usize) -> usize {
    const LAYER: usize = VERTEX_SIDE * VERTEX_SIDE;
    // Each row of cells is shorter by one than one of vertices, each layer by a row and one for each of its other rows.
    vertex - vertex / VERTEX_SIDE - CELL_SIDE * (vertex / LAYER)
}

impl Scalars {
    /// Those of bytes at the vertices.
    pub(crate) fn of_bytes(bytes: &ByteTable) -> Self {
        const LAYER: usize = VERTEX_SIDE * VERTEX_SIDE;
        let mut pairs = [0u16; TABLE_LEN];
        for (pair, ends) in pairs.iter_mut().zip(bytes.windows(2)) {
            *pair = u16::from(ends[0]) | u16::from(ends[1]) << 8;
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
        Self::Bytes(faces)
    }

    /// The scalar at a vertex.
    #[inline(always)]
    pub(crate) fn at(&self, vertex: usize) -> f32 {
        match self {
            Self::Numbers(table) => table[vertex],
            Self::Bytes(faces) => {
                let [x, y] = [vertex % VERTEX_SIDE, vertex / VERTEX_SIDE % VERTEX_SIDE];
                let z = vertex / (VERTEX_SIDE * VERTEX_SIDE);
                // The last vertices of a row and of a layer have no face of their own.
                let [column, row] = [x, y].map(|at| at.min(CELL_SIDE - 1));
                let face = faces[column + CELL_SIDE * (row + CELL_SIDE * z)];
                f32::from(face.to_le_bytes()[x - column + 2 * (y - row)])
            }
        }
    }

    /// The scalars at the corners of a cell, x fastest; `first` is the place of its first vertex.
    #[inline(always)]
    pub(crate) fn corners(&self, first: usize) -> [f32; 8] {
        match self {
            Self::Numbers(table) => CELL_CORNERS.map(|offset| table[first + offset]),
            Self::Bytes(faces) => {
                let cell = cell_of(first) % CELLS;
                let [a, b, c, d] = faces[cell].to_le_bytes().map(f32::from);
                let [e, f, g, h] = faces[cell + CELL_ROWS].to_le_bytes().map(f32::from);
                [a, b, c, d, e, f, g, h]
            }
        }
    }

    /// A number for each vertex.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f32> + '_ {
        (0..TABLE_LEN).map(|vertex| self.at(vertex))
    }

    /// Bytes of memory of the scalars of a brick.
    pub(crate) fn size(are_bytes: bool) -> usize {
        if are_bytes {
            size_of::<FaceBytes>()
        } else {
            size_of::<Table>()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_hold_every_byte() {
        let bytes: ByteTable = std::array::from_fn(|i| (i * 37 % 251) as u8);
        let scalars = Scalars::of_bytes(&bytes);
        let read: Vec<f32> = scalars.numbers().collect();
        assert_eq!(read, bytes.map(f32::from));
        for z in 0..CELL_SIDE {
            for y in 0..CELL_SIDE {
                for x in 0..CELL_SIDE {
                    let first = x + VERTEX_SIDE * (y + VERTEX_SIDE * z);
                    assert_eq!(cell_of(first), x + CELL_SIDE * (y + CELL_SIDE * z));
                    let plain = CELL_CORNERS.map(|offset| f32::from(bytes[first + offset]));
                    assert_eq!(scalars.corners(first), plain, "{x} {y} {z}");
                }
            }
        }
    }
}
