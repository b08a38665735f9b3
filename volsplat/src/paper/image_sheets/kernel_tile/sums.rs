//! The sums of the slabs that are open over a tile, and the samples added to them.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::DVec2;
use resample_core::GridView;
use resample_core::composite::TilePixels;
use resample_core::maps::TilePlane;
use resample_core::point::PixelFilter;
use resample_core::section::SectionProfile;
use resample_core::tile::TILE_PX;

use crate::look::clip::GridClip;
use crate::look::options::{Classify, Interpolate};
use crate::slabs::settings::SheetSettings;
use crate::slabs::view::{HalfRow, PlaneView, TileView};

pub(crate) const LANES: usize = 8;

/// Most values that are summed for a voxel.
pub(crate) const MOST_SUMS: usize = 6;

/// How many values are summed: colour and strength; scalar, weight and need; the same and a gradient.
pub(crate) const SUMS_PRE: usize = 4;
pub(crate) const SUMS_POST: usize = 3;
pub(crate) const SUMS_LIT: usize = MOST_SUMS;

/// A voxel as the tiles need it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KernelSample {
    /// Position in the grid, relative to the anchor.
    pub(crate) grid: [f32; 3],
    /// Camera z relative to the anchor's, world units.
    pub(crate) offset_z: f32,
    /// The summed values. Pre-classified: red, green, blue times strength, strength. Post-classified: scalar or its
    /// coefficient, 1, and 1 for a voxel that something visible depends on; then the gradient in the world.
    pub(crate) value: [f32; MOST_SUMS],
    /// The voxel's own scalar, post-classified.
    pub(crate) scalar: f32,
    /// Section: camera x and y, world units. Point: screen position, px.
    pub(crate) across: [f32; 2],
    /// Point: its weight summed over the screen, opacity units times px^2. 0 marks a section.
    pub(crate) mass: f32,
}

/// Settings shared by every tile of a frame, beside the settings of all sheets.
#[derive(Clone, Debug)]
pub(crate) struct KernelSettings {
    /// The section table.
    pub(crate) profile: SectionProfile,
    pub(crate) filter: PixelFilter,
    pub(crate) classify: Classify,
    pub(crate) interpolate: Interpolate,
    /// The kept part of each ray.
    pub(crate) clip: GridClip,
}

/// The rays of a tile.
#[derive(Clone, Debug)]
pub(crate) struct TileRays {
    /// Unit direction in the grid.
    pub(crate) direction: [TilePlane; 3],
    /// Grid units per unit of camera z.
    pub(crate) per_z: TilePlane,
    /// Opacity units per grid unit.
    pub(crate) unit_per_grid: TilePlane,
    /// Camera z, relative to the anchor's, at which the ray enters and leaves what is kept.
    pub(crate) kept: [TilePlane; 2],
}

/// Sums of one slab over a tile.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct SlabSums {
    /// By row, and in each by the summed quantity.
    pub(crate) sums: [[[f32; TILE_PX]; MOST_SUMS]; TILE_PX],
    /// Of interpolating kernels: least and greatest scalar of the voxels in reach.
    pub(crate) range: [TilePlane; 2],
    /// Rows first..end that hold anything.
    pub(crate) rows: [usize; 2],
    pub(crate) view: PlaneView,
    /// Pixels per pixel of the middle plane, at the slab's near and far end.
    pub(crate) end_scales: [f32; 2],
    pub(crate) number: u32,
}

/// Settings and view that all voxels of a tile share.
#[derive(Clone, Copy)]
pub(crate) struct Tile<'a> {
    pub(crate) settings: &'a SheetSettings,
    pub(crate) kernel: &'a KernelSettings,
    pub(crate) view: &'a TileView,
    pub(crate) rays: &'a TileRays,
}

/// Storage of one task, reused from tile to tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct KernelScratch {
    pub(crate) ring: Vec<SlabSums>,
    pub(crate) pixels: TilePixels,
    pub(crate) sort: Vec<u64>,
}

impl Default for SlabSums {
    fn default() -> Self {
        let range = [f32::INFINITY, f32::NEG_INFINITY].map(|end| [[end; TILE_PX]; TILE_PX]);
        Self {
            sums: [[[0.0; TILE_PX]; MOST_SUMS]; TILE_PX],
            range,
            rows: [TILE_PX, 0],
            view: PlaneView::default(),
            end_scales: [1.0; 2],
            number: u32::MAX,
        }
    }
}

