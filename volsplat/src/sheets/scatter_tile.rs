//! One tile of a scattered image-sheets frame: summing sections into sheets, classifying, compositing.
//!
//! A sheet is sampled on the plane through its middle. A voxel adds its scalar and its weight to each plane that cuts
//! its kernel; when no later voxel can reach a plane any more, the plane is classified pixel by pixel and composited
//! behind those before it. As voxels come sorted by the first plane that they reach, only as many planes are open as
//! one kernel spans: a ring of them, which stays in the first-level cache.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8};
use fearless_simd_macros::simd;
use resample_core::composite::{DepthRule, TileCounts, TilePixels, opacity};
use resample_core::dispatch;
use resample_core::sort::{entry_index, entry_key};
use resample_core::tile::TILE_PX;

use super::frame::{PlaneView, Section, SheetSettings, TileView, covered};

/// Lanes of the vectors that lay sections down: a section of a voxel is a few pixels wide.
const LANES: usize = 8;

/// Columns on either side of a tile that a vector may hang over.
const MARGIN: usize = LANES;

const ROW: usize = TILE_PX + 2 * MARGIN;

/// Sums of one plane over a tile.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct PlaneSums {
    weight: [[f32; ROW]; TILE_PX],
    value: [[f32; ROW]; TILE_PX],
    /// Rows first..end that hold anything.
    rows: [usize; 2],
    /// Where the plane lies; that of `number`.
    view: PlaneView,
    number: u32,
}

impl Default for PlaneSums {
    fn default() -> Self {
        let zero = [[0.0; ROW]; TILE_PX];
        Self {
            weight: zero,
            value: zero,
            rows: [TILE_PX, 0],
            view: PlaneView::default(),
            number: u32::MAX,
        }
    }
}

/// Storage of one task, reused from tile to tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct SheetScratch {
    ring: Vec<PlaneSums>,
    /// The tile's pixels.
    pub(crate) pixels: TilePixels,
    pub(crate) sort: Vec<u64>,
}

/// Weights of a cell whose eight corners are all there sum to 1; a sample with less lies in a cell that no visible
/// scalar can be in, or outside the volume. A thousandth is far above rounding and far below a voxel's share.
const COMPLETE_WEIGHT: f32 = 0.999;

/// Sections fetched together, so that their cache misses overlap.
const GATHER: usize = 32;

/// Renders a tile from its sorted entries. `sections` holds each chunk's sections.
pub(crate) fn render_tile(
    settings: &SheetSettings,
    view: &TileView,
    entries: &[u64],
    sections: &[&[Section]],
    scratch: &mut SheetScratch,
) -> TileCounts {
    dispatch!(settings.level, simd => render_entries(simd, settings, view, entries, sections, scratch))
}

#[simd]
fn render_entries<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    view: &TileView,
    entries: &[u64],
    sections: &[&[Section]],
    scratch: &mut SheetScratch,
) -> TileCounts {
    let mut counts = TileCounts::default();
    scratch.ring.clear();
    scratch
        .ring
        .resize_with(settings.ring_len, PlaneSums::default);
    let Some(&nearest) = entries.first() else {
        return counts;
    };
    let mut open = entry_key(nearest);
    let mut gathered = [Section::default(); GATHER];
    for block in entries.chunks(GATHER) {
        for (slot, &entry) in gathered.iter_mut().zip(block) {
            let index = entry_index(entry) as usize;
            *slot = sections[index >> 16][index & 0xffff];
        }
        for (section, &entry) in gathered.iter().zip(block) {
            let first = entry_key(entry);
            if first > open {
                let end = first.min(open.saturating_add(settings.ring_len as u32));
                let opaque = close_planes(simd, settings, view, open..end, scratch);
                open = first;
                if opaque {
                    return counts;
                }
            }
            counts.pixels_touched += add_voxel(simd, settings, view, first, (section, scratch));
            counts.composited += 1;
        }
    }
    close_planes(
        simd,
        settings,
        view,
        open..open.saturating_add(settings.ring_len as u32),
        scratch,
    );
    counts
}

/// Adds a voxel to every plane that cuts its kernel. Returns the pixels looked at.
#[inline(always)]
fn add_voxel<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    view: &TileView,
    first: u32,
    (section, scratch): (&Section, &mut SheetScratch),
) -> usize {
    let [x, y] = section.camera;
    let camera = f32x4::from_slice(simd, &[x, y, x, y]);
    let mask = settings.ring_len - 1;
    let mut touched = 0;
    for plane in first..first + settings.ring_len as u32 {
        let sums = &mut scratch.ring[plane as usize & mask];
        if sums.number != plane {
            (sums.view, sums.number) = (view.plane(plane), plane);
        }
        let Some(reach) = settings.sections.at(sums.view.offset_z - section.offset_z) else {
            break;
        };
        let [x0, y0, x1, y1] = covered(
            simd,
            &sums.view,
            camera + f32x4::from_slice(simd, &reach.ends),
        );
        if x0 >= x1 || y0 >= y1 {
            continue;
        }
        sums.rows = [sums.rows[0].min(y0), sums.rows[1].max(y1)];
        for x in (x0..x1).step_by(LANES) {
            add_window(simd, sums, (x, [y0, y1]), &section.grid_and_value);
            touched += (y1 - y0) * LANES;
        }
    }
    touched
}

