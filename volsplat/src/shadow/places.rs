//! From a vertex of the grid to the brick that holds it.

use crate::bricks::cells::{CELL_SIDE, CellField, vertex};
use crate::shadow::slices::VertexBox;

/// The bricks of a field by their place.
pub(super) struct Places {
    /// Bricks along each axis.
    dims: [usize; 3],
    /// Number of the brick at each place and 1 more, 0 where there is none.
    numbers: Vec<usize>,
}

impl Places {
    pub(super) fn new(field: &CellField) -> Self {
        let Some(within) = VertexBox::of(field) else {
            return Self {
                dims: [0; 3],
                numbers: Vec::new(),
            };
        };
        let dims = within.high.map(|high| high / CELL_SIDE + 1);
        let mut places = Self {
            dims,
            numbers: vec![0; dims.iter().product()],
        };
        for (number, brick) in field.bricks.iter().enumerate() {
            let at = brick
                .bounds
                .corner
                .map(|corner| corner as usize / CELL_SIDE);
            if let Some(place) = places.place(at) {
                places.numbers[place] = number + 1;
            }
        }
        places
    }

    fn place(&self, at: [usize; 3]) -> Option<usize> {
        let [x, y, z] = at;
        let is_inside = (0..3).all(|axis| at[axis] < self.dims[axis]);
        is_inside.then(|| x + self.dims[0] * (y + self.dims[1] * z))
    }

    /// A brick and the place in its table of a vertex of the grid; `None` where nothing is shown.
    pub(super) fn of_vertex(&self, field: &CellField, at: [usize; 3]) -> Option<[usize; 2]> {
        let local = at.map(|at| at % CELL_SIDE);
        let own = at.map(|at| at / CELL_SIDE);
        if let Some(found) = self.in_brick(field, own, local) {
            return Some(found);
        }
        // A vertex between bricks is the last of those before it too.
        let shared = [0, 1, 2].map(|axis: usize| local[axis] == 0 && own[axis] > 0);
        (1..8).find_map(|sides| {
            let is_before = [0, 1, 2].map(|axis: usize| sides >> axis & 1 == 1);
            let (mut brick, mut local) = (own, local);
            for axis in 0..3 {
                if is_before[axis] {
                    if !shared[axis] {
                        return None;
                    }
                    brick[axis] -= 1;
                    local[axis] = CELL_SIDE;
                }
            }
            self.in_brick(field, brick, local)
        })
    }

    fn in_brick(
        &self,
        field: &CellField,
        brick: [usize; 3],
        local: [usize; 3],
    ) -> Option<[usize; 2]> {
        let number = self.numbers[self.place(brick)?].checked_sub(1)?;
        let [least, greatest] = field.bricks[number].bounds.range();
        let is_inside = (0..3).all(|axis| {
            (usize::from(least[axis])..=usize::from(greatest[axis])).contains(&local[axis])
        });
        is_inside.then(|| [number, vertex(local[0], local[1], local[2])])
    }
}
