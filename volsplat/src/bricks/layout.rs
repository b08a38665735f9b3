//! The tables of a brick: how many cells, vertices and faces it has, and in which order.

/// Cells along a brick's side: small enough to hug thin structures, large enough that finding a brick on the screen
/// costs little beside its samples. 4 and 16 were slower on both a dense and a sparse volume.
pub(crate) const CELL_SIDE: usize = 8;

/// Rows of cells of a brick, and cells.
pub(crate) const CELL_ROWS: usize = CELL_SIDE * CELL_SIDE;
pub(crate) const CELLS: usize = CELL_SIDE * CELL_ROWS;

/// Vertices along a brick's side.
pub(crate) const VERTEX_SIDE: usize = CELL_SIDE + 1;

/// Places in a brick's table.
pub(crate) const TABLE_LEN: usize = VERTEX_SIDE * VERTEX_SIDE * VERTEX_SIDE;

/// Place of a brick's last cell. A place that is held below it needs no check of its corners' places.
pub(crate) const LAST_CELL: usize = TABLE_LEN - 1 - (1 + VERTEX_SIDE + VERTEX_SIDE * VERTEX_SIDE);

/// Faces of a brick's cells across z, first those of the first layer of vertices: a cell has the face of its own number
/// and that of the next layer.
pub(crate) const FACES: usize = CELLS + CELL_ROWS;

/// The bytes at the four corners of each face, x fastest in both, the first corner lowest: two loads instead of eight, of
/// voxels that are whole numbers of eight bits.
pub(crate) type FaceBytes = [u32; FACES];

/// A value for each vertex of a brick.
pub(crate) type Table = [f32; TABLE_LEN];

/// From the place of a cell's first vertex to its eight.
pub(crate) const CELL_CORNERS: [usize; 8] = {
    let (row, layer) = (VERTEX_SIDE, VERTEX_SIDE * VERTEX_SIDE);
    [
        0,
        1,
        row,
        row + 1,
        layer,
        layer + 1,
        layer + row,
        layer + row + 1,
    ]
};
