//! Settings that the tiles of a frame share, and one brick in one tile: takes a scene, options and a camera, returns the values that every
//! tile reads.
//!
//! A brick of one colour, seen from afar, is crossed in one step. Where the transfer function gives all scalars of a brick one
//! colour and one extinction, and a voxel is small on the screen, the planes that a ray crosses inside are counted
//! (`constant_walk`) and composited at once: the same picture to rounding, in a fraction of the time.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;
use resample_core::{Camera, GridView, OpacityMode, Projection, Stop};

use crate::bricks::cells::{CELL_SIDE, CellBrick, FromDifferences};
use crate::field::surfaces::{Spans, Surfaces};
use crate::light::Gains;
use crate::look::clip::{AnchoredHalfSpace, GridClip};
use crate::look::options::{RenderOptions, Shading};
use crate::picture::Means;
use crate::shadow::coarse::CoarseField;
use crate::shadow::tables::{BrickLight, Reaching};
use crate::slabs::settings::{Anchor, ChannelSettings, Reading, SheetSettings};
use crate::slabs::table::TransferTable;
use crate::slabs::view::TileView;

/// The settings of an isosurface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IsoSettings {
    pub(crate) value: f32,
    /// Linear.
    pub(crate) rgb: [f32; 3],
    /// Of the surface, 0..=1.
    pub(crate) opacity: f32,
    /// Longest step along camera z.
    pub(crate) step: f32,
}

/// The rays of a tile's pixels in the grid, relative to the anchor; their parameter is camera z relative to the anchor's.
#[derive(Clone, Debug)]
pub(crate) struct AnchoredRays {
    /// Of the near plane.
    pub(crate) near: f32,
    pub(crate) start: [TilePlane; 3],
    pub(crate) direction: [TilePlane; 3],
}

impl AnchoredRays {
    /// The rays of a tile.
    pub(crate) fn new(tile: &TileView, anchor: &Anchor) -> Self {
        let (view, corner_px) = (tile.camera(), tile.corner);
        let zero = [[[0.0; TILE_PX]; TILE_PX]; 3];
        let mut rays = Self {
            near: (view.near - anchor.camera_z) as f32,
            start: zero,
            direction: zero,
        };
        for y in 0..TILE_PX {
            for x in 0..TILE_PX {
                let (origin, direction) =
                    view.ray(corner_px + DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
                let start = origin - anchor.grid + anchor.camera_z * direction;
                for axis in 0..3 {
                    rays.start[axis][y][x] = start[axis] as f32;
                    rays.direction[axis][y][x] = direction[axis] as f32;
                }
            }
        }
        rays
    }
}

/// The scalar of a ray that is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Statistic {
    Greatest,
    Least,
    Mean,
}

/// Values of a tile's rays so far, of one channel.
#[derive(Clone, Debug)]
pub(crate) struct RayValues {
    /// The greatest or least scalar, or the sum of all.
    pub(crate) values: TilePlane,
    /// Camera z of that sample, or the sum of all.
    pub(crate) depths: TilePlane,
    /// Samples.
    pub(crate) counts: TilePlane,
}

impl RayValues {
    pub(crate) fn new(statistic: Statistic) -> Self {
        let zero = [[0.0; TILE_PX]; TILE_PX];
        let start = match statistic {
            Statistic::Greatest => f32::NEG_INFINITY,
            Statistic::Least => f32::INFINITY,
            Statistic::Mean => 0.0,
        };
        Self {
            values: [[start; TILE_PX]; TILE_PX],
            depths: zero,
            counts: zero,
        }
    }
}

/// The values of all channels before any sample; none where no statistic is shown.
pub(crate) fn at_start(
    statistic: Option<Statistic>,
    channels: &[ChannelSettings],
) -> Vec<RayValues> {
    statistic.map_or(Vec::new(), |statistic| {
        channels.iter().map(|_| RayValues::new(statistic)).collect()
    })
}

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

