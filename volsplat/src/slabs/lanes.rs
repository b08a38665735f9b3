//! Vectors of samples: half a row of a tile.

/// Lanes of a vector: half a row of a tile. A brick covers about half the lanes of a whole row, and a gather into a
/// whole row would come back from memory in pieces that a wider load has to wait for.
pub(crate) const LANES: usize = 8;

/// A vector's place in a tile.
#[derive(Clone, Copy)]
pub(crate) struct HalfRow {
    pub(crate) row: usize,
    pub(crate) first: usize,
}
