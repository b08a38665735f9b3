//! The mean extinction around each vertex of the bricks, half a voxel to each side.
//!
//! Sums of these means along lines of vertices are the optical depth between two vertices, of peaks that are narrower than a voxel too.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::narrow::single;

use crate::bricks::cells::{TABLE_LEN, Table};
use crate::look::clip::GridClip;
use crate::shadow::medium::{Integral, Medium};
use crate::shadow::slices::Stack;

/// Differences of the optical depth of a step, from vertex to vertex, between which the share of skin rises. Up to the first the light of a
/// ramp of matter is right to 5 % wherever vertices lie in it, at the second to 16 %, at 10 to 60 %; as skin all of them are right to
/// 10 %.
const SKIN: [f32; 2] = [1.5, 3.0];

/// Optical depths of a step, beside a cut where all of the matter begins at once, between which the share of skin rises. At 1.6 a cut is 37 dB
/// from its truth without skin and 29 dB with it, at 2.3 it is hatched without skin; between them it is a guess.
const SKIN_AT_CUT: [f32; 2] = [1.6, 2.3];

/// For each brick, the mean extinction around its vertices, per opacity unit, 0 where nothing is shown, whatever a clip keeps of it. `stack`
/// is across z, and `numbers` are those at the vertices, NaN where nothing is shown.
pub(super) fn around_vertices(stack: &Stack, numbers: &[Table], medium: &Medium) -> Vec<Table> {
    let mut strengths = match medium {
        Medium::Extinction => numbers.to_vec(),
        Medium::Scalars(integral) => of_scalars(stack, numbers, integral),
    };
    for strength in strengths.as_flattened_mut() {
        // Where nothing is shown it is NaN.
        *strength = strength.max(0.0);
    }
    strengths
}

/// The numbers of three neighbouring slices, one after another.
struct Around {
    /// Before, at and after; NaN where nothing is shown.
    slices: [Vec<f32>; 3],
    width: usize,
}

impl Around {
    fn new(stack: &Stack, numbers: &[Table]) -> Self {
        let none = || vec![f32::NAN; stack.area()];
        let mut slices = [none(), none(), none()];
        stack.fill(0, numbers, &mut slices[2]);
        let width = stack.sides()[0];
        Self { slices, width }
    }

    /// Goes on to a slice.
    fn advance(&mut self, stack: &Stack, slice: usize, numbers: &[Table]) {
        self.slices.rotate_left(1);
        match slice + 1 {
            next if next < stack.len() => stack.fill(next, numbers, &mut self.slices[2]),
            _ => self.slices[2].fill(f32::NAN),
        }
    }
}

fn of_scalars(stack: &Stack, numbers: &[Table], integral: &Integral) -> Vec<Table> {
    let mut means = stack.tables();
    let mut around = Around::new(stack, numbers);
    let width = around.width;
    let mut of_slice = vec![0.0; stack.area()];
    for slice in 0..stack.len() {
        around.advance(stack, slice, numbers);
        let rows = of_slice.par_chunks_mut(width).enumerate();
        rows.for_each(|(y, means)| means_of_row(integral, &around, y, means));
        stack.change(slice, &mut means, |brick, table| {
            for row in stack.rows(brick, slice) {
                let [first, y] = row.first;
                let means = &of_slice[first + width * y..][..row.count];
                table[row.place..][..row.count].copy_from_slice(means);
            }
        });
    }
    let mut tables = vec![[0.0; TABLE_LEN]; numbers.len()];
    stack.add_to_bricks(&means, &mut tables);
    tables
}

/// The means over the halves of the ways from the vertices of a row to their neighbours; 0 where no neighbour is shown.
fn means_of_row(integral: &Integral, around: &Around, y: usize, means: &mut [f32]) {
    let width = around.width;
    let [before, at, after] = &around.slices;
    let row_of = |y: usize| y * width..(y + 1) * width;
    let row = &at[y * width..][..width];
    let beside = [
        before.get(row_of(y)),
        after.get(row_of(y)),
        y.checked_sub(1).and_then(|y| at.get(row_of(y))),
        at.get(row_of(y + 1)),
    ];
    // The way to the vertex before, which its own turn has found.
    let mut from_last: Option<f32> = None;
    for (x, mean) in means.iter_mut().enumerate() {
        let own = row[x];
        *mean = 0.0;
        if own.is_nan() {
            from_last = None;
            continue;
        }
        let own = integral.place(own);
        let (mut sum, mut count) = match from_last {
            Some(mean) => (mean, 1.0),
            None => (0.0, 0.0),
        };
        let neighbours = beside.iter().flatten().map(|line| line[x]);
        for neighbour in neighbours.filter(|neighbour| !neighbour.is_nan()) {
            let half = integral.middle(own, integral.place(neighbour));
            sum += integral.between(own, half);
            count += 1.0;
        }
        from_last = None;
        if let Some(next) = row.get(x + 1).filter(|next| !next.is_nan()) {
            let next = integral.place(*next);
            let half = integral.middle(own, next);
            sum += integral.between(own, half);
            count += 1.0;
            from_last = Some(integral.between(next, half));
        }
        if count > 0.0 {
            *mean = sum / count;
        }
    }
}

