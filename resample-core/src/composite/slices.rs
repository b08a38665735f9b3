//! Axis-aligned slices: what lies in one slice of the grid is summed, then composited once (Westover's sheets).
//!
//! Entries carry the number of their slice as sorting key. Splats and points of a slice add optical depth, and colour
//! and depth weighted by it, to sums over the tile; when the next slice begins, the sums are composited as one layer
//! with the mean colour. Inside a slice nothing hides anything, whatever the depths of its samples.
//! Source: L. Westover, "Footprint Evaluation for Volume Rendering", SIGGRAPH 1990.

use crate::dispatch;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;

use super::state::{
    DepthRule, ENTRIES_PER_CHECK, SliceSums, TileCounts, TilePixels, TileSettings, TileWork,
};
use crate::composite::maps::TilePlane;
use crate::composite::{RowLanes, composite_splat, opacity, pixel};
use crate::sort::{entry_index, entry_key};
use crate::tile::{POINT_ROWS, Primitive, TILE_PX};

/// Composites the entries of the tile whose first pixel is `corner_px`, sorted by the number of their slice.
pub fn composite_slices(
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [usize; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    let corner_px = corner_px.map(|c| c as f32);
    dispatch!(settings.level, simd => composite_entries(simd, settings, tile, corner_px, entries, chunks))
}

#[simd]
fn composite_entries<S: Simd>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    let mut counts = TileCounts::default();
    let Some(&nearest) = entries.first() else {
        return counts;
    };
    let mut open = entry_key(nearest);
    let mut gathered = [Primitive::default(); ENTRIES_PER_CHECK];
    for block in entries.chunks(ENTRIES_PER_CHECK) {
        for (slot, &entry) in gathered.iter_mut().zip(block) {
            let index = entry_index(entry) as usize;
            *slot = chunks[index >> 16][index & 0xffff];
        }
        for (primitive, &entry) in gathered.iter().zip(block) {
            if entry_key(entry) != open {
                close_slice(simd, settings, tile);
                open = entry_key(entry);
                if tile.pixels.is_opaque(simd, settings.min_transmittance) {
                    return counts;
                }
            }
            counts.pixels_touched += add_primitive(simd, settings, tile, corner_px, primitive);
            counts.composited += 1;
        }
    }
    close_slice(simd, settings, tile);
    counts
}

/// Adds a point or a splat to the open slice. Returns the pixels looked at.
#[inline(always)]
fn add_primitive<S: Simd>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    primitive: &Primitive,
) -> usize {
    if primitive.rows == POINT_ROWS {
        return add_point(settings, &mut tile.slice, corner_px, primitive);
    }
    // The same rows as those of the splat: whole numbers below 2^16.
    let corner_row = corner_px[1] as usize;
    let first = usize::from(primitive.rows[0]).saturating_sub(corner_row);
    let end = usize::from(primitive.rows[1])
        .saturating_sub(corner_row)
        .min(TILE_PX);
    tile.slice.rows = [tile.slice.rows[0].min(first), tile.slice.rows[1].max(end)];
    composite_splat::<S, true, false>(simd, settings, tile, corner_px, primitive)
}

/// Adds a point through the pixel's Gaussian. Returns the pixels touched.
#[inline(always)]
fn add_point(
    settings: &TileSettings,
    slice: &mut SliceSums,
    corner_px: [f32; 2],
    point: &Primitive,
) -> usize {
    let across = settings.filter.along_axis(point.x - corner_px[0]);
    let down = settings.filter.along_axis(point.y - corner_px[1]);
    let [r, g, b] = point.rgb;
    let mut touched = 0;
    for (tap_y, weight_y) in down.weights.iter().enumerate() {
        let Some(row) = pixel(down.first, tap_y) else {
            continue;
        };
        for (tap_x, weight_x) in across.weights.iter().enumerate() {
            let Some(column) = pixel(across.first, tap_x) else {
                continue;
            };
            let added = weight_x * weight_y * point.strength;
            slice.strength[row][column] += added;
            for (plane, value) in slice.weighted.iter_mut().zip([r, g, b, point.depth]) {
                plane[row][column] += added * value;
            }
            touched += 1;
        }
        slice.rows = [slice.rows[0].min(row), slice.rows[1].max(row + 1)];
    }
    touched
}

/// Composites the open slice as one layer, and empties it.
#[inline(always)]
fn close_slice<S: Simd>(simd: S, settings: &TileSettings, tile: &mut TileWork) {
    let [first, end] = tile.slice.rows;
    for row in first..end {
        for lane in (0..TILE_PX).step_by(S::f32s::LEN) {
            composite_layer(
                simd,
                settings,
                &mut tile.pixels,
                RowLanes { row, lane },
                &tile.slice,
            );
        }
        tile.slice.strength[row] = [0.0; TILE_PX];
        for plane in &mut tile.slice.weighted {
            plane[row] = [0.0; TILE_PX];
        }
    }
    tile.slice.rows = [TILE_PX, 0];
}

#[inline(always)]
fn composite_layer<S: Simd>(
    simd: S,
    settings: &TileSettings,
    pixels: &mut TilePixels,
    at: RowLanes,
    slice: &SliceSums,
) {
    let range = at.lane..at.lane + S::f32s::LEN;
    let load = |plane: &TilePlane| S::f32s::from_slice(simd, &plane[at.row][range.clone()]);
    let strength = load(&slice.strength);
    let before = load(&pixels.transmittance);
    let weight = before * opacity(simd, settings.opacity, strength);
    (before - weight).store_slice(&mut pixels.transmittance[at.row][range.clone()]);
    // The mean is sum / strength; an empty pixel has a weight and sums of 0.
    let share = weight / strength.max(S::f32s::splat(simd, f32::MIN_POSITIVE));
    let [r, g, b, depth] = &slice.weighted;
    for (plane, sums) in pixels.rgb.iter_mut().zip([r, g, b]) {
        let sum = share.mul_add(load(sums), load(plane));
        sum.store_slice(&mut plane[at.row][range.clone()]);
    }
    if settings.depth == DepthRule::Expected {
        let sum = share.mul_add(load(depth), load(&pixels.depth));
        sum.store_slice(&mut pixels.depth[at.row][range]);
    }
}