/// Adds the trilinear weights of one voxel (grid position and scalar) to eight columns from `x` on, over `rows`.
#[inline(always)]
fn add_window<S: Simd>(
    simd: S,
    sums: &mut PlaneSums,
    (x, rows): (usize, [usize; 2]),
    grid_and_value: &[f32; 4],
) {
    let four = |v: &[f32; 4]| f32x4::from_slice(simd, v);
    let view = &sums.view;
    let start = four(&view.first) - four(grid_and_value);
    let start = four(&view.step_x).mul_add(f32x4::splat(simd, x as f32), start);
    let start = four(&view.step_y)
        .mul_add(f32x4::splat(simd, rows[0] as f32), start)
        .to_array();
    let eight = |v: f32| f32x8::splat(simd, v);
    let mut d: [f32x8<S>; 3] = std::array::from_fn(|axis| {
        f32x8::from_slice(simd, &view.lanes[axis][..LANES]) + eight(start[axis])
    });
    let down: [f32x8<S>; 3] = std::array::from_fn(|axis| eight(view.step_y[axis]));
    let (one, zero, scalar) = (eight(1.0), eight(0.0), eight(grid_and_value[3]));
    let range = x + MARGIN..x + MARGIN + LANES;
    let (weights, values) = (
        &mut sums.weight[rows[0]..rows[1]],
        &mut sums.value[rows[0]..rows[1]],
    );
    for (weights, values) in weights.iter_mut().zip(values) {
        let [dx, dy, dz] = d.map(|d| (one - d.abs()).max(zero));
        let weight = dx * dy * dz;
        let weights = &mut weights[range.clone()];
        (f32x8::from_slice(simd, weights) + weight).store_slice(weights);
        let values = &mut values[range.clone()];
        weight
            .mul_add(scalar, f32x8::from_slice(simd, values))
            .store_slice(values);
        d = std::array::from_fn(|axis| d[axis] + down[axis]);
    }
}

/// Classifies and composites planes, nearest first, and empties them. Returns whether the tile is opaque.
#[inline(always)]
fn close_planes<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    view: &TileView,
    planes: std::ops::Range<u32>,
    scratch: &mut SheetScratch,
) -> bool {
    let mut changed = false;
    for plane in planes {
        let slot = plane as usize & (settings.ring_len - 1);
        let sums = &mut scratch.ring[slot];
        let [first, end] = sums.rows;
        for row in first..end {
            changed |= close_row(simd, settings, view, (sums, &mut scratch.pixels), row);
            sums.weight[row] = [0.0; ROW];
            sums.value[row] = [0.0; ROW];
        }
        sums.rows = [TILE_PX, 0];
    }
    changed && scratch.pixels.is_opaque(simd, settings.min_transmittance)
}

/// Classifies one row of a plane and composites it behind what the pixels hold. Returns whether anything was seen.
#[inline(always)]
fn close_row<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    view: &TileView,
    (sums, pixels): (&PlaneSums, &mut TilePixels),
    row: usize,
) -> bool {
    let (weights, values) = (&sums.weight[row][MARGIN..], &sums.value[row][MARGIN..]);
    let mut planes = [[0.0f32; TILE_PX]; 4];
    let mut seen = false;
    for x in 0..TILE_PX {
        if weights[x] > COMPLETE_WEIGHT {
            let classified = settings.table.at(values[x] / weights[x]);
            seen |= classified[3] > 0.0;
            for (plane, value) in planes.iter_mut().zip(classified) {
                plane[x] = value;
            }
        }
    }
    if !seen {
        return false;
    }
    for lane in (0..TILE_PX).step_by(S::f32s::LEN) {
        let range = lane..lane + S::f32s::LEN;
        let load = |plane: &[f32; TILE_PX]| S::f32s::from_slice(simd, &plane[range.clone()]);
        let added = load(&planes[3]) * load(&view.units_per_slab[row]);
        let before = load(&pixels.transmittance[row]);
        let weight = before * opacity(simd, settings.opacity, added);
        (before - weight).store_slice(&mut pixels.transmittance[row][range.clone()]);
        for (plane, colour) in pixels.rgb.iter_mut().zip(&planes) {
            let sum = weight.mul_add(load(colour), load(&plane[row]));
            sum.store_slice(&mut plane[row][range.clone()]);
        }
        if settings.depth == DepthRule::Expected {
            let sum = weight.mul_add(
                S::f32s::splat(simd, sums.view.camera_z),
                load(&pixels.depth[row]),
            );
            sum.store_slice(&mut pixels.depth[row][range.clone()]);
        }
    }
    true
}
