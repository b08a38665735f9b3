//! A first look at a brick: whether it may be worth the samples that [`super::samples`] takes of it.
//!
//! Takes a quarter of the rows of vertices along each axis and asks how far every other vertex is from all of them, as a
//! rule of integration. It stops at the first axis that strays too far, which bricks with edges do at once. A brick that
//! is dropped is drawn as ever: the look decides what is saved, never how far a pixel may change.

use super::samples::{FALL, Stray};
use crate::cells::{CellBrick, VERTEX_SIDE};
use crate::sheets::classify::TransferTable;

/// Every second row across either axis is looked at.
const STEP: usize = 2;

/// Whether some replacement of a brick may be `useful`.
pub(super) fn first_look(
    brick: &CellBrick,
    table: &TransferTable,
    useful: impl Fn(Stray) -> bool,
) -> bool {
    (0..3).all(|axis| {
        useful(Stray {
            spread: spread_along(brick, table, axis) / FALL,
            drift: 0.0,
        })
    })
}

/// Root mean square over rows along an axis of the error that taking every other vertex makes, in parts of the mean.
fn spread_along(brick: &CellBrick, table: &TransferTable, axis: usize) -> f32 {
    let [least, greatest] = brick.bounds.range().map(|end| end.map(usize::from));
    let stride = |axis: usize| VERTEX_SIDE.pow(axis as u32);
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    let (mut squares, mut total, mut rows) = ([0.0f32; 4], 0.0f32, 0.0f32);
    for at_v in (least[v]..=greatest[v]).step_by(STEP) {
        for at_u in (least[u]..=greatest[u]).step_by(STEP) {
            let first = at_u * stride(u) + at_v * stride(v);
            let mut error = [0.0f32; 4];
            for at in least[axis]..=greatest[axis] {
                let [r, g, b, strength] = table.at(brick.scalars[first + at * stride(axis)]);
                // The trapezoid rule counts the ends half.
                let share = if at == least[axis] || at == greatest[axis] {
                    0.5
                } else {
                    1.0
                };
                let weight = share * strength;
                let signed = if (at - least[axis]) % 2 == 0 {
                    weight
                } else {
                    -weight
                };
                total += weight;
                error = [
                    error[0] + signed * r,
                    error[1] + signed * g,
                    error[2] + signed * b,
                    error[3] + signed,
                ];
            }
            squares =
                std::array::from_fn(|channel| squares[channel] + error[channel] * error[channel]);
            rows += 1.0;
        }
    }
    let worst = squares.into_iter().fold(0.0, f32::max);
    // Without extinction at any of these vertices there is next to nothing to save.
    if total > 0.0 {
        (worst * rows).sqrt() / total
    } else {
        f32::INFINITY
    }
}
