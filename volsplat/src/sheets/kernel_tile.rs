//! One tile of an image-sheets frame, summed from kernels cut into slab sections, or from points.
//!
//! Each voxel adds four values, times the integral of its kernel along each pixel's ray through the slab, to every slab
//! that cuts the kernel. As voxels come sorted by the first slab that they reach, only as many slabs are open as a kernel
//! spans. A slab that nothing can reach any more is composited behind those before it: its sums are either extinction and
//! colours (pre-classified), or scalar and weight, whose quotient is classified now (post-classified).
//! The clip and the near plane cut each ray, and with it the sections, exactly.

mod close;

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, f32x8};
use fearless_simd_macros::simd;
use glam::DVec2;
use resample_core::GridView;
use resample_core::composite::{TileCounts, TilePixels};
use resample_core::maps::TilePlane;
use resample_core::point::PixelFilter;
use resample_core::section::SectionProfile;
use resample_core::sort::{entry_index, entry_key};
use resample_core::tile::TILE_PX;

use self::close::close_slabs;
use super::frame::{PlaneView, SheetSettings, TileView};
use crate::clip::GridClip;
use crate::options::{Classify, Interpolate};

const LANES: usize = 8;

/// A voxel as the tiles need it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Laid {
    /// Position in the grid, relative to the anchor.
    pub(crate) grid: [f32; 3],
    /// Camera z relative to the anchor's, world units.
    pub(crate) offset_z: f32,
    /// What is summed. Pre-classified: red, green, blue times strength, strength. Post-classified: scalar, 1, and 1 for a
    /// voxel that something visible depends on, and the scalar again where the first is a coefficient in its place.
    pub(crate) value: [f32; 4],
    /// Section: camera x and y, world units. Point: screen position, px.
    pub(crate) across: [f32; 2],
    /// Point: its weight summed over the screen, opacity units times px^2. 0 marks a section.
    pub(crate) mass: f32,
}

