//! Flat pieces of a reference's surfaces, and where a screen position lies on one.
//!
//! Cells between samples are two triangles, or up to four quarters where they are cut; on each the disparity is linear
//! over the reference, so its map to the screen is a homography. A piece is named by a number, and its exact inverse is
//! computed in f64 only where it is seen.

use glam::{DMat2, DVec2, DVec3};

use crate::surface::{Cell, Surfaces};
use crate::warp::Warp;

/// Kinds of pieces in one cell: two triangles and four quarters, rounded up to a power of 2.
const KINDS: u32 = 8;

/// Most cells that numbers of pieces can tell apart.
pub(crate) const MAX_CELLS: usize = (u32::MAX / KINDS) as usize;

/// The number of no piece.
pub(crate) const NO_PATCH: u32 = u32::MAX;

/// A piece's number: its cell and kind (0 and 1: triangles; 2 to 5: the quarter of a corner).
pub(crate) fn patch_id(cell: usize, kind: u32) -> u32 {
    cell as u32 * KINDS + kind
}

/// The cell of a piece.
pub(crate) fn cell_of(id: u32) -> usize {
    (id / KINDS) as usize
}

/// Which row a cell is in, by a multiplication: it is asked for every pixel, and a division takes longer than all else.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellRows {
    factor: u64,
    shift: u32,
}

impl CellRows {
    /// For rows of `cells` cells.
    ///
    /// The factor is above 2^shift / cells by less than 1, so a number n below 2^29 ([`MAX_CELLS`]) gives a quotient that
    /// is too large by less than n / 2^shift <= 1 / cells: never as far as the next whole number.
    pub(crate) fn new(cells: usize) -> Self {
        let shift = MAX_CELLS.ilog2() + 1 + cells.next_power_of_two().ilog2();
        Self {
            factor: (1u64 << shift).div_ceil(cells as u64),
            shift,
        }
    }

    #[inline(always)]
    fn row(self, cell: usize) -> usize {
        ((cell as u64 * self.factor) >> self.shift) as usize
    }
}

/// Whether two pieces are one or are of joined cells that have a corner in common: they are on one surface, then.
pub(crate) fn share_a_corner(surfaces: &Surfaces, a: u32, b: u32) -> bool {
    // Cells at the ends of rows are never joined, so that neighbours by number are neighbours in the picture.
    let joined = a % KINDS < 2 && b % KINDS < 2;
    let apart = (a / KINDS).abs_diff(b / KINDS);
    a == b || joined && (apart <= 1 || apart.abs_diff(surfaces.size[0] as u32 + 1) <= 1)
}

/// A flat piece: disparity is linear around a place in the reference.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// A place on the piece, px of the reference (centres at +0.5).
    pub(crate) place: DVec2,
    /// Disparity there.
    pub(crate) disparity: f64,
    /// Change of disparity per pixel of the reference.
    pub(crate) slope: DVec2,
}

/// Where a screen position lies on a piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Position in the reference, px.
    pub(crate) pos_in_reference: DVec2,
    /// Reference px per screen px.
    pub(crate) reference_from_screen: DMat2,
    /// Disparity there.
    pub(crate) disparity: f64,
}

impl Patch {
    /// The piece of this number.
    #[inline(always)]
    pub(crate) fn new(surfaces: &Surfaces, id: u32) -> Self {
        let width = surfaces.size[0];
        let cell = cell_of(id);
        let cy = surfaces.cell_rows.row(cell);
        let cx = cell - cy * (width + 1);
        let kind = id % KINDS;
        if kind >= 2 {
            let corner = kind as usize - 2;
            return Self::of_sample(surfaces, cx + corner % 2, cy + corner / 2);
        }
        let first = (cy - 1) * width + cx - 1;
        let [a, b, c, d] = [first, first + 1, first + width, first + width + 1]
            .map(|i| f64::from(surfaces.disparity[i]));
        let place = DVec2::new(cx as f64 - 0.5, cy as f64 - 0.5);
        let (disparity, slope) = match (surfaces.cells[cell], kind) {
            (Cell::AntiDiagonal, 0) => (a, [b - a, c - a]),
            (Cell::AntiDiagonal, _) => (b + c - d, [d - c, d - b]),
            (_, 0) => (a, [b - a, d - b]),
            _ => (a, [d - c, c - a]),
        };
        Self {
            place,
            disparity,
            slope: DVec2::from_array(slope),
        }
    }

