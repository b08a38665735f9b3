//! The frame of the image-sheets order: slabs, the camera per tile, and the projection of voxels.
//!
//! Slabs are parallel to the image plane and equally thick; the plane of slab k is at camera z = (k + 1/2) thickness,
//! fixed to the eye, so that nothing pops when the view turns. On such a plane a pixel's position in the grid is an
//! affine function of the pixel: three vectors a plane are all that a section needs.

use resample_core::simd::Vectors;
use std::sync::Arc;

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, i32x4};
use glam::{DMat3, DVec2, DVec3, Vec3};
use resample_core::composite::DepthRule;
use resample_core::maps::TilePlane;
use resample_core::tile::{TILE_PX, TileGrid, TileRect};
use resample_core::{Camera, GridView, OpacityMode, Projection};

use super::cell_sample::{HalfRow, LANES};
use super::channel::ChannelSettings;
use super::classify::TransferTable;
use super::isosurface::{AnchoredRays, IsoSettings};
use super::section::SectionTable;
use super::statistic::Statistic;
use crate::clip::AnchoredHalfSpace;
use crate::shade::{GradientRamp, ShadeSettings};

/// A point in the middle of the field. Positions on planes and of voxels are taken relative to it, in f64 once per
/// plane and once per brick, so that the weights of a cell sum to 1 however far the eye is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor {
    /// A whole grid position: voxels are then whole numbers away.
    pub(crate) grid: DVec3,
    /// Its camera z, world units.
    pub(crate) camera_z: f64,
}

/// What every tile of a frame shares.
#[derive(Clone, Debug)]
pub(crate) struct SheetSettings {
    pub(crate) level: Vectors,
    pub(crate) table: TransferTable,
    /// Sections of a kernel.
    pub(crate) sections: SectionTable,
    /// Sections of a whole brick of cells, from its middle.
    pub(crate) brick_sections: SectionTable,
    pub(crate) anchor: Anchor,
    /// The clip, relative to the anchor.
    pub(crate) clip: Vec<AnchoredHalfSpace>,
    /// Slab thickness along camera z, world units.
    pub(crate) thickness: f64,
    /// Planes that are open at a time: a power of two, and at least what one kernel may span.
    pub(crate) ring_len: usize,
    /// All channels; the table of the first is `table` too.
    pub(crate) channels: Arc<[ChannelSettings]>,
    /// Where extinction follows the gradient: how.
    pub(crate) gradient_ramp: Option<GradientRamp>,
    /// Where the pixels show a statistic of their rays: which.
    pub(crate) statistic: Option<Statistic>,
    /// Where a surface is drawn: which.
    pub(crate) iso: Option<IsoSettings>,
    /// World length over which the transfer function's opacity is meant.
    pub(crate) unit_in_world: f64,
    pub(crate) opacity: OpacityMode,
    /// Where samples are lit: how.
    pub(crate) shade: Option<ShadeSettings>,
    pub(crate) world_from_camera: DMat3,
    pub(crate) depth: DepthRule,
    pub(crate) min_transmittance: f32,
}

/// The camera of one tile.
#[derive(Clone, Debug)]
pub(crate) struct TileView {
    view: GridView,
    anchor: Anchor,
    thickness: f64,
    /// The tile's first pixel: its corner, not its centre.
    corner_px: DVec2,
    /// Opacity units along each pixel's ray through one slab.
    pub(crate) units_per_slab: TilePlane,
    /// Unit direction of each pixel's ray, in the world; only where samples are lit.
    pub(crate) ray_in_world: [TilePlane; 3],
    /// Rays in the grid; only where a surface is drawn.
    pub(crate) iso_rays: Option<Box<AnchoredRays>>,
}

