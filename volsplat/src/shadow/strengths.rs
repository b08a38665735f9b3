//! The mean extinction around each vertex of the bricks, half a voxel to each side.
//!
//! Sums of these means along lines of vertices are the optical depth between two vertices, of peaks that are narrower than a voxel too.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::narrow::single;

use crate::bricks::cells::{CellBrick, CellField, TABLE_LEN, Table, VERTEX_SIDE};
use crate::look::clip::{Cut, GridClip};
use crate::shadow::medium::Medium;
use crate::shadow::slices::Stack;

/// Differences of the optical depth of a step, from vertex to vertex, between which the share of skin rises. Up to the first the light of a
/// ramp of matter is right to 5 % wherever vertices lie in it, at the second to 16 %, at 10 to 60 %; as skin all of them are right to
/// 10 %.
const SKIN: [f32; 2] = [1.5, 3.0];

/// For each brick, the mean extinction around its vertices, per opacity unit, 0 where nothing is shown, whatever a clip keeps of it. `stack`
/// is across z, and `numbers` are those at the vertices, NaN where nothing is shown.
pub(super) fn around_vertices(
    stack: &Stack,
    numbers: &[Table],
    medium: &Medium,
) -> Vec<Table> {
    let mut strengths = match medium {
        Medium::Extinction => numbers.to_vec(),
        Medium::Scalars(_) => of_scalars(stack, numbers, medium),
    };
    for strength in strengths.as_flattened_mut() {
        // Where nothing is shown it is NaN.
        *strength = strength.max(0.0);
    }
    strengths
}

/// For each brick, the strengths of the matter that a clip keeps.
pub(super) fn kept(field: &CellField, strengths: &[Table], clip: &GridClip) -> Vec<Table> {
    let mut strengths = strengths.to_vec();
    let bricks = strengths.par_iter_mut().zip(&field.bricks);
    bricks.for_each(|(strengths, brick)| keep(strengths, brick, clip));
    strengths
}

/// Scales the strengths of a brick by the share of the voxel around each vertex that a clip keeps.
fn keep(strengths: &mut Table, brick: &CellBrick, clip: &GridClip) {
    match clip.cut(&brick.bounds) {
        Cut::By(0) => return,
        Cut::Outside => return strengths.fill(0.0),
        Cut::By(_) => {}
    }
    let corner = DVec3::from(brick.bounds.corner.map(f64::from));
    for (place, strength) in strengths.iter_mut().enumerate() {
        let at = [
            place % VERTEX_SIDE,
            place / VERTEX_SIDE % VERTEX_SIDE,
            place / (VERTEX_SIDE * VERTEX_SIDE),
        ];
        let at = corner + DVec3::from(at.map(|n| n as f64));
        let kept = DVec3::AXES.map(|axis| {
            let [from, to] = clip.interval(at, axis);
            (to.min(0.5) - from.max(-0.5)).clamp(0.0, 1.0)
        });
        *strength *= single((kept[0] + kept[1] + kept[2]) / 3.0);
    }
}

/// Three neighbouring slices of scalars.
struct Around<'a> {
    slices: [&'a [f32]; 3],
    sides: [usize; 2],
}

impl Around<'_> {
    /// The mean over the halves of the ways from a vertex to its neighbours; NaN where no neighbour is shown.
    fn mean(&self, [x, y]: [usize; 2], medium: &Medium) -> f32 {
        let [width, height] = self.sides;
        let [before, at, after] = self.slices;
        let place = x + width * y;
        let own = at[place];
        let neighbours = [
            before[place],
            after[place],
            if x > 0 { at[place - 1] } else { f32::NAN },
            if x + 1 < width {
                at[place + 1]
            } else {
                f32::NAN
            },
            if y > 0 { at[place - width] } else { f32::NAN },
            if y + 1 < height {
                at[place + width]
            } else {
                f32::NAN
            },
        ];
        let (mut sum, mut count) = (0.0, 0.0);
        for neighbour in neighbours {
            if !neighbour.is_nan() {
                sum += medium.mean(own, 0.5 * (own + neighbour));
                count += 1.0;
            }
        }
        sum / count
    }
}

fn of_scalars(stack: &Stack, numbers: &[Table], medium: &Medium) -> Vec<Table> {
    let sides = stack.sides();
    let none = vec![f32::NAN; stack.area()];
    let [mut before, mut at, mut after] = [none.clone(), none.clone(), none];
    let mut means = stack.tables();
    stack.fill(0, numbers, &mut after);
    for slice in 0..stack.len() {
        std::mem::swap(&mut before, &mut at);
        std::mem::swap(&mut at, &mut after);
        match slice + 1 {
            next if next < stack.len() => stack.fill(next, numbers, &mut after),
            _ => after.fill(f32::NAN),
        }
        let around = Around {
            slices: [&before, &at, &after],
            sides,
        };
        stack.change(slice, &mut means, |brick, table| {
            for row in stack.rows(brick, slice) {
                let [first, y] = row.first;
                for (x, mean) in table[row.place..][..row.count].iter_mut().enumerate() {
                    *mean = around.mean([first + x, y], medium);
                }
            }
        });
    }
    let mut tables = vec![[0.0; TABLE_LEN]; numbers.len()];
    stack.add_to_bricks(&means, &mut tables);
    tables
}

/// For each brick, how far the matter around each vertex is skin, 0 to 1: matter begins so steeply that light falls off within less than
/// the way to a neighbour, where vertices cannot tell it. `step` is that way, opacity units.
pub(super) fn skins(stack: &Stack, strengths: &[Table], step: f32) -> Vec<Table> {
    let sides = stack.sides();
    let none = vec![f32::NAN; stack.area()];
    let [mut before, mut at, mut after] = [none.clone(), none.clone(), none];
    let mut skins = stack.tables();
    stack.fill(0, strengths, &mut after);
    for slice in 0..stack.len() {
        std::mem::swap(&mut before, &mut at);
        std::mem::swap(&mut at, &mut after);
        match slice + 1 {
            next if next < stack.len() => stack.fill(next, strengths, &mut after),
            _ => after.fill(f32::NAN),
        }
        let slices = [&before, &at, &after];
        let differs = |[x, y]: [usize; 2]| {
            let [width, height] = sides;
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            let lines = y.saturating_sub(1)..(y + 2).min(height);
            let own = slices[1][x + width * y];
            let mut most = 0.0f32;
            for slice in slices {
                for line in lines.clone() {
                    for strength in &slice[line * width..][columns.clone()] {
                        // Nothing is greater than NaN, where nothing is shown.
                        most = most.max((strength - own).abs());
                    }
                }
            }
            most
        };
        stack.change(slice, &mut skins, |brick, table| {
            for row in stack.rows(brick, slice) {
                let [first, y] = row.first;
                for (x, skin) in table[row.place..][..row.count].iter_mut().enumerate() {
                    let depth = step * differs([first + x, y]);
                    *skin = ((depth - SKIN[0]) / (SKIN[1] - SKIN[0])).clamp(0.0, 1.0);
                }
            }
        });
    }
    let mut tables = vec![[0.0; TABLE_LEN]; strengths.len()];
    stack.add_to_bricks(&skins, &mut tables);
    tables
}
