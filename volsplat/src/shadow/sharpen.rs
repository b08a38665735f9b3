//! Light at vertices, sharpened: between vertices straight lines lie above a curve by a twelfth of its second difference in the mean.

use crate::bricks::cells::{TABLE_LEN, Table};
use crate::shadow::slices::Stack;

/// The shares at the vertices of bricks, of which the square roots are less by a twelfth of their second differences along the three axes.
/// `stack` is across z.
pub(super) fn sharpened(stack: &Stack, shares: &[Table]) -> Vec<Table> {
    let sides = stack.sides();
    let none = vec![f32::NAN; stack.area()];
    let [mut before, mut at, mut after] = [none.clone(), none.clone(), none];
    let mut changed = stack.tables();
    let fill = |slice: usize, roots: &mut [f32]| {
        stack.fill(slice, shares, roots);
        for root in roots {
            *root = root.sqrt();
        }
    };
    fill(0, &mut after);
    for slice in 0..stack.len() {
        std::mem::swap(&mut before, &mut at);
        std::mem::swap(&mut at, &mut after);
        match slice + 1 {
            next if next < stack.len() => fill(next, &mut after),
            _ => after.fill(f32::NAN),
        }
        let (before, at, after) = (&before, &at, &after);
        let [width, height] = sides;
        let root = |x: usize, y: usize| {
            let place = x + width * y;
            let own = at[place];
            let bend = |before: f32, after: f32| {
                let bend = before + after - 2.0 * own;
                if bend.is_nan() { 0.0 } else { bend }
            };
            let along_x = if x > 0 && x + 1 < width {
                bend(at[place - 1], at[place + 1])
            } else {
                0.0
            };
            let along_y = if y > 0 && y + 1 < height {
                bend(at[place - width], at[place + width])
            } else {
                0.0
            };
            let along_z = bend(before[place], after[place]);
            (own - (along_x + along_y + along_z) * (1.0 / 12.0)).clamp(0.0, 1.0)
        };
        stack.change(slice, &mut changed, |brick, table| {
            for row in stack.rows(brick, slice) {
                let [first, y] = row.first;
                for (x, share) in table[row.place..][..row.count].iter_mut().enumerate() {
                    *share = root(first + x, y).powi(2);
                }
            }
        });
    }
    let mut tables = vec![[0.0; TABLE_LEN]; shares.len()];
    stack.add_to_bricks(&changed, &mut tables);
    tables
}