/// One plane over one tile: an affine map from pixels to the grid.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct PlaneView {
    /// Change of the grid position over the lanes: lane times the step per pixel along x, for each grid axis.
    pub(crate) lanes: [[f32; TILE_PX]; 3],
    /// Grid position of the centre of the tile's first pixel, relative to the anchor.
    pub(crate) first: [f32; 4],
    /// Change of the grid position per pixel along y.
    pub(crate) step_y: [f32; 4],
    /// From a camera x, y, x, y to tile pixels, so that the first covered pixel is the number rounded up.
    pub(crate) pixel_scale: [f32; 4],
    /// Added after the scale, with the margin of boxes.
    pub(crate) pixel_shift: [f32; 4],
    /// Camera z relative to the anchor's.
    pub(crate) offset_z: f32,
    /// Camera z.
    pub(crate) camera_z: f32,
}

impl SheetSettings {
    /// Whether what is seen depends on the gradient.
    pub(crate) fn needs_gradients(&self) -> bool {
        self.shade.is_some() || self.gradient_ramp.is_some()
    }

    /// The slab, fractional, whose plane lies at a camera z.
    pub(crate) fn plane_from_z(&self, z: f64) -> f64 {
        z / self.thickness - 0.5
    }

    /// The sections of bricks of this many cells along a side, from their middle, with the margin.
    pub(crate) fn of_bricks(camera_from_grid: DMat3, cells: usize) -> SectionTable {
        SectionTable::of_cube(camera_from_grid * (0.5 * cells as f64 + BOX_MARGIN))
    }

    /// The margin of a box along camera z, world units: as far as its corners move when it grows by the margin.
    pub(crate) fn margin_z(&self) -> f64 {
        BOX_MARGIN * f64::from(self.sections.reach_z)
    }

    /// Length of the ring: a power of two that holds the planes that a kernel of these sections may span.
    pub(crate) fn ring_len(sections: &SectionTable, thickness: f64) -> usize {
        ((2.0 * f64::from(sections.reach_z) / thickness).floor() as usize + 2).next_power_of_two()
    }
}

impl TileView {
    /// The view of the tile whose first pixel is `corner_px`.
    pub(crate) fn new(view: &GridView, corner_px: [usize; 2], settings: &SheetSettings) -> Self {
        let corner = DVec2::new(corner_px[0] as f64, corner_px[1] as f64);
        let mut units_per_slab = [[0.0; TILE_PX]; TILE_PX];
        let per_z = settings.thickness / settings.unit_in_world;
        for (y, row) in units_per_slab.iter_mut().enumerate() {
            for (x, units) in row.iter_mut().enumerate() {
                let pixel = corner + DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                *units = (per_z * ray_length_per_z(view, pixel)) as f32;
            }
        }
        let (anchor, thickness) = (settings.anchor, settings.thickness);
        let mut ray_in_world = [[[0.0; TILE_PX]; TILE_PX]; 3];
        if settings.shade.is_some() {
            fill_rays(&mut ray_in_world, view, corner, &settings.world_from_camera);
        }
        let iso_rays = settings
            .iso
            .map(|_| Box::new(AnchoredRays::new(view, corner, &anchor)));
        Self {
            view: *view,
            anchor,
            thickness,
            corner_px: corner,
            units_per_slab,
            ray_in_world,
            iso_rays,
        }
    }

    /// Unit directions of half a row's rays, in the world.
    #[inline(always)]
    pub(super) fn rays<S: Simd>(&self, simd: S, at: HalfRow) -> [f32x8<S>; 3] {
        let range = at.first..at.first + LANES;
        std::array::from_fn(|axis| {
            f32x8::from_slice(simd, &self.ray_in_world[axis][at.row][range.clone()])
        })
    }

    /// The tile's first pixel.
    pub(crate) fn corner_px(&self) -> [f32; 2] {
        self.corner_px.as_vec2().to_array()
    }

