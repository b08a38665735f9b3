//! The outline of a surface inside a cut cell.
//!
//! The edge crosses the sides of the cell where it was found between their samples. In between it is straight: the
//! quarters of a cell share a point in its middle, half way from crossing to crossing, so that outlines have no steps.
//!
//! Coordinates count from the quarter's own sample, from 0 to 1 towards its neighbours.

use super::{OVERLAP, Rims, Shape};
use crate::surfaces::surface::Surfaces;

/// An edge that moves by no more than this from row to row, samples, goes straight on: 14 degrees.
const STRAIGHT: f64 = 0.25;

/// The corners of a cell as one of them sees it: itself, the next along x, along y, and the one opposite.
struct Around<'a> {
    rims: &'a Rims,
    surfaces: &'a Surfaces,
    samples: [usize; 4],
    towards: [i32; 2],
}

impl Around<'_> {
    /// The point in the middle of the cell that the quarters of one surface share, where the quarter itself reaches as far
    /// as `reach`.
    fn middle(&self, reach: [f64; 2]) -> [f64; 2] {
        let sides = [(0, 1), (0, 2), (1, 3), (2, 3)];
        let mut crossings = [[0.0; 2]; 4];
        let (mut count, mut own, mut first_on_row) = (0, 0, false);
        for (a, b) in sides.into_iter().filter(|&(a, b)| !self.linked(a, b)) {
            crossings[count] = match (a, b) {
                (0, 1) => [reach[0], 0.0],
                (0, 2) => [0.0, reach[1]],
                (1, _) => [1.0, self.crossing(1, 3)],
                _ => [self.crossing(2, 3), 1.0],
            };
            first_on_row |= count == 0 && axis_of(a, b) == 0;
            count += 1;
            own += usize::from(a == 0);
        }
        match crossings[..count] {
            [from, to] if self.has_corner() => {
                // One of the two lies on a row's side of the cell, the other on a column's.
                let (on_row, on_column) = if first_on_row { (from, to) } else { (to, from) };
                [on_row[0], on_column[1]]
            }
            [from, to] => {
                // Along an edge two quarters overlap as they do elsewhere.
                let share = if own == 1 { OVERLAP } else { 0.5 };
                [0, 1].map(|i| from[i] + share * (to[i] - from[i]))
            }
            _ => [0, 1].map(|i| {
                // Where three surfaces meet, each goes on a little beyond the point that it takes for the middle.
                let sum: f64 = crossings[..count].iter().map(|at| at[i]).sum();
                (1.1 * sum / count as f64).min(1.0)
            }),
        }
    }

    /// Returns true if two samples side by side, by their numbers, are linked.
    fn linked(&self, a: usize, b: usize) -> bool {
        let first = self.samples[a].min(self.samples[b]);
        self.surfaces.linked_on(first, axis_of(a, b))
    }

    /// How far the sample `a` reaches towards `b`.
    fn reach(&self, a: usize, b: usize) -> f64 {
        let axis = axis_of(a, b);
        let towards = if a < b {
            self.towards[axis]
        } else {
            -self.towards[axis]
        };
        let reach = self
            .rims
            .to_edge(self.surfaces, self.samples[a], axis, towards);
        reach.unwrap_or(1.0)
    }

    /// Where the edge crosses the side from `a` to `b`, from `a` on, as the surface of sample 0 ends there.
    fn crossing(&self, a: usize, b: usize) -> f64 {
        let [own_a, own_b] = [a, b].map(|i| self.is_own(i));
        let nearer = self.surfaces.nearer(self.samples[a], self.samples[b]);
        if own_a || (!own_b && nearer) {
            self.reach(a, b)
        } else {
            1.0 - self.reach(b, a)
        }
    }

    /// Returns true if a sample is of the surface of sample 0.
    fn is_own(&self, i: usize) -> bool {
        let by = |way: &[usize]| way.windows(2).all(|w| self.linked(w[0], w[1]));
        match i {
            1 => by(&[0, 1]) || by(&[0, 2, 3, 1]),
            2 => by(&[0, 2]) || by(&[0, 1, 3, 2]),
            3 => by(&[0, 1, 3]) || by(&[0, 2, 3]),
            _ => true,
        }
    }

    /// Returns true if the cell holds a corner of a surface: one sample is alone, and the edges on either side of it come straight
    /// along a row and along a column.
    fn has_corner(&self) -> bool {
        (0..4).any(|k| {
            let alone = !self.linked(k, k ^ 1) && !self.linked(k, k ^ 2);
            alone && self.comes_straight(k, k ^ 1) && self.comes_straight(k, k ^ 2)
        })
    }

    /// Returns true if the cut between `k` and `next` has the same place one sample further away from the cell.
    fn comes_straight(&self, k: usize, next: usize) -> bool {
        let (surfaces, axis) = (self.surfaces, axis_of(k, next));
        let [width, height] = surfaces.size;
        let first = self.samples[k].min(self.samples[next]);
        let away = self.samples[k] as isize - self.samples[k ^ (2 >> axis)] as isize;
        let row = [first / width, first % width][axis] as isize + away.signum();
        if row < 0 || row >= [height, width][axis] as isize {
            return false;
        }
        let before = first.wrapping_add_signed(away);
        let step = [1, width][axis];
        let known = [before, before + step].map(|i| !surfaces.disparity[i].is_nan());
        let nearer = |first: usize| surfaces.nearer(first, first + step);
        let places = [first, before].map(|i| f64::from(self.rims.places[i][axis]) / 255.0);
        known == [true; 2]
            && !surfaces.linked_on(before, axis)
            && nearer(first) == nearer(before)
            && (places[0] - places[1]).abs() <= STRAIGHT
    }
}

/// Along which axis two corners of a cell lie side by side.
fn axis_of(a: usize, b: usize) -> usize {
    usize::from(a ^ b == 2)
}

impl Rims {
    /// The outline of the quarter of `sample`, which is the corner of this number of a cut cell.
    pub(crate) fn shape(
        &self,
        surfaces: &Surfaces,
        corners: &[Option<usize>; 4],
        (corner, sample): (usize, usize),
    ) -> Shape {
        let towards = [1 - 2 * (corner as i32 % 2), 1 - 2 * (corner as i32 / 2)];
        let known = |i: usize| corners[corner ^ i].filter(|&s| !surfaces.disparity[s].is_nan());
        let [Some(a), Some(b), Some(c), Some(d)] = [0, 1, 2, 3].map(known) else {
            let reach = self.reach(surfaces, sample, towards);
            return Shape {
                reach,
                inner: reach,
            };
        };
        let around = Around {
            rims: self,
            surfaces,
            samples: [a, b, c, d],
            towards,
        };
        let reach = [1, 2].map(|next| {
            if around.linked(0, next) {
                OVERLAP
            } else {
                around.reach(0, next)
            }
        });
        Shape {
            reach,
            inner: around.middle(reach),
        }
    }
}
