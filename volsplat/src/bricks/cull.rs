//! Culling: bricks outside the view are dropped before they are projected.
//!
//! The view is bounded by five planes in camera space: the near plane and the four sides of the picture, moved out by
//! the reach of the pixel filter. A brick is dropped when its box, grown by the kernel radius, lies wholly behind one
//! of them: never too early, sometimes too late near an edge of the view, where the tiles then drop its samples.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::{Camera, GridView, Projection};

use crate::bricks::cells::CellBrick;
use crate::grid::Bounds;
use crate::stats::FrameStats;

/// Pixels around the picture from which a point still reaches into it (the pixel filter has four taps).
const MARGIN_PX: f64 = 2.0;

/// The part of the world that a camera sees, as planes in the grid: inside where normal . p + offset > 0.
#[derive(Clone, Debug)]
pub(crate) struct ViewVolume {
    planes: [(DVec3, f64); 5],
    radius: f64,
}

impl ViewVolume {
    /// The view of `camera`, whose view of the grid is `view`, for kernels of this radius (grid units).
    pub(crate) fn new(camera: &Camera, view: &GridView, radius: f64) -> Self {
        let (left, right) = (
            -MARGIN_PX - camera.cx,
            f64::from(camera.width) + MARGIN_PX - camera.cx,
        );
        let (top, bottom) = (
            -MARGIN_PX - camera.cy,
            f64::from(camera.height) + MARGIN_PX - camera.cy,
        );
        // A point is right of the left side where fx x / z > left: fx x - left z > 0 in front of the eye.
        let side = |axis: DVec3, bound: f64, sign: f64| match camera.projection {
            Projection::Perspective => (sign * (axis - bound * DVec3::Z), 0.0),
            Projection::Orthographic => (sign * axis, -sign * bound),
        };
        let (x, y) = (DVec3::X * camera.fx, DVec3::Y * camera.fy);
        let in_camera = [
            (DVec3::Z, -camera.near),
            side(x, left, 1.0),
            side(x, right, -1.0),
            side(y, top, 1.0),
            side(y, bottom, -1.0),
        ];
        let map = view.camera_from_grid;
        let planes = in_camera.map(|(normal, offset)| {
            (
                map.matrix3.transpose() * normal,
                offset + normal.dot(map.translation),
            )
        });
        Self { planes, radius }
    }

    /// Returns true if any of the brick's kernels may reach into the view.
    pub(crate) fn sees(&self, bounds: &Bounds) -> bool {
        let corners = bounds.corners_in_grid(self.radius);
        self.planes
            .iter()
            .all(|(normal, offset)| corners.iter().any(|c| normal.dot(*c) + offset > 0.0))
    }

    /// Returns true if the kernel of a sample at this grid position may reach into the view.
    pub(crate) fn sees_ball(&self, pos_in_grid: DVec3) -> bool {
        self.planes
            .iter()
            .all(|(n, offset)| n.dot(pos_in_grid) + offset + self.radius * n.length() > 0.0)
    }
}

/// A brick of either kind, as culling and chunking see it.
pub(crate) trait BrickOfSamples: Sync {
    /// Where its samples lie.
    fn bounds(&self) -> &Bounds;
    /// How many there are.
    fn sample_count(&self) -> usize;
}

impl BrickOfSamples for CellBrick {
    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Cells in the box of the visible ones: what a brick out of view spares.
    fn sample_count(&self) -> usize {
        let [low, high] = self.bounds.range();
        (0..3)
            .map(|axis| usize::from(high[axis] - low[axis]))
            .product()
    }
}

/// The bricks that may reach into the view; the samples of the others are counted as culled.
pub(crate) fn visible_bricks<B: BrickOfSamples>(
    bricks: &[B],
    view_volume: &ViewVolume,
    stats: &mut FrameStats,
) -> Vec<usize> {
    let clock = StageClock::start();
    let seen: Vec<bool> = bricks
        .par_iter()
        .map(|brick| view_volume.sees(brick.bounds()))
        .collect();
    let (visible, hidden): (Vec<usize>, Vec<usize>) = (0..bricks.len()).partition(|&i| seen[i]);
    stats.bricks_outside += hidden.len() as u64;
    stats.culled += hidden
        .iter()
        .map(|&i| bricks[i].sample_count() as u64)
        .sum::<u64>();
    stats.stages.cull += clock.stop();
    visible
}
