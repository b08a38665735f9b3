//! Flat pieces of a reference's surfaces, and where a screen position lies on one.
//!
//! Cells between samples are two triangles, or up to four quarters where they are cut; on each the disparity is linear
//! over the reference, so its map to the screen is a homography. A piece is named by a number, and its exact inverse is
//! computed in f64 only where it is seen.

use glam::{DMat2, DVec2, DVec3};

use crate::surfaces::surface::{ANTI, KINDS, Surfaces, cell_of, is_triangle};
use crate::view::warp::Warp;

/// Returns true if two pieces are one or are of joined cells that have a corner in common: they are on one surface, then.
pub(crate) fn share_a_corner(surfaces: &Surfaces, a: u32, b: u32) -> bool {
    // Cells at the ends of rows are never joined, so that neighbours by number are neighbours in the picture.
    let joined = is_triangle(a) && is_triangle(b);
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
        if !is_triangle(id) {
            let corner = kind as usize - 2;
            let at = [cx + corner % 2, cy + corner / 2];
            let slope = |index| surfaces.slope_of_quarter(index, corner);
            return Self::of_sample(surfaces, at, slope);
        }
        let first = (cy - 1) * width + cx - 1;
        let [a, b, c, d] = [first, first + 1, first + width, first + width + 1]
            .map(|i| f64::from(surfaces.disparity[i]));
        let place = DVec2::new(cx as f64 - 0.5, cy as f64 - 0.5);
        let (disparity, slope) = match kind {
            ANTI => (a, [b - a, c - a]),
            _ if kind > ANTI => (b + c - d, [d - c, d - b]),
            0 => (a, [b - a, d - b]),
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
        (!surfaces.disparity[index].is_nan()).then(|| {
            let at = [index % width + 1, index / width + 1];
            Self::of_sample(surfaces, at, |index| surfaces.slope(index))
        })
    }

    /// The tangent plane of the sample whose right lower cell is (cx, cy): sample (cx - 1, cy - 1).
    #[inline(always)]
    fn of_sample(
        surfaces: &Surfaces,
        [cx, cy]: [usize; 2],
        slope: impl Fn(usize) -> [f32; 2],
    ) -> Self {
        let index = (cy - 1) * surfaces.size[0] + cx - 1;
        let slope = slope(index).map(f64::from);
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