/// What every tile of a frame shares, beside the settings of all sheets.
#[derive(Clone, Debug)]
pub(crate) struct KernelSettings {
    /// The section table; `None` for the trilinear kernel, which is sampled on the slab's middle plane.
    pub(crate) profile: Option<SectionProfile>,
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
    planes: [TilePlane; 4],
    /// Of interpolating kernels: least and greatest scalar of the voxels in reach.
    range: [TilePlane; 2],
    /// Rows first..end that hold anything.
    rows: [usize; 2],
    view: PlaneView,
    /// Pixels per pixel of the middle plane, at the slab's near and far end.
    end_scales: [f32; 2],
    number: u32,
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
        let (planes, view) = ([[[0.0; TILE_PX]; TILE_PX]; 4], PlaneView::default());
        let range = [f32::INFINITY, f32::NEG_INFINITY].map(|end| [[end; TILE_PX]; TILE_PX]);
        Self { planes, range, rows: [TILE_PX, 0], view, end_scales: [1.0; 2], number: u32::MAX }
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
        let mut rays = Self { direction: [zero; 3], per_z: zero, unit_per_grid: zero, kept: [zero; 2] };
        for y in 0..TILE_PX {
            for x in 0..TILE_PX {
                let pixel = DVec2::new((corner_px[0] + x) as f64 + 0.5, (corner_px[1] + y) as f64 + 0.5);
                let (origin, direction) = view.ray(pixel);
                let length = direction.length();
                for (plane, axis) in rays.direction.iter_mut().zip((direction / length).to_array()) {
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
    let frame = (settings, kernel);
    dispatch!(settings.level, simd => render_entries(simd, frame, (view, rays), (entries, voxels), scratch))
}

#[simd]
fn render_entries<S: Simd>(
    simd: S,
    (settings, kernel): (&SheetSettings, &KernelSettings),
    (view, rays): (&TileView, &TileRays),
    (entries, voxels): (&[u64], &[&[Laid]]),
    scratch: &mut KernelScratch,
) -> TileCounts {
    let mut counts = TileCounts::default();
    scratch.ring.clear();
    scratch.ring.resize_with(settings.ring_len, SlabSums::default);
    let Some(&nearest) = entries.first() else { return counts };
    let mut open = entry_key(nearest);
    for &entry in entries {
        let index = entry_index(entry) as usize;
        let voxel = &voxels[index >> 16][index & 0xffff];
        let first = entry_key(entry);
        if first > open {
            let end = first.min(open.saturating_add(settings.ring_len as u32));
            let opaque = close_slabs(simd, settings, kernel, open..end, scratch);
            open = first;
            if opaque {
                return counts;
            }
        }
        counts.pixels_touched += if voxel.mass > 0.0 {
            add_point(settings, kernel, view, first, (voxel, scratch))
        } else {
            add_sections(simd, (settings, kernel), (view, rays), first, (voxel, scratch))
        };
        counts.composited += 1;
    }
    let end = open.saturating_add(settings.ring_len as u32);
    close_slabs(simd, settings, kernel, open..end, scratch);
    counts
}

/// The sums of a slab, told where it lies.
#[inline(always)]
fn slab<'a>(
    settings: &SheetSettings,
    view: &TileView,
    number: u32,
    scratch: &'a mut KernelScratch,
) -> &'a mut SlabSums {
    let sums = &mut scratch.ring[number as usize & (settings.ring_len - 1)];
    if sums.number != number {
        (sums.view, sums.number) = (view.plane(number), number);
        sums.end_scales = view.end_scales(number);
    }
    sums
}

/// Adds a point to the slab that it lies in, through the pixel's Gaussian. Returns the pixels touched.
#[inline(always)]
fn add_point(
    settings: &SheetSettings,
    kernel: &KernelSettings,
    view: &TileView,
    number: u32,
    (point, scratch): (&Laid, &mut KernelScratch),
) -> usize {
    let sums = slab(settings, view, number, scratch);
    let corner = view.corner_px();
    let across = kernel.filter.along_axis(point.across[0] - corner[0]);
    let down = kernel.filter.along_axis(point.across[1] - corner[1]);
    let mut touched = 0;
    let inside = |first: i32, tap: usize| usize::try_from(first + tap as i32).ok().filter(|&p| p < TILE_PX);
    for (tap_y, weight_y) in down.weights.iter().enumerate() {
        let Some(row) = inside(down.first, tap_y) else { continue };
        for (tap_x, weight_x) in across.weights.iter().enumerate() {
            let Some(column) = inside(across.first, tap_x) else { continue };
            let weight = weight_x * weight_y * point.mass;
            for (plane, value) in sums.planes.iter_mut().zip(point.value) {
                plane[row][column] += weight * value;
            }
            if kernel.interpolate == Interpolate::On && weight > 0.0 {
                let [low, high] = &mut sums.range;
                low[row][column] = low[row][column].min(point.value[3]);
                high[row][column] = high[row][column].max(point.value[3]);
            }
            touched += 1;
        }
        sums.rows = [sums.rows[0].min(row), sums.rows[1].max(row + 1)];
    }
    touched
}

/// Adds a voxel to every slab that cuts its kernel. Returns the pixels looked at.
#[inline(always)]
fn add_sections<S: Simd>(
    simd: S,
    (settings, kernel): (&SheetSettings, &KernelSettings),
    (view, rays): (&TileView, &TileRays),
    first: u32,
    (voxel, scratch): (&Laid, &mut KernelScratch),
) -> usize {
    let mut touched = 0;
    for number in first..first + settings.ring_len as u32 {
        let sums = slab(settings, view, number, scratch);
        let Some(reach) = settings.sections.at(sums.view.offset_z - voxel.offset_z) else { break };
        let [x, y] = voxel.across;
        let [left, top, right, bottom] = reach.ends;
        let [x0, y0, x1, y1] = covered(sums, [x + left, y + top, x + right, y + bottom]);
        if x0 >= x1 || y0 >= y1 {
            continue;
        }
        sums.rows = [sums.rows[0].min(y0), sums.rows[1].max(y1)];
        for lane in (x0 / LANES * LANES..x1).step_by(LANES) {
            for row in y0..y1 {
                add_lanes(simd, (settings, kernel), rays, (sums, [lane, row]), voxel);
            }
            touched += (y1 - y0) * LANES;
        }
    }
    touched
}

/// The tile's pixels whose rays may meet a box of the camera in the slab: at either end, as the box is seen from there.
#[inline(always)]
fn covered(sums: &SlabSums, ends: [f32; 4]) -> [usize; 4] {
    let mut pixels = [0; 4];
    for (k, pixel) in pixels.iter_mut().enumerate() {
        let at = |scale: f32| ends[k] * sums.view.pixel_scale[k] * scale;
        let (a, b) = (at(sums.end_scales[0]), at(sums.end_scales[1]));
        let end = if k < 2 { a.min(b) } else { a.max(b) } + sums.view.pixel_shift[k];
        *pixel = end.ceil().clamp(0.0, TILE_PX as f32) as usize;
    }
    pixels
}

/// Adds a voxel's section to one vector of pixels.
#[inline(always)]
fn add_lanes<S: Simd>(
    simd: S,
    (settings, kernel): (&SheetSettings, &KernelSettings),
    rays: &TileRays,
    (sums, [lane, row]): (&mut SlabSums, [usize; 2]),
    voxel: &Laid,
) {
    let constant = |v: f32| f32x8::splat(simd, v);
    let range = lane..lane + LANES;
    let load = |plane: &TilePlane| f32x8::from_slice(simd, &plane[row][range.clone()]);
    let view = &sums.view;
    // From the voxel to the ray's place on the middle plane.
    let p: [f32x8<S>; 3] = std::array::from_fn(|axis| {
        let start = view.first[axis] - voxel.grid[axis] + row as f32 * view.step_y[axis];
        f32x8::from_slice(simd, &view.lanes[axis][range.clone()]) + constant(start)
    });
    let per_z = load(&rays.per_z);
    let half = per_z * constant(0.5 * settings.thickness as f32);
    let middle_z = constant(view.offset_z);
    let to = ((load(&rays.kept[1]) - middle_z) * per_z).min(half);
    let from = ((load(&rays.kept[0]) - middle_z) * per_z).max(-half).min(to);
    let integral = match &kernel.profile {
        Some(profile) => {
            let d = [load(&rays.direction[0]), load(&rays.direction[1]), load(&rays.direction[2])];
            let t = p[0].mul_add(d[0], p[1].mul_add(d[1], p[2] * d[2]));
            let across = [p[0] - t * d[0], p[1] - t * d[1], p[2] - t * d[2]];
            let distance2 = across[0].mul_add(across[0], across[1].mul_add(across[1], across[2] * across[2]));
            profile.integral(simd, distance2, [t + from, t + to])
        }
        None => {
            let tent = |d: f32x8<S>| (constant(1.0) - d.abs()).max(constant(0.0));
            tent(p[0]) * tent(p[1]) * tent(p[2]) * (to - from)
        }
    };
    let weight = integral * load(&rays.unit_per_grid);
    if weight.simd_gt(constant(0.0)).all_false() {
        return;
    }
    for (plane, value) in sums.planes.iter_mut().zip(voxel.value) {
        let lanes = &mut plane[row][range.clone()];
        weight.mul_add(constant(value), f32x8::from_slice(simd, lanes)).store_slice(lanes);
    }
    if kernel.interpolate == Interpolate::On {
        let [low, high] = &mut sums.range;
        let reached = weight.simd_gt(constant(0.0));
        let (low, high) = (&mut low[row][range.clone()], &mut high[row][range]);
        let (before, value) = (f32x8::from_slice(simd, low), constant(voxel.value[3]));
        reached.select(before.min(value), before).store_slice(low);
        let before = f32x8::from_slice(simd, high);
        reached.select(before.max(value), before).store_slice(high);
    }
}
