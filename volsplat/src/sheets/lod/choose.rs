//! What a brick is drawn from in one frame: a look-up from its size on the screen.

use glam::DVec3;
use resample_core::{Camera, GridView, OpacityMode, Projection};

use super::blocks::Detail;
use super::samples::Stray;
use super::{Choice, LEVELS, Merged, STRIDES, Stride};
use crate::cells::{CELL_SIDE, CellBrick};
use crate::options::{RenderOptions, Shading};

/// Pixels a voxel from which on nothing is replaced. At half a pixel blocks of two cells are as large as a pixel, so
/// that nothing averages out, and sheets that are skipped save less than the look at the bricks costs.
const MOST_PX: f64 = 0.3;

/// Share of a block's spread that does not average out over a pixel, per pixel that a block is wide. Calibrated.
const BLOCK_SHARE: f64 = 0.5;

/// Share of the spread of skipped sheets that does not average out over the rows of a pixel, times the rows.
/// Calibrated.
const SKIP_SHARE: f64 = 0.75;

/// Pixels a voxel down to which details are made. Farther away frames cost little anyway, and the bricks that only such
/// views could replace cost more to look at than all frames of a zoom to there would save.
const LEAST_PX: f64 = 1.0 / 8.0;

/// The least share that is met: of blocks of two cells at that distance, or of skipped sheets at 8 rows a pixel, the most that
/// is chosen by itself.
const LEAST_SHARE: f64 = {
    let (blocks, skipped) = (BLOCK_SHARE * LEAST_PX * 2.0, SKIP_SHARE / 8.0);
    if blocks < skipped { blocks } else { skipped }
};

/// Factor on every predicted change. Calibrated: at 1 the largest change was 0.95 times the bound in the scenes that
/// the shares were fitted to.
const SAFETY: f64 = 2.0;

/// The least bound at which bricks that vary are looked at. A guess between two measurements: at 1/512 real volumes saved
/// nothing and the smoothest one earned its look back after thirty frames, at 1/128 after seven.
const LEAST_LOOKED_AT: f64 = 1.0 / 256.0;

/// Thickness of the sheets that the spreads of skipping were measured with, voxels.
const MEASURED_SLAB: f64 = 0.5;

/// The level of detail of one frame.
#[derive(Clone, Debug)]
pub(crate) struct LevelChoice {
    lod_error: f64,
    /// Pixels (not sub-pixels) of a grid step of the longest axis: per unit of 1 / camera z, or everywhere.
    focal_px: f64,
    /// Opacity units of the longest grid step.
    units: f64,
    /// Sheets of this frame in a sheet of the measured thickness, inverted and rounded up.
    slabs: usize,
    subpixels: u32,
    projection: Projection,
}

impl LevelChoice {
    /// The choice for a frame; `None` where nothing may be replaced.
    pub(crate) fn new(
        options: &RenderOptions,
        view: &GridView,
        (camera, subpixels): (&Camera, u32),
        unit_in_world: f64,
    ) -> Option<Self> {
        let possible = options.lod_error > 0.0
            && options.shading == Shading::None
            && options.opacity == OpacityMode::Extinction;
        if !possible {
            return None;
        }
        let axes = view.camera_from_grid.matrix3;
        let longest = axes
            .x_axis
            .length()
            .max(axes.y_axis.length())
            .max(axes.z_axis.length());
        Some(Self {
            lod_error: f64::from(options.lod_error),
            focal_px: camera.fx.max(camera.fy) * longest,
            units: longest / unit_in_world,
            slabs: (options.slab_voxels / MEASURED_SLAB).ceil().max(1.0) as usize,
            subpixels,
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

    /// Whether something in a box of the grid may be replaced.
    pub(crate) fn wants(&self, view: &GridView, [low, high]: [DVec3; 2]) -> bool {
        (0..8).any(|i| {
            let corner = DVec3::new(
                if i & 1 == 0 { low.x } else { high.x },
                if i & 2 == 0 { low.y } else { high.y },
                if i & 4 == 0 { low.z } else { high.z },
            );
            self.voxel_px(view.camera_from_grid.transform_point3(corner), 0.0) < MOST_PX
        })
    }

    /// Whether something with this stray may be used in any view down to [`LEAST_PX`] pixels a voxel; `None` where looking
    /// costs more than it saves.
    pub(crate) fn ever_useful(&self) -> Option<impl Fn(Stray) -> bool + Sync + use<>> {
        let bound = self.lod_error;
        let useful = move |stray: Stray| {
            let spread = f64::from(stray.spread);
            SAFETY * (LEAST_SHARE * spread + 0.5 * spread * spread) <= bound
        };
        (bound >= LEAST_LOOKED_AT).then_some(useful)
    }

    /// What a brick is drawn from.
    pub(crate) fn choice<'a>(
        &self,
        view: &GridView,
        brick: &CellBrick,
        detail: &'a Detail,
    ) -> Choice<'a> {
        let half = 0.5 * CELL_SIDE as f64;
        let middle = DVec3::from(brick.bounds.corner.map(f64::from)) + half;
        let reach = half
            * view
                .camera_from_grid
                .matrix3
                .transpose()
                .z_axis
                .abs()
                .element_sum();
        let px = self.voxel_px(view.camera_from_grid.transform_point3(middle), reach);
        // Written so that a size that is no number replaces nothing.
        if brick.mask.is_some() || !(px < MOST_PX) {
            return Choice::EverySheet;
        }
        // Blocks of two cells cost about as much as every fourth sheet.
        match (self.level(detail, px), self.stride(detail)) {
            (Some(merged), stride) if merged.level > 1 || stride < 4 => Choice::Merged(merged),
            (_, stride @ 2..) => Choice::Skipping(Stride(stride)),
            _ => Choice::EverySheet,
        }
    }

    /// The coarsest level of blocks.
    fn level<'a>(&self, detail: &'a Detail, voxel_px: f64) -> Option<Merged<'a>> {
        let blocks = detail.blocks.as_deref()?;
        let fits = |&level: &usize| {
            let stray = blocks.strays[level];
            let share = (BLOCK_SHARE * voxel_px * (2 << level) as f64).min(1.0);
            let change =
                self.change(stray.spread, share, detail) + f64::from(stray.drift) * self.units;
            SAFETY * change <= self.lod_error
        };
        (0..LEVELS).rev().find(fits).map(|level| Merged {
            level: level + 1,
            blocks,
        })
    }

    /// The greatest stride over sheets; 1 takes every sheet.
    fn stride(&self, detail: &Detail) -> u32 {
        let fits = |&i: &usize| {
            let stride = 2usize << i;
            // A pixel must hold rows of every phase.
            if stride > self.subpixels as usize {
                return false;
            }
            let Some(measured) = (stride * self.slabs).next_power_of_two().checked_ilog2() else {
                return false;
            };
            let Some(&spread) = detail.skip_spreads.get(measured as usize - 1) else {
                return false;
            };
            let rows = f64::from(self.subpixels);
            SAFETY * self.change(spread, SKIP_SHARE / rows, detail) <= self.lod_error
        };
        (0..STRIDES).rev().find(fits).map_or(1, |i| 2 << i)
    }

    /// Predicted change of a pixel over the opacity of the brick.
    fn change(&self, spread: f32, share: f64, detail: &Detail) -> f64 {
        // Depth over opacity is at most 1 + depth.
        let spread = f64::from(spread) * (1.0 + f64::from(detail.depth) * self.units);
        share * spread + 0.5 * spread * spread
    }
}
