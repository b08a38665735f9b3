//! Bricks of one colour, seen from afar: which of them a ray crosses in one long step.
//!
//! Takes a brick's range of scalars and its size on the screen. Where the transfer function gives all its scalars one
//! colour and one extinction, and a voxel is small on the screen, the planes that a ray crosses inside are counted
//! (`uniform_walk`) and composited at once: the same picture to rounding, in a fraction of the time.

use glam::DVec3;
use resample_core::{Camera, GridView, OpacityMode, Projection};

use crate::bricks::cells::{CELL_SIDE, CellBrick};
use crate::look::options::{RenderOptions, Shading};
use crate::slabs::table::TransferTable;

/// Pixels a voxel from which on bricks are sampled on every plane: a long step then saves less than it costs.
const MOST_PX: f64 = 0.3;

/// Parts of the greatest colour and of the extinction that a step counts in.
const CODES: f32 = u16::MAX as f32;

/// Colour and extinction of a whole brick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Uniform {
    /// Linear red, green, blue, and strength per opacity unit.
    pub(crate) value: [f32; 4],
}

/// The bricks of one frame that are crossed in one step.
#[derive(Clone, Debug)]
pub(crate) struct UniformChoice {
    /// Pixels (not sub-pixels) of a grid step of the longest axis: per unit of 1 / camera z, or everywhere.
    focal_px: f64,
    projection: Projection,
}

impl UniformChoice {
    /// The choice for a frame of samples that are only classified and composited; `None` where light or the opacity
    /// mode make a step differ from its planes.
    pub(crate) fn new(options: &RenderOptions, view: &GridView, camera: &Camera) -> Option<Self> {
        if options.shading != Shading::None || options.opacity != OpacityMode::Extinction {
            return None;
        }
        let axes = view.camera_from_grid.matrix3;
        let longest = axes
            .x_axis
            .length()
            .max(axes.y_axis.length())
            .max(axes.z_axis.length());
        Some(Self {
            focal_px: camera.fx.max(camera.fy) * longest,
            projection: view.projection,
        })
    }

    /// Pixels of a voxel at a place in camera space, at most `reach` (world units) nearer.
    fn voxel_px(&self, in_camera: DVec3, reach: f64) -> f64 {
        match self.projection {
            Projection::Orthographic => self.focal_px,
            Projection::Perspective => {
                let z = in_camera.z - reach;
                // Off the axis a voxel is stretched by the secant.
                if z > 0.0 {
                    self.focal_px / z * (in_camera.length() / in_camera.z)
                } else {
                    f64::INFINITY
                }
            }
        }
    }

    /// The colour of a brick that is crossed in one step; `None` where its planes are sampled.
    pub(crate) fn of_brick(
        &self,
        view: &GridView,
        table: &TransferTable,
        brick: &CellBrick,
    ) -> Option<Uniform> {
        let half = 0.5 * CELL_SIDE as f64;
        let middle = DVec3::from(brick.bounds.corner.map(f64::from)) + half;
        let depths = view.camera_from_grid.matrix3.transpose().z_axis;
        let reach = half * depths.abs().element_sum();
        let px = self.voxel_px(view.camera_from_grid.transform_point3(middle), reach);
        // Written so that a size that is not a number takes every plane.
        if brick.mask.is_some() || !(px < MOST_PX) {
            return None;
        }
        table.constant_over(brick.range).map(Uniform::new)
    }
}

impl Uniform {
    fn new(value: [f32; 4]) -> Self {
        let colour = value[0].max(value[1]).max(value[2]).max(f32::MIN_POSITIVE);
        let most = [colour, colour, colour, value[3].max(f32::MIN_POSITIVE)];
        let mut rounded = [0.0; 4];
        for channel in 0..4 {
            let unit = most[channel] / CODES;
            let code = (value[channel] / unit).round() as u16;
            rounded[channel] = f32::from(code) * unit;
        }
        Self { value: rounded }
    }
}