impl TileRays {
    pub(crate) fn new(
        view: &GridView,
        corner_px: [usize; 2],
        settings: &SheetSettings,
        clip: &GridClip,
    ) -> Self {
        let zero = [[0.0; TILE_PX]; TILE_PX];
        let mut rays = Self {
            direction: [zero; 3],
            per_z: zero,
            unit_per_grid: zero,
            kept: [zero; 2],
        };
        for y in 0..TILE_PX {
            for x in 0..TILE_PX {
                let pixel = DVec2::new(
                    (corner_px[0] + x) as f64 + 0.5,
                    (corner_px[1] + y) as f64 + 0.5,
                );
                let (origin, direction) = view.ray(pixel);
                let length = direction.length();
                for (plane, axis) in rays
                    .direction
                    .iter_mut()
                    .zip((direction / length).to_array())
                {
                    plane[y][x] = axis as f32;
                }
                rays.per_z[y][x] = length as f32;
                rays.unit_per_grid[y][x] =
                    (view.world_per_grid_along(direction) / settings.unit_in_world) as f32;
                let [enter, leave] = clip.interval(origin, direction);
                for (plane, z) in rays.kept.iter_mut().zip([enter.max(view.near), leave]) {
                    plane[y][x] = (z - settings.anchor.camera_z) as f32;
                }
            }
        }
        rays
    }
}

/// The sums of a slab, with its place.
#[inline(always)]
pub(crate) fn slab<'a>(tile: &Tile, number: u32, ring: &'a mut [SlabSums]) -> &'a mut SlabSums {
    let sums = &mut ring[number as usize & (tile.settings.ring_len - 1)];
    if sums.number != number {
        (sums.view, sums.number) = (tile.view.plane(number), number);
        sums.end_scales = tile.view.end_scales(number);
    }
    sums
}

impl SlabSums {
    /// The tile's pixels whose rays may meet a box of the camera in the slab: at either end, as the box is seen from
    /// there. Least x, y, greatest x, y; pixels first..end.
    #[inline(always)]
    pub(crate) fn covered(&self, ends: [f32; 4]) -> [usize; 4] {
        let mut pixels = [0; 4];
        for (k, pixel) in pixels.iter_mut().enumerate() {
            let at = |scale: f32| ends[k] * self.view.pixel_scale[k] * scale;
            let (a, b) = (at(self.end_scales[0]), at(self.end_scales[1]));
            let end = if k < 2 { a.min(b) } else { a.max(b) } + self.view.pixel_shift[k];
            *pixel = end.ceil().clamp(0.0, TILE_PX as f32) as usize;
        }
        pixels
    }

    /// Adds a voxel, by its weights, to one vector of pixels from `first` on.
    #[inline(always)]
    pub(crate) fn add<S: Simd, const SUMS: usize>(
        &mut self,
        simd: S,
        at: HalfRow,
        weight: f32x8<S>,
        value: &[f32; MOST_SUMS],
    ) {
        let HalfRow { row, first } = at;
        for (plane, value) in self.sums[row][..SUMS].iter_mut().zip(value) {
            let lanes = &mut plane[first..first + LANES];
            weight
                .mul_add(f32x8::splat(simd, *value), f32x8::from_slice(simd, lanes))
                .store_slice(lanes);
        }
    }

    /// Remembers the scalar of a voxel where it has weight.
    #[inline(always)]
    pub(crate) fn widen_range<S: Simd>(
        &mut self,
        simd: S,
        at: HalfRow,
        weight: f32x8<S>,
        scalar: f32,
    ) {
        let HalfRow { row, first } = at;
        let range = first..first + LANES;
        let reached = weight.simd_gt(f32x8::splat(simd, 0.0));
        let scalar = f32x8::splat(simd, scalar);
        let [low, high] = &mut self.range;
        let (low, high) = (&mut low[row][range.clone()], &mut high[row][range]);
        let before = f32x8::from_slice(simd, low);
        reached.select(before.min(scalar), before).store_slice(low);
        let before = f32x8::from_slice(simd, high);
        reached.select(before.max(scalar), before).store_slice(high);
    }
}
