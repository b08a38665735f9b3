//! Edges go on from row to row, so that neighbours along an edge tell its place, too.
//!
//! A straight line is fitted to the places where the edge crosses up to seven rows (or columns), weighted by how well
//! their colours tell them, and each place moves onto the line in its own row. A place that colours do not tell has even chances from one
//! sample to the next, so its neighbours decide it; a place that they tell well moves little.
//!
//! Limits: a corner is rounded by what its colours leave open.

use crate::surfaces::surface::Surfaces;

/// Rows on either side that count.
const REACH: i32 = 3;

/// Deviation of a place of which nothing is known but that it lies from 0 to 1, 1 / sqrt(12), in 255ths.
pub(crate) const UNKNOWN: u8 = 74;

/// Deviation of the best of places, samples: how far the Gaussian of a pixel departs from the sum of coverage. A guess.
const SHARPEST: f32 = 0.04;

/// How far an edge departs from a straight line one row further, samples: the deviation of a circle of 25 samples' radius.
/// From 0.02 to 0.1 all scenes agree within 0.1 dB.
const BEND: f64 = 0.02;

/// Deviation of a place, samples, between sides whose colours change from sample to sample by the square root of this
/// part of the contrast.
pub(crate) fn deviation_of(change2: f32) -> f32 {
    (SHARPEST * SHARPEST + change2).sqrt()
}

/// The same in 255ths, at most [`UNKNOWN`].
pub(crate) fn spread_of(deviation: f32) -> u8 {
    (255.0 * deviation).min(f32::from(UNKNOWN)) as u8
}

/// The sums of a weighted straight line.
#[derive(Default)]
struct Line([f64; 5]);

impl Line {
    /// A place `row` rows further.
    fn add(&mut self, row: i32, place: f64, spread: u8) {
        let row = f64::from(row);
        let (spread, bend) = (f64::from(spread) / 255.0, BEND * row * row);
        let weight = 1.0 / (spread * spread + bend * bend);
        let terms = [1.0, row, row * row, place, row * place];
        for (sum, term) in self.0.iter_mut().zip(terms) {
            *sum += weight * term;
        }
    }

    /// Its place in row 0; `None` of a single place.
    fn place(&self) -> Option<f64> {
        let [one, row, row2, place, row_place] = self.0;
        let determinant = one * row2 - row * row;
        (determinant > 1e-9 * one * row2).then(|| (place * row2 - row * row_place) / determinant)
    }
}

/// The `places` that have a spread, each moved onto the straight line through it and its neighbours: sample, axis, place.
pub(crate) fn straightened(
    surfaces: &Surfaces,
    places: &[[u8; 2]],
    spreads: &[[u8; 2]],
) -> Vec<(usize, usize, u8)> {
    let mut moved = Vec::new();
    for (index, spread) in spreads.iter().enumerate() {
        for axis in (0..2).filter(|&axis| spread[axis] != 0) {
            let edge = Edge {
                surfaces,
                spreads,
                axis,
            };
            if let Some(place) = edge.line(places, index).place() {
                let place = (255.0 * place.clamp(0.0, 1.0) + 0.5) as u8;
                moved.push((index, axis, place));
            }
        }
    }
    moved
}

/// The edges that cross rows (axis 0) or columns (axis 1).
struct Edge<'a> {
    surfaces: &'a Surfaces,
    spreads: &'a [[u8; 2]],
    axis: usize,
}

impl Edge<'_> {
    /// The line through the place after the sample `index` and those next to it along the edge.
    fn line(&self, places: &[[u8; 2]], index: usize) -> Line {
        let axis = self.axis;
        let place = |at: usize| f64::from(places[at][axis]) / 255.0;
        let mut line = Line::default();
        line.add(0, place(index), self.spreads[index][axis]);
        for side in [-1, 1] {
            let (mut at, mut offset) = (index, 0);
            for row in 1..=REACH {
                let Some((next, shift)) = self.next(at, side) else {
                    break;
                };
                (at, offset) = (next, offset + shift);
                let there = place(at) + f64::from(offset);
                line.add(side * row, there, self.spreads[at][axis]);
            }
        }
        line
    }

    /// Where the edge after the sample `index` crosses the next row or the one before, and by how many samples that is
    /// shifted.
    fn next(&self, index: usize, side: i32) -> Option<(usize, i32)> {
        let axis = self.axis;
        let [width, height] = self.surfaces.size;
        let (across, along) = ([1, width][axis], [width, 1][axis]);
        let row = [index / width, index % width][axis] as i32 + side;
        let column = [index % width, index / width][axis] as i32;
        if row < 0 || row >= [height, width][axis] as i32 {
            return None;
        }
        let beside = moved(index, side, along);
        [0, 1, -1].into_iter().find_map(|shift| {
            let is_inside = (1..self.surfaces.size[axis] as i32 - 2).contains(&(column + shift));
            let next = || moved(beside, shift, across);
            (is_inside && self.is_one(index, next(), shift)).then(|| (next(), shift))
        })
    }

    /// Returns true if the cuts after two samples of neighbouring rows, the second shifted by some samples, are one edge: of one
    /// nearer surface, on the same side.
    fn is_one(&self, index: usize, next: usize, shift: i32) -> bool {
        let (surfaces, axis) = (self.surfaces, self.axis);
        let across = [1, surfaces.size[0]][axis];
        let ends_here = |first: usize| surfaces.nearer(first, first + across);
        if self.spreads[next][axis] == 0 || ends_here(next) != ends_here(index) {
            return false;
        }
        let own = |first: usize| first + if ends_here(index) { 0 } else { across };
        let (from, to) = (own(index), own(next));
        let linked = |a: usize, b: usize, axis: usize| surfaces.linked_on(a.min(b), axis);
        // Shifted, the two are linked by way of the nearer surface's sample between them.
        if shift == 0 {
            linked(from, to, 1 - axis)
        } else if (shift > 0) == ends_here(index) {
            let between = moved(to, -shift, across);
            linked(from, between, 1 - axis) && linked(between, to, axis)
        } else {
            let between = moved(from, shift, across);
            linked(from, between, axis) && linked(between, to, 1 - axis)
        }
    }
}

/// A sample some steps further.
fn moved(index: usize, steps: i32, step: usize) -> usize {
    index.wrapping_add_signed(steps as isize * step as isize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_is_not_told_lies_on_its_neighbours_line() {
        let mut line = Line::default();
        line.add(0, 0.5, UNKNOWN);
        for row in [-2, -1, 1, 2] {
            line.add(
                row,
                0.2 + 0.1 * f64::from(row),
                spread_of(deviation_of(0.0)),
            );
        }
        let place = line.place().expect("five places");
        assert!((place - 0.2).abs() < 0.01, "{place}");
        // Places on one line stay there, whatever their spread.
        let mut straight = Line::default();
        for row in -3..=3 {
            straight.add(row, 0.4 - 0.3 * f64::from(row), (31 + 7 * row) as u8);
        }
        let place = straight.place().expect("seven places");
        assert!((place - 0.4).abs() < 1e-12, "{place}");
        let mut alone = Line::default();
        alone.add(0, 0.5, UNKNOWN);
        assert!(alone.place().is_none());
    }
}
