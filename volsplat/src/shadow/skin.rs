//! Light on surfaces that are steeper than vertices can tell.
//!
//! Takes the extinction at vertices and their light; gives the light at the vertices around steep surfaces. There light falls off within less
//! than the way to a neighbour, so that vertices at different depths would give a surface stripes. Light beside a surface changes slowly:
//! the vertices of a skin have the light of a place in front of it, times the mean share of it that an eye sees in such a surface.
//! Limits: light in a skin does not follow the angle at which it is seen; gaps of less than two voxels are as bright as their rims.

use glam::{DVec3, IVec3};
use rayon::prelude::*;
use resample_core::narrow::{count, single, whole};

use crate::bricks::cells::{CellField, TABLE_LEN, Table, VERTEX_SIDE};
use crate::look::clip::GridClip;
use crate::shadow::places::Places;
use crate::shadow::slices::Stack;
use crate::shadow::strengths::Around;

/// Differences of the optical depth of a step, from vertex to vertex, between which the share of skin rises. Up to the first the light of a
/// ramp of matter is right to 5 % wherever vertices lie in it, at the second to 16 %, at 10 to 60 %; as skin all of them are right to
/// 10 %.
const SKIN: [f32; 2] = [1.5, 3.0];

/// Optical depths of a step, beside a cut where all of the matter begins at once, between which the share of skin rises. At 1.6 a cut is 37 dB
/// from its truth without skin and 29 dB with it, at 2.3 it is hatched without skin; between them it is a guess.
const SKIN_AT_CUT: [f32; 2] = [1.6, 2.3];

/// For each brick, how far the matter around each vertex is skin, 0 to 1: matter begins so steeply that light falls off within less than
/// the way to a neighbour, where vertices cannot tell it. `spacing` is that way along each axis, opacity units.
pub(super) fn skins(
    stack: &Stack,
    strengths: &[Table],
    clip: &GridClip,
    spacing: [f32; 3],
) -> Vec<Table> {
    let [x, y, z] = spacing;
    let steps = [x.max(y), x.max(y).max(z)];
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
                    let depth = extremes.difference(first + x, own, steps);
                    *skin = share_of(depth, SKIN);
                    let of_cut = share_of(steps[1] * own, SKIN_AT_CUT);
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

    /// The greatest difference of a place's number from those around it, times the steps within a slice and to the slices beside it; NaN,
    /// where nothing is shown, counts as no difference.
    fn difference(&self, place: usize, own: f32, [within, across]: [f32; 2]) -> f32 {
        let of = |slice: usize| {
            let [least, greatest] = [&self.least, &self.greatest].map(|all| all[slice][place]);
            (own - least).max(greatest - own).max(0.0)
        };
        (within * of(1)).max(across * of(0).max(of(2)))
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

/// Voxels from a vertex of a skin to the place in front of it. The deepest vertices of a skin lie up to the diagonal of a cell, 1.7, behind
/// its surface.
const IN_FRONT: f64 = 2.0;

/// The skins of a field, and where their light comes from.
pub(super) struct Skins<'a> {
    pub(super) field: &'a CellField,
    pub(super) places: &'a Places,
    /// For each brick, the mean extinction around its vertices.
    pub(super) strengths: &'a [Table],
    /// For each brick, how far its vertices are skin.
    pub(super) shares: &'a [Table],
    /// From a vertex to the next along each axis, opacity units.
    pub(super) spacing: [f32; 3],
}

impl Skins<'_> {
    /// Changes the light of the skins: `light` is that of matter that is no skin, for each brick, and `seen` the mean share that an eye
    /// sees of the light in front of a surface.
    pub(super) fn light(&self, light: &mut [Table], raw: &[Table], seen: f32) {
        let bricks = light.par_iter_mut().enumerate();
        bricks.for_each(|(number, light)| {
            for (place, light) in light.iter_mut().enumerate() {
                let share = self.shares[number][place];
                if share > 0.0 {
                    let of_skin = seen * self.in_front(number, place, raw);
                    *light += share * (of_skin - *light);
                }
            }
        });
    }

    /// The light in front of the surface that a vertex lies in.
    fn in_front(&self, number: usize, place: usize, light: &[Table]) -> f32 {
        let corner = self.field.bricks[number].bounds.corner;
        let local = [
            place % VERTEX_SIDE,
            place / VERTEX_SIDE % VERTEX_SIDE,
            place / (VERTEX_SIDE * VERTEX_SIDE),
        ];
        let at = [0, 1, 2].map(|axis: usize| corner[axis] as usize + local[axis]);
        let outwards = self.outwards(at);
        let from = DVec3::from(at.map(|at| at as f64));
        // Where nothing is shown that far away, as far as there is light.
        let mut nearest = light[number][place];
        for step in 1..=4u32 {
            let at = from + 0.25 * f64::from(step) * IN_FRONT * outwards;
            match self.interpolated(at, light) {
                Some(light) => nearest = light,
                None => break,
            }
        }
        nearest
    }

    /// Away from the matter, voxels, of length 1.
    fn outwards(&self, at: [usize; 3]) -> DVec3 {
        let at = IVec3::from(at.map(|at| i32::try_from(at).unwrap_or(i32::MAX)));
        let own = f64::from(self.strength(at));
        let mut sum = DVec3::ZERO;
        let (mut lowest, mut least) = (DVec3::ZERO, own);
        for number in (0..27).filter(|number| *number != 13) {
            let step = IVec3::new(number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1);
            let strength = f64::from(self.strength(at + step));
            let step = step.as_dvec3();
            sum -= strength * step / step.length_squared();
            if strength < least {
                (lowest, least) = (step, strength);
            }
        }
        // A gradient in the world is longer along short axes, and so is the way back to the grid.
        let spacing = DVec3::from(self.spacing.map(f64::from));
        let sum = sum / (spacing * spacing);
        let sum = sum * spacing.min_element().powi(2);
        // In the middle of something thin both sides are alike.
        if sum.length() < 0.25 * own {
            lowest.normalize_or_zero()
        } else {
            sum.normalize_or_zero()
        }
    }

    fn strength(&self, at: IVec3) -> f32 {
        let vertex = self.vertex(at);
        vertex.map_or(0.0, |[number, place]| self.strengths[number][place])
    }

    fn vertex(&self, at: IVec3) -> Option<[usize; 2]> {
        let [x, y, z] = at.to_array().map(usize::try_from);
        self.places
            .of_vertex(self.field, [x.ok()?, y.ok()?, z.ok()?])
    }

    /// The light at a position, between those of the vertices around it that show something.
    fn interpolated(&self, at: DVec3, light: &[Table]) -> Option<f32> {
        if at.min_element() < 0.0 {
            return None;
        }
        let first = at.floor();
        let share = (at - first).as_vec3();
        let first = first.to_array().map(|at| count(whole(at)));
        let (mut sum, mut weights) = (0.0, 0.0);
        for corner in 0..8 {
            let (mut weight, mut vertex) = (1.0, first);
            for axis in 0..3 {
                let is_far = corner >> axis & 1 == 1;
                vertex[axis] += usize::from(is_far);
                weight *= if is_far {
                    share[axis]
                } else {
                    1.0 - share[axis]
                };
            }
            if weight > 0.0 {
                if let Some([number, place]) = self.places.of_vertex(self.field, vertex) {
                    sum += weight * light[number][place];
                    weights += weight;
                }
            }
        }
        // Of less than a half the mean would jump from place to place.
        (weights > 0.5).then(|| sum / weights)
    }
}
