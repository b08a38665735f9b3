//! The part of a plane that is nearer to a point than to its neighbours, and within a line: how far it reaches.
//!
//! Takes the neighbours' offsets in the plane, returns the distance of the farthest corner of the point's Voronoi cell. Discs
//! of these radii cover the plane without a gap, since cells do, however irregular the points are.

use glam::DVec2;

/// Most corners of a cell: those of irregular points have six in the mean. A guess with a margin.
const MOST_CORNERS: usize = 20;

/// A convex polygon around the origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    corners: [DVec2; MOST_CORNERS],
    count: usize,
}

impl Cell {
    /// A square of this half side.
    pub(crate) fn square(half: f64) -> Self {
        let mut corners = [DVec2::ZERO; MOST_CORNERS];
        for (corner, (x, y)) in corners.iter_mut().zip([(-1, -1), (1, -1), (1, 1), (-1, 1)]) {
            *corner = DVec2::new(f64::from(x), f64::from(y)) * half;
        }
        Self { corners, count: 4 }
    }

    /// Keeps what is nearer to the origin than to a neighbour.
    pub(crate) fn keep_nearer_than(&mut self, neighbour: DVec2) {
        self.keep(neighbour, 0.5 * neighbour.length_squared());
    }

    /// Keeps the places whose product with `across` is at most `most`.
    pub(crate) fn keep(&mut self, across: DVec2, most: f64) {
        let corners = &self.corners[..self.count];
        if corners.iter().all(|c| c.dot(across) <= most) {
            return;
        }
        let Self { corners, count } = *self;
        let corners = &corners[..count];
        self.count = 0;
        let mut corner = corners[count - 1];
        let mut here = most - corner.dot(across);
        // A cut meets the side that leads to a corner before the corner itself.
        for &next in corners {
            let there = most - next.dot(across);
            if (here >= 0.0) != (there >= 0.0) {
                self.push(corner + (next - corner) * (here / (here - there)));
            }
            if there >= 0.0 {
                self.push(next);
            }
            (corner, here) = (next, there);
        }
    }

    /// Squared distance of the farthest corner; 0 where nothing is left.
    pub(crate) fn farthest_square(&self) -> f64 {
        let squares = self.corners[..self.count]
            .iter()
            .map(|c| c.length_squared());
        squares.fold(0.0, f64::max)
    }

    /// A cell that rounding has given too many corners stays as it is.
    fn push(&mut self, corner: DVec2) {
        if self.count < MOST_CORNERS {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }
}