    /// The tangent plane of a sample; `None` where its depth is unknown.
    pub(crate) fn of_sample_at(surfaces: &Surfaces, index: usize) -> Option<Self> {
        let width = surfaces.size[0];
        (!surfaces.disparity[index].is_nan())
            .then(|| Self::of_sample(surfaces, index % width + 1, index / width + 1))
    }

    /// The tangent plane of the sample whose right lower cell is (cx, cy): sample (cx - 1, cy - 1).
    #[inline]
    fn of_sample(surfaces: &Surfaces, cx: usize, cy: usize) -> Self {
        let index = (cy - 1) * surfaces.size[0] + cx - 1;
        let slope = surfaces.slope[index].map(f64::from);
        Self {
            place: DVec2::new(cx as f64 - 0.5, cy as f64 - 0.5),
            disparity: f64::from(surfaces.disparity[index]),
            slope: DVec2::from_array(slope),
        }
    }

    /// Disparity of the piece's plane at a place in the reference.
    pub(crate) fn disparity_at(&self, pos_in_reference: DVec2) -> f64 {
        self.disparity + self.slope.dot(pos_in_reference - self.place)
    }

    /// Where the screen position lies on the piece's plane; `None` if it is seen edge-on.
    #[inline]
    pub(crate) fn hit(&self, warp: &Warp, pos_in_screen: DVec2) -> Option<Hit> {
        self.plane(warp).hit(pos_in_screen)
    }

    /// The map from the screen to the piece's plane, to be asked more than once.
    #[inline]
    pub(crate) fn plane(&self, warp: &Warp) -> PlaneMap {
        let [x, y, one] = warp.pixel_columns();
        let disparity = warp.disparity_column();
        // Coordinates count from the place, so that nothing cancels far from the reference's corner.
        let origin = self.place.x * x + self.place.y * y + one + self.disparity * disparity;
        let (x, y) = (x + self.slope.x * disparity, y + self.slope.y * disparity);
        PlaneMap {
            patch: *self,
            rows: [y.cross(origin), origin.cross(x), x.cross(y)],
        }
    }
}

/// The homography from the screen to the plane of a piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneMap {
    /// The piece.
    pub(crate) patch: Patch,
    /// Offset from the piece's place along x and y, and their divisor, by homogeneous screen position.
    rows: [DVec3; 3],
}

impl PlaneMap {
    /// Where the screen position lies on the plane; `None` if it is seen edge-on.
    #[inline]
    pub(crate) fn hit(&self, pos_in_screen: DVec2) -> Option<Hit> {
        let screen = pos_in_screen.extend(1.0);
        let [row_x, row_y, row_one] = self.rows;
        let scale = 1.0 / row_one.dot(screen);
        let offset = DVec2::new(row_x.dot(screen), row_y.dot(screen)) * scale;
        let column = |of: fn(DVec3) -> f64| {
            DVec2::new(
                of(row_x) - offset.x * of(row_one),
                of(row_y) - offset.y * of(row_one),
            ) * scale
        };
        offset.is_finite().then(|| Hit {
            pos_in_reference: self.patch.place + offset,
            reference_from_screen: DMat2::from_cols(column(|v| v.x), column(|v| v.y)),
            disparity: self.patch.disparity + self.patch.slope.dot(offset),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_cells_are_those_of_a_division() {
        for cells in [1, 2, 3, 7, 33, 641, 1921, 4096, 4097, 65_537, MAX_CELLS] {
            let rows = CellRows::new(cells);
            let last = MAX_CELLS - 1;
            let near_ends =
                (0..200).flat_map(|i| [i, last - i, (last / cells).saturating_sub(i) * cells]);
            let all = near_ends
                .chain((0..=last).step_by(99_991))
                .flat_map(|n| [n, n.saturating_sub(1)]);
            for cell in all {
                assert_eq!(
                    rows.row(cell),
                    cell / cells,
                    "cell {cell} in rows of {cells}"
                );
            }
        }
    }
}
