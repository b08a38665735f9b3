//! The camera of a tile: on the plane of each slab a pixel's position in the grid is an affine function of the pixel,
//! so that three vectors a plane are all that a section needs.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec2, DVec3};
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;
use resample_core::{GridView, Projection};

use super::settings::{Anchor, BOX_MARGIN, SheetSettings};
pub(crate) use crate::slabs::table::{HalfRow, LANES};

/// Pixels along the side of a block: 16 of them are a vector.
pub(crate) const BLOCK_PX: usize = 4;

/// The camera of one tile.
#[derive(Clone, Debug)]
pub(crate) struct TileView {
    view: GridView,
    anchor: Anchor,
    thickness: f64,
    /// The tile's first pixel: its corner, not its centre.
    pub(crate) corner: DVec2,
    /// Opacity units along each pixel's ray through one slab.
    pub(crate) units_per_slab: TilePlane,
    /// Unit direction of each pixel's ray, in the world; only where samples are lit.
    pub(crate) ray_in_world: [TilePlane; 3],
}

/// One plane over one tile: an affine map from pixels to the grid.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct PlaneView {
    /// Change of the grid position over the lanes: lane times the step per pixel along x, for each grid axis.
    pub(crate) lanes: [[f32; TILE_PX]; 3],
    /// Grid position of the centre of the tile's first pixel, relative to the anchor.
    pub(crate) first: [f32; 4],
    /// The same for each row of the tile, that much further per pixel along y: for each pixel of a block of 4x4 pixels,
    /// for the blocks along y.
    pub(crate) block_rows: [[[f32; TILE_PX]; BLOCK_PX]; 3],
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
        Self {
            view: *view,
            anchor,
            thickness,
            corner,
            units_per_slab,
            ray_in_world,
        }
    }

    /// Unit directions of half a row's rays, in the world.
    #[inline(always)]
    pub(crate) fn rays<S: Simd>(&self, simd: S, at: HalfRow) -> [f32x8<S>; 3] {
        let range = at.first..at.first + LANES;
        std::array::from_fn(|axis| {
            f32x8::from_slice(simd, &self.ray_in_world[axis][at.row][range.clone()])
        })
    }

    /// The camera of the frame.
    pub(crate) fn camera(&self) -> &GridView {
        &self.view
    }

    /// Column and row of the tile's first pixel.
    pub(crate) fn first_px(&self) -> [usize; 2] {
        [self.corner.x as usize, self.corner.y as usize]
    }

    /// The tile's first pixel.
    pub(crate) fn corner_px(&self) -> [f32; 2] {
        self.corner.as_vec2().to_array()
    }

    /// Pixels per pixel of a slab's plane, for a length at the slab's near and far end.
    pub(crate) fn end_scales(&self, number: u32) -> [f32; 2] {
        let camera_z = (f64::from(number) + 0.5) * self.thickness;
        let at = |z: f64| match self.view.projection {
            Projection::Perspective => (camera_z / z) as f32,
            Projection::Orthographic => 1.0,
        };
        // The near plane cuts the slab.
        [
            at((camera_z - 0.5 * self.thickness).max(self.view.near)),
            at(camera_z + 0.5 * self.thickness),
        ]
    }

    /// The plane of a slab.
    pub(crate) fn plane(&self, number: u32) -> PlaneView {
        let mut plane = PlaneView::default();
        self.put_plane(number, &mut plane);
        plane
    }

    /// Puts the plane of a slab where another was.
    pub(crate) fn put_plane(&self, number: u32, plane: &mut PlaneView) {
        let camera_z = (f64::from(number) + 0.5) * self.thickness;
        let (origin, direction) = self.view.ray(self.corner + 0.5);
        let first = origin - self.anchor.grid + camera_z * direction;
        let scale = match self.view.projection {
            Projection::Perspective => camera_z,
            Projection::Orthographic => 1.0,
        };
        let (step_x, step_y) = (scale * self.view.wx, scale * self.view.wy);
        let pixels = self.view.focal / scale;
        let shift = self.view.principal_px - self.corner - 0.5;
        let four = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        let ends =
            |low: DVec2, high: DVec2| [low.x as f32, low.y as f32, high.x as f32, high.y as f32];
        let (first, step_y) = (four(first), four(step_y));
        for (axis, blocks) in plane.block_rows.iter_mut().enumerate() {
            for (row, pixels) in blocks
                .as_flattened_mut()
                .chunks_exact_mut(BLOCK_PX)
                .enumerate()
            {
                pixels.fill(first[axis] + row as f32 * step_y[axis]);
            }
        }
        for (lanes, step) in plane.lanes.iter_mut().zip(step_x.to_array()) {
            for (number, lane) in lanes.iter_mut().enumerate() {
                *lane = (number as f64 * step) as f32;
            }
        }
        plane.first = first;
        plane.step_y = step_y;
        plane.pixel_scale = ends(pixels, pixels);
        plane.pixel_shift = ends(shift - BOX_MARGIN, shift + BOX_MARGIN);
        plane.offset_z = (camera_z - self.anchor.camera_z) as f32;
        plane.camera_z = camera_z as f32;
    }
}

impl PlaneView {
    /// Grid position along an axis of the first pixel of a row of the tile, relative to the anchor.
    #[inline(always)]
    pub(crate) fn row(&self, axis: usize, row: usize) -> f32 {
        self.block_rows[axis].as_flattened()[row * BLOCK_PX]
    }
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