    /// Pixels per pixel of a slab's plane, for a length at the slab's near and far end.
    pub(crate) fn end_scales(&self, number: u32) -> [f32; 2] {
        let camera_z = (f64::from(number) + 0.5) * self.thickness;
        let at = |z: f64| match self.view.projection {
            Projection::Perspective => (camera_z / z) as f32,
            Projection::Orthographic => 1.0,
        };
        // What lies before the near plane is cut off.
        [
            at((camera_z - 0.5 * self.thickness).max(self.view.near)),
            at(camera_z + 0.5 * self.thickness),
        ]
    }

    /// The plane of a slab.
    pub(crate) fn plane(&self, number: u32) -> PlaneView {
        let camera_z = (f64::from(number) + 0.5) * self.thickness;
        let (origin, direction) = self.view.ray(self.corner_px + 0.5);
        let first = origin - self.anchor.grid + camera_z * direction;
        let scale = match self.view.projection {
            Projection::Perspective => camera_z,
            Projection::Orthographic => 1.0,
        };
        let (step_x, step_y) = (scale * self.view.wx, scale * self.view.wy);
        let pixels = self.view.focal / scale;
        let shift = self.view.principal_px - self.corner_px - 0.5;
        let four = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        let ends =
            |low: DVec2, high: DVec2| [low.x as f32, low.y as f32, high.x as f32, high.y as f32];
        PlaneView {
            lanes: step_x
                .to_array()
                .map(|step| std::array::from_fn(|lane| (lane as f64 * step) as f32)),
            first: four(first),
            step_y: four(step_y),
            pixel_scale: ends(pixels, pixels),
            pixel_shift: ends(shift - BOX_MARGIN, shift + BOX_MARGIN),
            offset_z: (camera_z - self.anchor.camera_z) as f32,
            camera_z: camera_z as f32,
        }
    }
}

/// The tile's pixels whose centres lie in a box (least x, y, greatest x, y of the camera): first column and row, end
/// column and row.
#[inline(always)]
pub(crate) fn covered<S: Simd>(simd: S, view: &PlaneView, ends: f32x4<S>) -> [usize; 4] {
    let scale = f32x4::from_slice(simd, &view.pixel_scale);
    let pixels = ends
        .mul_add(scale, f32x4::from_slice(simd, &view.pixel_shift))
        .ceil();
    let tile = pixels
        .max(f32x4::splat(simd, 0.0))
        .min(f32x4::splat(simd, TILE_PX as f32));
    tile.to_int::<i32x4<S>>().to_array().map(|p| p as usize)
}

/// Unit directions, in the world, of the rays of a tile's pixels.
fn fill_rays(rays: &mut [TilePlane; 3], view: &GridView, corner: DVec2, world_from_camera: &DMat3) {
    for y in 0..TILE_PX {
        for x in 0..TILE_PX {
            let offset = corner + DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - view.principal_px;
            let in_camera = match view.projection {
                Projection::Perspective => (offset / view.focal).extend(1.0).normalize(),
                Projection::Orthographic => DVec3::Z,
            };
            for (plane, axis) in rays
                .iter_mut()
                .zip((*world_from_camera * in_camera).to_array())
            {
                plane[y][x] = axis as f32;
            }
        }
    }
}

/// Length of a pixel's ray per unit of camera z.
fn ray_length_per_z(view: &GridView, pixel: DVec2) -> f64 {
    match view.projection {
        Projection::Perspective => ((pixel - view.principal_px) / view.focal)
            .extend(1.0)
            .length(),
        Projection::Orthographic => 1.0,
    }
}

/// What voxels are projected with.
#[derive(Clone, Debug)]
pub(crate) struct SheetProjection {
    view: GridView,
    anchor: Anchor,
    grid: TileGrid,
    axes: [Vec3; 3],
    inverse_thickness: f32,
    thickness: f32,
    /// Plane of the anchor, in planes; fractional.
    anchor_plane: f32,
    /// First plane that is seen.
    first_plane: f32,
    reach_z: f32,
    /// Box of all sections: least x, y, greatest x, y, world units.
    reach: [f32; 4],
    near: f32,
}

