//! The numbers of the flat pieces of a reference's surfaces: a cell, and a kind of piece in it.

/// Kinds of pieces in one cell: 0 and 1 are the triangles beside the main diagonal, 2 to 5 the quarter of a corner, 6 and 7
/// the triangles beside the other diagonal.
pub(crate) const KINDS: u32 = 8;

/// The first triangle beside the other diagonal.
pub(crate) const ANTI: u32 = 6;

/// Most cells whose pieces have different numbers.
pub(crate) const MAX_CELLS: usize = (u32::MAX / KINDS) as usize;

/// The number of no piece.
pub(crate) const NO_PATCH: u32 = u32::MAX;

/// A piece's number: its cell and kind.
pub(crate) fn patch_id(cell: usize, kind: u32) -> u32 {
    cell as u32 * KINDS + kind
}

/// Returns true if a piece is a triangle of a joined cell.
#[inline(always)]
pub(crate) fn is_triangle(id: u32) -> bool {
    id.wrapping_add(KINDS - ANTI) % KINDS < 4
}

/// The cell of a piece.
pub(crate) fn cell_of(id: u32) -> usize {
    (id / KINDS) as usize
}

/// The row of a cell, by a multiplication: it is needed for every pixel, and a division takes longer than all else.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellRows {
    factor: u64,
    shift: u32,
}

impl CellRows {
    /// For rows of `cells` cells.
    ///
    /// The factor is above 2^shift / cells by less than 1, so a number n below 2^29 ([`MAX_CELLS`]) gives a quotient that
    /// is too large by less than n / 2^shift <= 1 / cells: never as far as the next whole number.
    pub(crate) fn new(cells: usize) -> Self {
        let shift = MAX_CELLS.ilog2() + 1 + cells.next_power_of_two().ilog2();
        Self {
            factor: (1u64 << shift).div_ceil(cells as u64),
            shift,
        }
    }

    #[inline(always)]
    pub(crate) fn row(self, cell: usize) -> usize {
        ((cell as u64 * self.factor) >> self.shift) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_cells_are_those_of_a_division() {
        for cells in [1, 2, 3, 7, 33, 641, 1921, 4096, 4097, 65_537, MAX_CELLS] {
            let rows = CellRows::new(cells);
            let last = MAX_CELLS - 1;
            let near_ends =
                (0..200).flat_map(|i| [i, last - i, (last / cells).saturating_sub(i) * cells]);
            let all = near_ends
                .chain((0..=last).step_by(99_991))
                .flat_map(|n| [n, n.saturating_sub(1)]);
            for cell in all {
                assert_eq!(
                    rows.row(cell),
                    cell / cells,
                    "cell {cell} in rows of {cells}"
                );
            }
        }
    }
}
