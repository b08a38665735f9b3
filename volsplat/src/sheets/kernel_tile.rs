//! One tile of an image-sheets frame, summed from kernels cut into slab sections, or from points.
//!
//! Each voxel adds what it carries, times the integral of its kernel along each pixel's ray through the slab, to every slab
//! that cuts the kernel. As voxels come sorted by the first slab that they reach, only as many slabs are open as a kernel
//! spans. A slab that nothing can reach any more is composited behind those before it: its sums are either extinction and
//! colours (pre-classified), or scalar and weight, whose quotient is classified now (post-classified), and where samples
//! are lit also the gradient. The clip and the near plane cut each ray, and with it the sections, exactly.

mod ball;
mod close;

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::DVec2;
use resample_core::GridView;
use resample_core::composite::{TileCounts, TilePixels};
use resample_core::dispatch;
use resample_core::maps::TilePlane;
use resample_core::point::PixelFilter;
use resample_core::section::{ALONG, ALONG_POLYNOMIAL, Powers, SectionProfile};
use resample_core::sort::{entry_index, entry_key};
use resample_core::tile::TILE_PX;

use self::ball::add_ball;
use self::close::close_slabs;
use super::frame::{PlaneView, SheetSettings, TileView};
use crate::clip::GridClip;
use crate::options::{Classify, Interpolate};

const LANES: usize = 8;

/// Most values that are summed for a voxel.
pub(crate) const MOST_SUMS: usize = 6;

/// How many values are summed: colour and strength; scalar, weight and need; the same and a gradient.
const SUMS_PRE: usize = 4;
const SUMS_POST: usize = 3;
const SUMS_LIT: usize = MOST_SUMS;

/// A voxel as the tiles need it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Laid {
    /// Position in the grid, relative to the anchor.
    pub(crate) grid: [f32; 3],
    /// Camera z relative to the anchor's, world units.
    pub(crate) offset_z: f32,
    /// What is summed. Pre-classified: red, green, blue times strength, strength. Post-classified: scalar or its
    /// coefficient, 1, and 1 for a voxel that something visible depends on; then the gradient in the world.
    pub(crate) value: [f32; MOST_SUMS],
    /// The voxel's own scalar, post-classified.
    pub(crate) scalar: f32,
    /// Section: camera x and y, world units. Point: screen position, px.
    pub(crate) across: [f32; 2],
    /// Point: its weight summed over the screen, opacity units times px^2. 0 marks a section.
    pub(crate) mass: f32,
}

/// What every tile of a frame shares, beside the settings of all sheets.
#[derive(Clone, Debug)]
pub(crate) struct KernelSettings {
    /// The section table.
    pub(crate) profile: SectionProfile,
    pub(crate) filter: PixelFilter,
    pub(crate) classify: Classify,
    pub(crate) interpolate: Interpolate,
    /// What is kept of each ray.
    pub(crate) clip: GridClip,
}

/// The rays of a tile.
#[derive(Clone, Debug)]
pub(crate) struct TileRays {
    /// Unit direction in the grid.
    direction: [TilePlane; 3],
    /// Grid units per unit of camera z.
    per_z: TilePlane,
    /// Opacity units per grid unit.
    unit_per_grid: TilePlane,
    /// Camera z, relative to the anchor's, at which the ray enters and leaves what is kept.
    kept: [TilePlane; 2],
}

/// Sums of one slab over a tile.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct SlabSums {
    /// By row, and in each by what is summed.
    sums: [[[f32; TILE_PX]; MOST_SUMS]; TILE_PX],
    /// Of interpolating kernels: least and greatest scalar of the voxels in reach.
    range: [TilePlane; 2],
    /// Rows first..end that hold anything.
    rows: [usize; 2],
    view: PlaneView,
    /// Pixels per pixel of the middle plane, at the slab's near and far end.
    end_scales: [f32; 2],
    number: u32,
}

/// What every voxel of a tile is summed with.
#[derive(Clone, Copy)]
struct Tile<'a> {
    settings: &'a SheetSettings,
    kernel: &'a KernelSettings,
    view: &'a TileView,
    rays: &'a TileRays,
}

/// Storage of one task, reused from tile to tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct KernelScratch {
    ring: Vec<SlabSums>,
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

/// Renders a tile from its sorted entries. `voxels` holds each chunk's voxels.
pub(crate) fn render_tile(
    (settings, kernel): (&SheetSettings, &KernelSettings),
    (view, rays): (&TileView, &TileRays),
    entries: &[u64],
    voxels: &[&[Laid]],
    scratch: &mut KernelScratch,
) -> TileCounts {
    let tile = Tile {
        settings,
        kernel,
        view,
        rays,
    };
    macro_rules! sum {
        ($count:expr) => {
            dispatch!(settings.level, simd => render_entries::<_, { $count }>(simd, tile, entries, voxels, scratch))
        };
    }
    match kernel.classify {
        Classify::Pre => sum!(SUMS_PRE),
        Classify::Post if settings.needs_gradients() => sum!(SUMS_LIT),
        Classify::Post => sum!(SUMS_POST),
    }
}

