//! The index of the visible bricks of a large volume: eight bytes a brick, row by row.

use crate::bricks::cells::CELL_SIDE;
use crate::grid::bounds::Bounds;

/// A brick in its row.
#[derive(Clone, Copy, Debug)]
pub(super) struct IndexedBrick {
    /// Its number along x.
    pub(super) column: u16,
    /// Least and greatest vertex of the visible cells along each axis.
    range: [[u8; 3]; 2],
}

/// The visible bricks, x fastest.
#[derive(Clone, Debug)]
pub(super) struct BrickIndex {
    /// Bricks along each axis, seen or not.
    along: [usize; 3],
    bricks: Vec<IndexedBrick>,
    /// Where each row begins, and the end.
    starts: Vec<usize>,
}

impl IndexedBrick {
    pub(super) fn of(bounds: &Bounds) -> Self {
        Self {
            column: (bounds.corner[0] as usize / CELL_SIDE) as u16,
            range: bounds.range(),
        }
    }

    /// Where its visible cells lie.
    pub(super) fn bounds(&self, [layer, row]: [usize; 2]) -> Bounds {
        let corner = [usize::from(self.column), row, layer].map(|i| (i * CELL_SIDE) as u32);
        Bounds::of_range(corner, self.range)
    }
}

impl BrickIndex {
    pub(super) fn new(along: [usize; 3]) -> Self {
        Self {
            along,
            bricks: Vec::new(),
            starts: vec![0],
        }
    }

    /// Adds the next row.
    pub(super) fn push_row(&mut self, bricks: &[IndexedBrick]) {
        self.bricks.extend_from_slice(bricks);
        self.starts.push(self.bricks.len());
    }

    /// Number of layers, and of rows in each.
    pub(super) fn layers_and_rows(&self) -> [usize; 2] {
        [self.along[2], self.along[1]]
    }

    /// The place of a row among all rows.
    pub(super) fn row_number(&self, [layer, row]: [usize; 2]) -> usize {
        layer * self.along[1] + row
    }

    /// The bricks of a row.
    pub(super) fn row(&self, at: [usize; 2]) -> &[IndexedBrick] {
        let number = self.row_number(at);
        &self.bricks[self.starts[number]..self.starts[number + 1]]
    }

    pub(super) fn bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        let rows =
            (0..self.along[2]).flat_map(|layer| (0..self.along[1]).map(move |row| [layer, row]));
        rows.flat_map(|at| self.row(at).iter().map(move |brick| brick.bounds(at)))
    }

    pub(super) fn bytes(&self) -> u64 {
        (size_of_val(self.bricks.as_slice()) + size_of_val(self.starts.as_slice())) as u64
    }
}