/// Boxes on the screen and along the view are wider than what they hold by this much, in pixels and in voxels, so that
/// the rounding of their ends never drops a sample that lies on them: f32 counts 2^17 pixels to 1/128.
const BOX_MARGIN: f64 = 1.0 / 64.0;

/// Planes at whose number a voxel is cut off from a frame: beyond this, f32 no longer counts planes one by one.
const MAX_PLANE: f32 = 8_388_608.0;

impl SheetProjection {
    pub(crate) fn new(view: &GridView, camera: &Camera, settings: &SheetSettings) -> Self {
        let m = view.camera_from_grid.matrix3;
        // Slabs before the near plane are not seen; neither are those behind the eye of an orthographic camera.
        let first_plane = (view.near / settings.thickness).floor().max(0.0);
        Self {
            view: *view,
            anchor: settings.anchor,
            grid: TileGrid {
                width: camera.width as usize,
                height: camera.height as usize,
            },
            axes: [m.x_axis.as_vec3(), m.y_axis.as_vec3(), m.z_axis.as_vec3()],
            inverse_thickness: (1.0 / settings.thickness) as f32,
            thickness: settings.thickness as f32,
            anchor_plane: (settings.anchor.camera_z / settings.thickness - 0.5) as f32,
            first_plane: first_plane as f32,
            reach_z: settings.sections.reach_z,
            reach: settings.sections.whole.ends,
            near: view.near as f32,
        }
    }

    /// The pixels first..end, along one axis, that a voxel's sections may touch between two camera z.
    #[inline(always)]
    fn pixels(&self, camera: f32, z: [f32; 2], axis: usize) -> [u16; 2] {
        let (focal, principal) = (
            self.view.focal[axis] as f32,
            self.view.principal_px[axis] as f32,
        );
        let count = if axis == 0 {
            self.grid.width
        } else {
            self.grid.height
        } as f32;
        let scale = match self.view.projection {
            Projection::Perspective => [focal / z[0], focal / z[1]],
            Projection::Orthographic => [focal; 2],
        };
        let at = |offset: f32| [(camera + offset) * scale[0], (camera + offset) * scale[1]];
        let (low, high) = (at(self.reach[axis]), at(self.reach[axis + 2]));
        let first = (low[0].min(low[1]) + principal - 0.5)
            .ceil()
            .clamp(0.0, count);
        let end = ((high[0].max(high[1]) + principal - 0.5).floor() + 1.0).clamp(0.0, count);
        [first as u16, end as u16]
    }

    /// The first plane that cuts the kernel of a voxel (camera space, z relative to the anchor), and the tiles that its
    /// sections touch; `None` where no picture of it is seen.
    #[inline(always)]
    pub(crate) fn cover(&self, camera: Vec3) -> Option<(u32, TileRect)> {
        // Planes first..=last cut the kernel.
        let plane = |z: f32| z * self.inverse_thickness + self.anchor_plane;
        let first = plane(camera.z - self.reach_z).ceil().max(self.first_plane);
        let last = plane(camera.z + self.reach_z).floor();
        if !(last >= first && last < MAX_PLANE) {
            return None;
        }
        // A slab that the near plane cuts begins there.
        let z = [
            (first * self.thickness).max(self.near),
            (last + 1.0) * self.thickness,
        ];
        let rect = self
            .grid
            .rect(self.pixels(camera.x, z, 0), self.pixels(camera.y, z, 1));
        (rect.area() > 0).then_some((first as u32, rect))
    }

    /// Camera space position of a grid position, z relative to the anchor.
    #[inline(always)]
    pub(crate) fn at_corner(&self, corner: DVec3) -> [Vec3; 2] {
        let in_camera = self.view.camera_from_grid.transform_point3(corner);
        [
            (in_camera - self.anchor.camera_z * DVec3::Z).as_vec3(),
            (corner - self.anchor.grid).as_vec3(),
        ]
    }

    /// The camera movement per grid axis.
    pub(crate) fn axes(&self) -> [Vec3; 3] {
        self.axes
    }
}