#[simd]
fn render_entries<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    entries: &[u64],
    voxels: &[&[Laid]],
    scratch: &mut KernelScratch,
) -> TileCounts {
    let mut counts = TileCounts::default();
    let ring_len = tile.settings.ring_len;
    scratch.ring.clear();
    scratch.ring.resize_with(ring_len, SlabSums::default);
    let Some(&nearest) = entries.first() else {
        return counts;
    };
    let mut open = entry_key(nearest);
    for &entry in entries {
        let index = entry_index(entry) as usize;
        let voxel = &voxels[index >> 16][index & 0xffff];
        let first = entry_key(entry);
        if first > open {
            let end = first.min(open.saturating_add(ring_len as u32));
            let opaque = close_slabs::<_, SUMS>(simd, tile, open..end, scratch);
            open = first;
            if opaque {
                return counts;
            }
        }
        counts.pixels_touched += if voxel.mass > 0.0 {
            add_point::<SUMS>(tile, first, voxel, scratch)
        } else {
            let profile = &tile.kernel.profile;
            match profile.powers() {
                Powers::Few => add_ball::<_, SUMS, ALONG_POLYNOMIAL>(
                    simd,
                    (tile, profile),
                    first,
                    voxel,
                    scratch,
                ),
                Powers::All => {
                    add_ball::<_, SUMS, ALONG>(simd, (tile, profile), first, voxel, scratch)
                }
            }
        };
        counts.composited += 1;
    }
    let end = open.saturating_add(ring_len as u32);
    close_slabs::<_, SUMS>(simd, tile, open..end, scratch);
    counts
}

/// The sums of a slab, told where it lies.
#[inline(always)]
fn slab<'a>(tile: &Tile, number: u32, ring: &'a mut [SlabSums]) -> &'a mut SlabSums {
    let sums = &mut ring[number as usize & (tile.settings.ring_len - 1)];
    if sums.number != number {
        (sums.view, sums.number) = (tile.view.plane(number), number);
        sums.end_scales = tile.view.end_scales(number);
    }
    sums
}

/// Adds a point to the slab that it lies in, through the pixel's Gaussian. Returns the pixels touched.
#[inline(always)]
fn add_point<const SUMS: usize>(
    tile: Tile,
    number: u32,
    point: &Laid,
    scratch: &mut KernelScratch,
) -> usize {
    let sums = slab(&tile, number, &mut scratch.ring);
    let corner = tile.view.corner_px();
    let across = tile.kernel.filter.along_axis(point.across[0] - corner[0]);
    let down = tile.kernel.filter.along_axis(point.across[1] - corner[1]);
    let mut touched = 0;
    let inside = |first: i32, tap: usize| {
        usize::try_from(first + tap as i32)
            .ok()
            .filter(|&p| p < TILE_PX)
    };
    for (tap_y, weight_y) in down.weights.iter().enumerate() {
        let Some(row) = inside(down.first, tap_y) else {
            continue;
        };
        for (tap_x, weight_x) in across.weights.iter().enumerate() {
            let Some(column) = inside(across.first, tap_x) else {
                continue;
            };
            let weight = weight_x * weight_y * point.mass;
            for (plane, value) in sums.sums[row][..SUMS].iter_mut().zip(point.value) {
                plane[column] += weight * value;
            }
            if tile.kernel.interpolate == Interpolate::On && weight > 0.0 {
                let [low, high] = &mut sums.range;
                low[row][column] = low[row][column].min(point.scalar);
                high[row][column] = high[row][column].max(point.scalar);
            }
            touched += 1;
        }
        sums.rows = [sums.rows[0].min(row), sums.rows[1].max(row + 1)];
    }
    touched
}

impl SlabSums {
    /// The tile's pixels whose rays may meet a box of the camera in the slab: at either end, as the box is seen from
    /// there. Least x, y, greatest x, y; pixels first..end.
    #[inline(always)]
    fn covered(&self, ends: [f32; 4]) -> [usize; 4] {
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
    fn add<S: Simd, const SUMS: usize>(
        &mut self,
        simd: S,
        (row, first): (usize, usize),
        weight: f32x8<S>,
        value: &[f32; MOST_SUMS],
    ) {
        for (plane, value) in self.sums[row][..SUMS].iter_mut().zip(value) {
            let lanes = &mut plane[first..first + LANES];
            weight
                .mul_add(f32x8::splat(simd, *value), f32x8::from_slice(simd, lanes))
                .store_slice(lanes);
        }
    }

    /// Remembers the scalar of a voxel where it has weight.
    #[inline(always)]
    fn widen_range<S: Simd>(
        &mut self,
        simd: S,
        (row, first): (usize, usize),
        weight: f32x8<S>,
        scalar: f32,
    ) {
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
