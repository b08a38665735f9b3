//! The warping equation: where a reference pixel with a known depth lies on another screen.
//!
//! With generalised disparity d (1/z for a pinhole reference, z for parallel rays) the homogeneous screen position is
//! linear in (x, y, 1, d): four coefficients a row (McMillan 1997, chapter 3). So along a row of the reference it
//! costs one addition a coordinate, plus the disparity's column. A running sum drifts by half a unit in the last place
//! a step, so it is started anew after as many steps as keep the drift under [`DRIFT_PX`]. Planes are linear in d at any
//! slope, which is what surfaces are found by.
//!
//! Limits: cameras are pinhole or parallel; everything here is f64.

use fearless_simd::f64x8;
use fearless_simd::prelude::*;
use glam::{DVec2, DVec3, DVec4};
use resample_core::{Camera, Projection};

/// Largest drift that a running sum may gather before it is started anew, px: far below what f32 keeps of a position.
pub const DRIFT_PX: f64 = 1e-9;

/// A warp from the pixels of one camera to the screen of another.
#[derive(Clone, Copy, Debug)]
pub struct Warp {
    /// Per unit of x, y, 1 and d: screen x, screen y, their divisor, and the depth's numerator.
    rows: [DVec4; 4],
    /// Constant and slope in d of the depth's divisor.
    depth_divisor: [f64; 2],
    /// Reference width, height.
    size: [u32; 2],
    target: Projection,
    near: f64,
}

/// A sample on the target's screen, homogeneous.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warped {
    /// Screen x times `divisor`, screen y times `divisor`.
    pub scaled_px: DVec2,
    /// Divisor of the screen position; above 0 in front of the eye.
    pub divisor: f64,
    /// Camera z of the target, world units.
    pub depth: f64,
}

/// Warps the samples of one row, left to right, by addition.
#[derive(Clone, Copy, Debug)]
pub struct RowWarp<'a> {
    warp: &'a Warp,
    y: f64,
    x: u32,
    restart_after: u32,
    until_restart: u32,
    sum: DVec4,
}

impl Warp {
    /// The warp from `reference` to `target`.
    pub fn new(reference: &Camera, target: &Camera) -> Self {
        let pose = target.camera_from_world * reference.camera_from_world.inverse();
        // A sample is (v, w) in homogeneous camera space of the target; each column is what x, y, 1 and d add to it.
        let x = pose.matrix3.x_axis / reference.fx;
        let y = pose.matrix3.y_axis / reference.fy;
        let centre = -reference.cx * x - reference.cy * y;
        let (one, disparity, depth_divisor) = match reference.projection {
            Projection::Perspective => (centre + pose.matrix3.z_axis, pose.translation, [0.0, 1.0]),
            Projection::Orthographic => {
                (centre + pose.translation, pose.matrix3.z_axis, [1.0, 0.0])
            }
        };
        let row =
            |axis: DVec3| DVec4::new(axis.dot(x), axis.dot(y), axis.dot(one), axis.dot(disparity));
        let weight = DVec4::new(0.0, 0.0, depth_divisor[0], depth_divisor[1]);
        let depth = row(DVec3::Z);
        let divisor = match target.projection {
            Projection::Perspective => depth,
            Projection::Orthographic => weight,
        };
        let screen =
            |focal: f64, principal: f64, axis: DVec3| focal * row(axis) + principal * divisor;
        Self {
            rows: [
                screen(target.fx, target.cx, DVec3::X),
                screen(target.fy, target.cy, DVec3::Y),
                divisor,
                depth,
            ],
            depth_divisor,
            size: [reference.width, reference.height],
            target: target.projection,
            near: target.near,
        }
    }

    /// The warped position of the reference's screen position `pos_in_reference` (px, centres at +0.5) at generalised
    /// disparity `disparity`: the direct form.
    pub fn at(&self, pos_in_reference: DVec2, disparity: f64) -> Warped {
        let along = DVec4::new(pos_in_reference.x, pos_in_reference.y, 1.0, disparity);
        self.warped(
            DVec4::from_array(self.rows.map(|row| row.dot(along))),
            disparity,
        )
    }