/// Settings shared by every tile of a frame.
#[derive(Clone, Debug)]
pub(crate) struct FieldSettings {
    pub(crate) sheets: SheetSettings,
    /// The clip, relative to the anchor.
    pub(crate) clip: Vec<AnchoredHalfSpace>,
    /// All channels; the table of the first is that of the sheets too.
    pub(crate) channels: Arc<[ChannelSettings]>,
    /// How differences of bytes become gradients.
    pub(crate) from_differences: FromDifferences,
    /// Where the pixels show a statistic of their rays: which.
    pub(crate) statistic: Option<Statistic>,
    /// Segments of a ray in a cell, where the transfer function is integrated between samples.
    pub(crate) segments: u32,
    /// Where a surface is drawn: which.
    pub(crate) iso: Option<IsoSettings>,
    /// Factors of the light where shadows or occlusion are drawn.
    pub(crate) gains: Gains,
}

/// One frame's camera, at sub-pixel resolution, and settings.
pub(crate) struct FieldFrame<'a> {
    pub(crate) settings: &'a FieldSettings,
    pub(crate) view: &'a GridView,
    pub(crate) camera: &'a Camera,
    pub(crate) clip: &'a GridClip,
    pub(crate) light: &'a Reaching,
    /// Where light is found on a coarser grid: that.
    pub(crate) coarse: Option<&'a CoarseField>,
    pub(crate) subpixels: u32,
    pub(crate) means: Means,
    /// The bricks of one colour that are crossed in one step.
    pub(crate) uniform: Option<UniformChoice>,
    /// Surfaces that stand in the field.
    pub(crate) surfaces: Surfaces<'a>,
    /// Tiles are left out once it is asked for.
    pub(crate) stop: &'a Stop,
}

impl FieldFrame<'_> {
    /// The colour of a brick that is crossed in one step.
    pub(crate) fn uniform(&self, brick: &CellBrick) -> Option<Uniform> {
        let choice = self.uniform.as_ref()?;
        choice.of_brick(self.view, &self.settings.sheets.table, brick)
    }
}

/// The rule for samples: the least one that the settings need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rule {
    Over,
    Shaded,
    Mixed,
    Statistic,
}

impl FieldSettings {
    /// The rule of these settings.
    pub(crate) fn rule(&self) -> Rule {
        let is_plain = self.is_one_channel() && self.sheets.gradient_curve.is_none();
        match (self.statistic.is_some(), is_plain, self.is_lit()) {
            (true, ..) => Rule::Statistic,
            (_, false, _) => Rule::Mixed,
            (_, true, true) => Rule::Shaded,
            (_, true, false) => Rule::Over,
        }
    }

    /// Returns true if light falls on samples.
    pub(crate) fn is_lit(&self) -> bool {
        self.sheets.shade.is_some() || !self.gains.is_none()
    }

    /// Returns true if there is one channel, of scalars.
    fn is_one_channel(&self) -> bool {
        self.channels.len() == 1 && self.channels[0].reading == Reading::Trilinear
    }

    /// Returns true if samples are only classified and composited: not lit, mixed, or searched for a surface.
    pub(crate) fn is_plain(&self) -> bool {
        !self.walks_rays() && self.rule() == Rule::Over
    }

    /// Returns true if bricks are walked along rays, instead of plane by plane.
    pub(crate) fn walks_rays(&self) -> bool {
        let is_integrated = matches!(self.rule(), Rule::Over | Rule::Shaded)
            && self.sheets.table.integrals().is_some();
        self.iso.is_some() || is_integrated
    }
}

/// A brick as the tiles need it, from the view alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedBrick<'a> {
    pub(crate) brick: &'a CellBrick,
    /// Where it is crossed in one step: its colour.
    pub(crate) uniform: Option<Uniform>,
    /// The light at its vertices, where shadows or occlusion are drawn.
    pub(crate) light: BrickLight<'a>,
    /// Planes first..end that cut the box of its visible cells.
    pub(crate) planes: [u32; 2],
    /// Pixel columns first..end and rows first..end that the box covers.
    pub(crate) columns: [u16; 2],
    pub(crate) rows: [u16; 2],
    /// The half-spaces of the clip that cut the box, by their bits.
    pub(crate) cuts: u32,
}

/// A brick, with the frame's settings and the tile's view.
#[derive(Clone, Copy)]
pub(crate) struct TileContext<'a> {
    pub(crate) settings: &'a FieldSettings,
    pub(crate) view: &'a TileView,
    pub(crate) placed: &'a PlacedBrick<'a>,
    /// The tile's rays in the grid; only where bricks are walked along them.
    pub(crate) rays: Option<&'a AnchoredRays>,
    /// The parts of the rays that are drawn; only where surfaces cut those in the brick.
    pub(crate) spans: Option<&'a Spans>,
}