/// For each brick, how far the matter around each vertex is skin, 0 to 1: matter begins so steeply that light falls off within less than
/// the way to a neighbour, where vertices cannot tell it. `step` is that way, opacity units.
pub(super) fn skins(stack: &Stack, strengths: &[Table], clip: &GridClip, step: f32) -> Vec<Table> {
    let mut skins = stack.tables();
    let mut around = Around::new(stack, strengths);
    let mut extremes = Extremes::new(stack.area());
    extremes.take(&around);
    for slice in 0..stack.len() {
        around.advance(stack, slice, strengths);
        extremes.take(&around);
        let width = around.width;
        stack.change(slice, &mut skins, |brick, table| {
            for row in stack.rows(brick, slice) {
                let mut in_grid = stack.in_grid(row, slice);
                let first = row.first[0] + width * row.first[1];
                for (x, skin) in table[row.place..][..row.count].iter_mut().enumerate() {
                    let own = around.slices[1][first + x];
                    let difference = extremes.difference(first + x, own);
                    *skin = share_of(step * difference, SKIN);
                    let of_cut = share_of(step * own, SKIN_AT_CUT);
                    if of_cut > *skin {
                        *skin = skin.max(of_cut * nearness(stack, clip, in_grid));
                    }
                    in_grid[stack.axes.across[0]] += 1.0;
                }
            }
        });
    }
    let mut tables = vec![[0.0; TABLE_LEN]; strengths.len()];
    stack.add_to_bricks(&skins, &mut tables);
    tables
}

/// The least and the greatest number around each place of three neighbouring slices, one step to each side within its slice.
struct Extremes {
    least: [Vec<f32>; 3],
    greatest: [Vec<f32>; 3],
}

impl Extremes {
    fn new(area: usize) -> Self {
        let none = || vec![f32::NAN; area];
        Self {
            least: [none(), none(), none()],
            greatest: [none(), none(), none()],
        }
    }

    /// Goes on to the slice that comes next.
    fn take(&mut self, around: &Around) {
        self.least.rotate_left(1);
        self.greatest.rotate_left(1);
        let (numbers, width) = (&around.slices[2][..], around.width);
        spread(numbers, width, f32::min, &mut self.least[2]);
        spread(numbers, width, f32::max, &mut self.greatest[2]);
    }

    /// The greatest difference of a place's number from those around it; NaN, where nothing is shown, counts as no difference.
    fn difference(&self, place: usize, own: f32) -> f32 {
        let of = |slices: &[Vec<f32>; 3]| [0, 1, 2].map(|slice: usize| slices[slice][place]);
        let ([a, b, c], [d, e, f]) = (of(&self.least), of(&self.greatest));
        let (least, greatest) = (a.min(b).min(c), d.max(e).max(f));
        (own - least).max(greatest - own).max(0.0)
    }
}

/// Takes the least or the greatest of each number and its neighbours in a slice.
fn spread(
    numbers: &[f32],
    width: usize,
    choose: impl Fn(f32, f32) -> f32 + Sync,
    result: &mut [f32],
) {
    let rows = result.par_chunks_mut(width).enumerate();
    rows.for_each(|(y, result)| {
        let row = |y: usize| numbers.get(y * width..(y + 1) * width);
        let mut of_column = numbers[y * width..][..width].to_vec();
        let rows = [y.checked_sub(1).and_then(row), row(y + 1)];
        for row in rows.into_iter().flatten() {
            for (number, beside) in of_column.iter_mut().zip(row) {
                *number = choose(*number, *beside);
            }
        }
        result.copy_from_slice(&of_column);
        for (number, before) in result[1..].iter_mut().zip(&of_column) {
            *number = choose(*number, *before);
        }
        for (number, after) in result.iter_mut().zip(&of_column[1..]) {
            *number = choose(*number, *after);
        }
    });
}

/// From 0 at the first depth to 1 at the second.
fn share_of(depth: f32, [from, to]: [f32; 2]) -> f32 {
    ((depth - from) / (to - from)).clamp(0.0, 1.0)
}

/// 1 at the two vertices beside a cut, by the clip or by a face of the box, and 0 far from it.
fn nearness(stack: &Stack, clip: &GridClip, at: DVec3) -> f32 {
    let [low, high] = stack.ends();
    let distance = (at - low).min(high - at).min_element();
    let distance = distance.min(clip.distance(at));
    single((3.0 - distance).clamp(0.0, 1.0))
}
