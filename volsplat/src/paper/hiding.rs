//! Hidden samples: opaque tiles, and samples that touch opaque tiles alone.
//!
//! After each batch of bricks the opaque tiles are counted into a table of sums, so that the question whether every tile of
//! a rectangle is opaque takes four reads, however large it is: what a pyramid of tiles and larger squares would answer by
//! descent. A pixel of an opaque tile changes no more than by its bound, whatever comes behind; so what touches opaque
//! tiles alone need not be projected.
//! Source: hidden voxels are the paper's future work (section 6).

use glam::DVec3;
use resample_core::tile::{TileGrid, TileRect};
use resample_core::{Camera, GridView, Projection};

use crate::grid::bounds::Bounds;

/// Pixels around a brick's box that its samples may still reach: the pixel filter has four taps.
const MARGIN_PX: f64 = 2.0;

/// Opaque tiles, summed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hiding {
    columns: usize,
    /// Opaque tiles above and left of each corner of the tiles, row by row; empty where no tile is opaque.
    sums: Vec<u32>,
}

impl Hiding {
    /// Counts the tiles of a picture that are opaque.
    pub(crate) fn new(grid: &TileGrid, is_opaque: impl Fn(usize) -> bool) -> Self {
        let (columns, rows) = (grid.columns(), grid.rows());
        let mut sums = vec![0; (columns + 1) * (rows + 1)];
        for y in 0..rows {
            let mut row = 0;
            for x in 0..columns {
                row += u32::from(is_opaque(y * columns + x));
                sums[(y + 1) * (columns + 1) + x + 1] = sums[y * (columns + 1) + x + 1] + row;
            }
        }
        if sums.last().is_none_or(|&all| all == 0) {
            sums.clear();
        }
        Self { columns, sums }
    }

    /// Returns true if a rectangle holds tiles, and all of them are opaque.
    #[inline(always)]
    pub(crate) fn hides(&self, rect: &TileRect) -> bool {
        if self.sums.is_empty() || rect.area() == 0 {
            return false;
        }
        let at = |x: u16, y: u16| self.sums[usize::from(y) * (self.columns + 1) + usize::from(x)];
        let opaque = at(rect.x1, rect.y1) + at(rect.x0, rect.y0)
            - at(rect.x1, rect.y0)
            - at(rect.x0, rect.y1);
        opaque as usize == rect.area()
    }
}

/// Where a brick of samples lies for a camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BrickPlace {
    /// No sample is nearer than this: distance from the eye, or camera z of parallel rays.
    pub(crate) nearest: f64,
    /// The tiles that its kernels may touch; `None` where one may reach the near plane.
    pub(crate) rect: Option<TileRect>,
}

/// Rounding of f32 positions, as a share of their size, with much to spare.
const ROUNDING: f64 = 1e-5;

impl BrickPlace {
    /// Where the samples of `bounds` lie, whose kernels have this radius in the grid.
    pub(crate) fn new(bounds: &Bounds, radius: f64, view: &GridView, camera: &Camera) -> Self {
        let in_camera = |corner: DVec3| view.camera_from_grid.transform_point3(corner);
        let samples = bounds.corners_in_grid(0.0).map(in_camera);
        let kernels = bounds.corners_in_grid(radius).map(in_camera);
        let margin = ROUNDING
            * kernels
                .iter()
                .map(|corner| corner.length())
                .fold(0.0, f64::max);
        let nearest = match view.projection {
            // The ball around the box: the box itself may be sheared.
            Projection::Perspective => {
                let middle = 0.5 * (samples[0] + samples[7]);
                let reach = samples
                    .iter()
                    .map(|corner| corner.distance(middle))
                    .fold(0.0, f64::max);
                (middle.length() - reach - margin).max(0.0)
            }
            Projection::Orthographic => {
                samples
                    .iter()
                    .map(|corner| corner.z)
                    .fold(f64::INFINITY, f64::min)
                    - margin
            }
        };
        let nearest_front = match view.projection {
            Projection::Perspective => view.near.max(0.0),
            Projection::Orthographic => view.near,
        };
        let in_front = kernels
            .iter()
            .all(|corner| corner.z > nearest_front + margin);
        Self {
            nearest,
            rect: in_front.then(|| rect(&kernels, view, camera)),
        }
    }
}

/// The tiles of the picture that a box in front of the near plane touches.
fn rect(corners: &[DVec3; 8], view: &GridView, camera: &Camera) -> TileRect {
    let grid = TileGrid::new(camera.width as usize, camera.height as usize);
    let ends = |axis: usize, count: usize| {
        let at = corners.map(|corner| {
            let scale = if view.projection == Projection::Perspective {
                corner.z
            } else {
                1.0
            };
            corner[axis] * view.focal[axis] / scale + view.principal_px[axis]
        });
        let low = at.iter().copied().fold(f64::INFINITY, f64::min) - MARGIN_PX;
        let high = at.iter().copied().fold(f64::NEG_INFINITY, f64::max) + MARGIN_PX;
        let pixel = |p: f64| p.clamp(0.0, count as f64) as u16;
        [pixel(low.floor()), pixel(high.ceil())]
    };
    grid.rect(ends(0, grid.width), ends(1, grid.height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_are_hidden_where_every_tile_of_theirs_is_opaque() {
        let grid = TileGrid::new(16 * 7, 16 * 5);
        let opaque = |tile: usize| tile * 7 % 11 < 8;
        let hiding = Hiding::new(&grid, opaque);
        for (x0, y0) in (0..7u16).flat_map(|x| (0..5u16).map(move |y| (x, y))) {
            for (x1, y1) in (x0..=7).flat_map(|x| (y0..=5).map(move |y| (x, y))) {
                let rect = TileRect { x0, x1, y0, y1 };
                let mut tiles =
                    (y0..y1).flat_map(|y| (x0..x1).map(move |x| usize::from(y * 7 + x)));
                let expected = rect.area() > 0 && tiles.all(opaque);
                assert_eq!(hiding.hides(&rect), expected, "{rect:?}");
            }
        }
        let nothing = Hiding::new(&grid, |_| false);
        assert!(
            !nothing.hides(&TileRect {
                x0: 0,
                x1: 7,
                y0: 0,
                y1: 5
            }),
            "no tile is opaque"
        );
    }
}