    /// The samples of row `y`, from the left.
    pub fn row(&self, y: u32) -> RowWarp<'_> {
        let restart_after = self.steps_between_restarts();
        let mut row = RowWarp {
            warp: self,
            y: f64::from(y) + 0.5,
            x: 0,
            restart_after,
            until_restart: 0,
            sum: DVec4::ZERO,
        };
        row.restart();
        row
    }

    /// Steps after which a running sum is started anew.
    ///
    /// Each addition rounds by at most half a unit in the last place of the sum. A sum is at most as large as its
    /// coefficients allow over the picture, and the screen position is its quotient with a divisor that is of the size
    /// of its own largest coefficient, so the drift in pixels is at most steps * 2^-53 * (1 + |sum| / |divisor|).
    pub fn steps_between_restarts(&self) -> u32 {
        let reach = |row: DVec4| {
            row.x.abs() * f64::from(self.size[0])
                + row.y.abs() * f64::from(self.size[1])
                + row.z.abs()
        };
        let size = reach(self.rows[0]).max(reach(self.rows[1]));
        let divisor = reach(self.rows[2]).max(f64::MIN_POSITIVE);
        let per_step = 0.5 * f64::EPSILON * (1.0 + size / divisor);
        (DRIFT_PX / per_step).clamp(1.0, f64::from(self.size[0].max(1))) as u32
    }

    /// The disparity column: what a unit of disparity adds to screen x, screen y and divisor.
    pub fn disparity_column(&self) -> DVec3 {
        DVec3::new(self.rows[0].w, self.rows[1].w, self.rows[2].w)
    }

    /// The columns of x, y and 1.
    pub fn pixel_columns(&self) -> [DVec3; 3] {
        let column = |i: usize| DVec3::new(self.rows[0][i], self.rows[1][i], self.rows[2][i]);
        [column(0), column(1), column(2)]
    }

    /// The terms of depth: coefficients of x, y, 1 and disparity, and constant and slope in disparity of their divisor.
    pub fn depth_terms(&self) -> ([f64; 4], [f64; 2]) {
        (self.rows[3].to_array(), self.depth_divisor)
    }

    /// The target's projection and its near plane, world units.
    pub(crate) fn target(&self) -> (Projection, f64) {
        (self.target, self.near)
    }

    /// Returns true if a warped sample is in front of the near plane.
    pub fn in_front(&self, warped: &Warped) -> bool {
        let before = match self.target {
            Projection::Perspective => warped.divisor > 0.0,
            Projection::Orthographic => true,
        };
        before && warped.depth >= self.near && warped.divisor.is_finite()
    }

    /// How near a depth is: linear over the screen on a plane, larger is nearer (1/z, or -z for parallel rays).
    pub fn nearness(&self, depth: f64) -> f64 {
        match self.target {
            Projection::Perspective => 1.0 / depth,
            Projection::Orthographic => -depth,
        }
    }

    /// The depth of a nearness.
    pub fn depth(&self, nearness: f64) -> f64 {
        match self.target {
            Projection::Perspective => 1.0 / nearness,
            Projection::Orthographic => -nearness,
        }
    }

    /// The depths of eight nearnesses.
    #[inline(always)]
    pub(crate) fn depths<S: Simd>(&self, simd: S, nearness: f64x8<S>) -> f64x8<S> {
        match self.target {
            Projection::Perspective => f64x8::splat(simd, 1.0) / nearness,
            Projection::Orthographic => -nearness,
        }
    }

    fn warped(&self, sums: DVec4, disparity: f64) -> Warped {
        let depth_divisor = self.depth_divisor[0] + self.depth_divisor[1] * disparity;
        Warped {
            scaled_px: DVec2::new(sums.x, sums.y),
            divisor: sums.z,
            depth: sums.w / depth_divisor,
        }
    }
}

impl Warped {
    /// The screen position, px.
    pub fn pos_in_screen(&self) -> DVec2 {
        self.scaled_px / self.divisor
    }
}

impl RowWarp<'_> {
    /// The next sample of the row, at this disparity.
    pub fn next(&mut self, disparity: f64) -> Warped {
        if self.until_restart == 0 {
            self.restart();
        }
        let warp = self.warp;
        let column = DVec4::new(
            warp.rows[0].w,
            warp.rows[1].w,
            warp.rows[2].w,
            warp.rows[3].w,
        );
        let warped = warp.warped(self.sum + disparity * column, disparity);
        self.sum += DVec4::new(
            warp.rows[0].x,
            warp.rows[1].x,
            warp.rows[2].x,
            warp.rows[3].x,
        );
        self.x += 1;
        self.until_restart -= 1;
        warped
    }

    fn restart(&mut self) {
        let along = DVec4::new(f64::from(self.x) + 0.5, self.y, 1.0, 0.0);
        self.sum = DVec4::from_array(self.warp.rows.map(|row| row.dot(along)));
        self.until_restart = self.restart_after;
    }
}

/// Generalised disparity of a depth: 1/z for a pinhole, z for parallel rays; `None` where nothing is known.
///
/// Infinite depth is a direction: disparity 0 for a pinhole, and unknown for parallel rays.
pub fn disparity(projection: Projection, depth: f32) -> Option<f32> {
    let disparity = match projection {
        Projection::Perspective => 1.0 / depth,
        Projection::Orthographic => depth,
    };
    // Depths so small that 1/z overflows are as good as 0.
    (depth > 0.0 && disparity.is_finite()).then_some(disparity)
}
