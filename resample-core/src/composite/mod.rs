//! Compositing of one screen tile: points and splats over one another, front to back.
//!
//! A splat adds optical depth tau F(d) to each pixel; the pixel's opacity for it is 1 - exp(-tau F), so the product
//! of the transmittances of overlapping splats is exp(-integral of the reconstructed extinction), exactly; only the
//! order of colours inside an overlap is approximated. Points do not cover a pixel, so those within a depth range (a
//! sheet) are summed first and composited once, with the extinction-weighted mean colour.
//!
//! In slices ([`composite_slices`]) everything of one slice is summed before it is composited, splats as well.
//!
//! The hot loop works on whole rows of a tile, structure of arrays, generic over the vector width.
//! Source: Yuan et al. 2003, section 4.1 (order, sheets of points); Westover 1990 for the linear opacity.

pub mod maps;
mod slices;
mod state;
pub mod surface;

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;

use crate::composite::maps::TileMaps;
pub use crate::composite::slices::composite_slices;
pub use crate::composite::state::{
    DepthRule, IndexRule, Lost, OpacityMode, Sheet, SliceSums, TileCounts, TilePixels,
    TileSettings, TileWork,
};
use crate::composite::state::{ENTRIES_PER_CHECK, add};
use crate::dispatch;
use crate::simd::opacity_from_optical_depth;
use crate::sort::entry_index;
use crate::tile::{POINT_ROWS, Primitive, TILE_PX};

/// From this many entries on, what rounding takes from each sum is kept. Each entry rounds by 2^-25 at most, so that a
/// shorter list is off by 1e-3 at most.
const MANY: usize = 1 << 15;

/// Composites the sorted `entries` of the tile whose first pixel is `corner_px` onto `pixels`.
pub fn composite_tile(
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [usize; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    let corner_px = corner_px.map(|c| c as f32);
    if entries.len() > MANY {
        tile.lost = Lost::default();
        return dispatch!(settings.level, simd => composite_many(simd, settings, tile, corner_px, entries, chunks));
    }
    dispatch!(settings.level, simd => composite_few(simd, settings, tile, corner_px, entries, chunks))
}

#[simd]
fn composite_few<S: Simd>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    composite_entries::<S, false>(simd, settings, tile, corner_px, entries, chunks)
}

#[simd]
fn composite_many<S: Simd>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    composite_entries::<S, true>(simd, settings, tile, corner_px, entries, chunks)
}

#[inline(always)]
fn composite_entries<S: Simd, const KEPT: bool>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    let mut counts = TileCounts::default();
    let sheets_per_unit = 1.0 / settings.sheet_thickness;
    let mut gathered = [Primitive::default(); ENTRIES_PER_CHECK];
    for block in entries.chunks(ENTRIES_PER_CHECK) {
        // Depth order is random order in memory: fetched together, the misses of a block overlap.
        for (slot, &entry) in gathered.iter_mut().zip(block) {
            let index = entry_index(entry) as usize;
            *slot = chunks[index >> 16][index & 0xffff];
        }
        for primitive in &gathered[..block.len()] {
            if primitive.rows == POINT_ROWS {
                let number = (primitive.depth * sheets_per_unit) as u32;
                if number != tile.sheet.number {
                    close_sheet::<S, KEPT>(simd, settings, tile, &mut counts);
                    tile.sheet.number = number;
                }
                counts.pixels_touched +=
                    gather_point(settings, &mut tile.sheet, corner_px, primitive);
            } else {
                close_sheet::<S, KEPT>(simd, settings, tile, &mut counts);
                counts.pixels_touched +=
                    composite_splat::<S, false, KEPT>(simd, settings, tile, corner_px, primitive);
            }
        }
        counts.composited += block.len();
        if tile.pixels.is_opaque(simd, settings.min_transmittance) {
            break;
        }
    }
    close_sheet::<S, KEPT>(simd, settings, tile, &mut counts);
    counts
}

// Points of a sheet: gathered pixel by pixel, composited once.
//
// A point does not cover a pixel, so the points of one depth range are summed, each through the pixel's Gaussian, and
// the sums are composited as one sample of their optical depth and their extinction-weighted mean colour.
// Source: Yuan et al. 2003, section 4.1.

/// Adds a point to the open sheet. Returns the pixels touched.
#[inline(always)]
pub(super) fn gather_point(
    settings: &TileSettings,
    sheet: &mut Sheet,
    corner_px: [f32; 2],
    point: &Primitive,
) -> usize {
    let across = settings.filter.along_axis(point.x - corner_px[0]);
    let down = settings.filter.along_axis(point.y - corner_px[1]);
    let [r, g, b] = point.rgb;
    let colour = [
        r * point.strength,
        g * point.strength,
        b * point.strength,
        point.strength,
    ];
    let mut touched = 0;
    for (tap_y, weight_y) in down.weights.iter().enumerate() {
        let Some(row) = pixel(down.first, tap_y) else {
            continue;
        };
        for (tap_x, weight_x) in across.weights.iter().enumerate() {
            let Some(column) = pixel(across.first, tap_x) else {
                continue;
            };
            let weight = weight_x * weight_y;
            for (sum, value) in sheet.sums[row][column].iter_mut().zip(colour) {
                *sum += weight * value;
            }
            touched += 1;
        }
        sheet.rows = [sheet.rows[0].min(row), sheet.rows[1].max(row + 1)];
    }
    sheet.strength += point.strength;
    sheet.strength_depth += point.strength * point.depth;
    touched
}

/// The pixel of a tap, if the tile holds it.
#[inline(always)]
pub(super) fn pixel(first: i32, tap: usize) -> Option<usize> {
    usize::try_from(first + tap as i32)
        .ok()
        .filter(|&p| p < TILE_PX)
}

/// Composites the open sheet, if it holds anything, and empties it.
#[inline(always)]
pub(super) fn close_sheet<S: Simd, const KEPT: bool>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    counts: &mut TileCounts,
) {
    let [first, end] = tile.sheet.rows;
    if first >= end {
        return;
    }
    let depth = tile.sheet.strength_depth / tile.sheet.strength.max(f32::MIN_POSITIVE);
    for row in first..end {
        let sums = std::mem::replace(&mut tile.sheet.sums[row], [[0.0; 4]; TILE_PX]);
        let planes: [[f32; TILE_PX]; 4] =
            std::array::from_fn(|k| std::array::from_fn(|x| sums[x][k]));
        for lane in (0..TILE_PX).step_by(S::f32s::LEN) {
            let at = RowLanes { row, lane };
            composite_sheet_lanes::<S, KEPT>(simd, settings, tile, at, &planes, depth);
        }
    }
    counts.pixels_touched += (end - first) * TILE_PX;
    tile.sheet.rows = [TILE_PX, 0];
    (tile.sheet.strength, tile.sheet.strength_depth) = (0.0, 0.0);
}

#[inline(always)]
fn composite_sheet_lanes<S: Simd, const KEPT: bool>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    at: RowLanes,
    planes: &[[f32; TILE_PX]; 4],
    depth: f32,
) {
    let range = at.lane..at.lane + S::f32s::LEN;
    let load = |plane: &[f32; TILE_PX]| S::f32s::from_slice(simd, &plane[range.clone()]);
    let strength = load(&planes[3]);
    let TileWork { pixels, lost, .. } = tile;
    let transmittance = &mut pixels.transmittance[at.row][range.clone()];
    let before = S::f32s::from_slice(simd, transmittance);
    let weight = before * opacity(simd, settings.opacity, strength);
    let lost_here = &mut lost.transmittance[at.row][range.clone()];
    add::<S, KEPT>(simd, transmittance, lost_here, -weight);
    // The mean colour is sum / strength; an empty pixel has a weight and sums of 0.
    let share = weight / strength.max(S::f32s::splat(simd, f32::MIN_POSITIVE));
    for (channel, sums) in planes[..3].iter().enumerate() {
        let lanes = &mut pixels.rgb[channel][at.row][range.clone()];
        if KEPT {
            let lost_here = &mut lost.rgb[channel][at.row][range.clone()];
            add::<S, KEPT>(simd, lanes, lost_here, share * load(sums));
        } else {
            share
                .mul_add(load(sums), S::f32s::from_slice(simd, lanes))
                .store_slice(lanes);
        }
    }
    if settings.depth == DepthRule::Expected {
        let lanes = &mut pixels.depth[at.row][range.clone()];
        weight
            .mul_add(
                S::f32s::splat(simd, depth),
                S::f32s::from_slice(simd, lanes),
            )
            .store_slice(lanes);
    }
}

// Ellipse scan conversion: composites one splat over a tile row by row, or adds it to the open slice.

/// Lays one splat over the tile, or adds it to the open slice, row by row. Returns the pixels looked at.
#[inline(always)]
pub(super) fn composite_splat<S: Simd, const SLICED: bool, const KEPT: bool>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    splat: &Primitive,
) -> usize {
    // A tile's rows and a splat's rows are whole numbers below 2^16: exact in f32 and in usize.
    let corner_row = corner_px[1] as usize;
    let first = usize::from(splat.rows[0]).saturating_sub(corner_row);
    let end = usize::from(splat.rows[1])
        .saturating_sub(corner_row)
        .min(TILE_PX);
    let (x, y) = (splat.x - corner_px[0], splat.y - corner_px[1]);
    let [xx, xy2, yy] = splat.form;
    for lane in (0..TILE_PX).step_by(S::f32s::LEN) {
        let dx = S::f32s::from_fn(simd, |i| (lane + i) as f32 + 0.5) - S::f32s::splat(simd, x);
        let xx_dx2 = dx * dx * S::f32s::splat(simd, xx);
        for row in first..end {
            let dy = row as f32 + 0.5 - y;
            let (linear, constant) = (
                S::f32s::splat(simd, xy2 * dy),
                S::f32s::splat(simd, yy * dy * dy),
            );
            let form = dx.mul_add(linear, xx_dx2) + constant;
            let at = RowLanes { row, lane };
            let Some(added) = added_lanes(simd, settings, &tile.maps, at, form, splat) else {
                continue;
            };
            if SLICED {
                add_lanes(simd, &mut tile.slice, at, added, splat);
            } else {
                composite_lanes::<S, KEPT>(simd, settings, tile, at, added, splat);
            }
        }
    }
    end.saturating_sub(first) * TILE_PX
}

/// A vector's place in a tile.
#[derive(Clone, Copy)]
pub(super) struct RowLanes {
    pub(super) row: usize,
    pub(super) lane: usize,
}

/// The optical depth that a splat adds to a vector of pixels, given the value of its form; `None` if it misses them.
#[inline(always)]
fn added_lanes<S: Simd>(
    simd: S,
    settings: &TileSettings,
    maps: &TileMaps,
    at: RowLanes,
    form: S::f32s,
    splat: &Primitive,
) -> Option<S::f32s> {
    let range = at.lane..at.lane + S::f32s::LEN;
    let constant = |x: f32| S::f32s::splat(simd, x);
    let mut q = form * S::f32s::from_slice(simd, &maps.form_scale[at.row][range.clone()]);
    if settings.index == IndexRule::ConeCorrected {
        q = q / (constant(1.0 - splat.sin2_cone) + q * constant(splat.sin2_cone));
    }
    let u = constant(1.0) - q;
    let inside = u.simd_gt(constant(0.0));
    if inside.all_false() {
        return None;
    }
    let u = u.max(constant(0.0));
    let coefficients = &settings.profile.coefficients;
    let mut poly = constant(coefficients[coefficients.len() - 1]);
    for &c in coefficients[..coefficients.len() - 1].iter().rev() {
        poly = poly.mul_add(u, constant(c));
    }
    // A fitted profile may undershoot 0 near its edge, and a negative sum has no mean colour.
    let poly = poly.max(constant(0.0));
    let unit_per_grid = S::f32s::from_slice(simd, &maps.unit_per_grid[at.row][range]);
    Some((u * u.sqrt()) * (poly * constant(splat.strength)) * unit_per_grid)
}

/// Lays one vector of a splat, which adds this to the optical depth, over the pixels.
#[inline(always)]
fn composite_lanes<S: Simd, const KEPT: bool>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    at: RowLanes,
    added: S::f32s,
    splat: &Primitive,
) {
    let range = at.lane..at.lane + S::f32s::LEN;
    let constant = |x: f32| S::f32s::splat(simd, x);
    let opacity = opacity(simd, settings.opacity, added);
    let TileWork { pixels, lost, .. } = tile;
    let transmittance = &mut pixels.transmittance[at.row][range.clone()];
    let weight = S::f32s::from_slice(simd, transmittance) * opacity;
    let lost_here = &mut lost.transmittance[at.row][range.clone()];
    add::<S, KEPT>(simd, transmittance, lost_here, -weight);
    for channel in 0..3 {
        let lanes = &mut pixels.rgb[channel][at.row][range.clone()];
        let value = constant(splat.rgb[channel]);
        if KEPT {
            let lost_here = &mut lost.rgb[channel][at.row][range.clone()];
            add::<S, KEPT>(simd, lanes, lost_here, weight * value);
        } else {
            weight
                .mul_add(value, S::f32s::from_slice(simd, lanes))
                .store_slice(lanes);
        }
    }
    if settings.depth == DepthRule::Expected {
        let lanes = &mut pixels.depth[at.row][range];
        weight
            .mul_add(constant(splat.depth), S::f32s::from_slice(simd, lanes))
            .store_slice(lanes);
    }
}

/// Returns the opacity of one splat or sheet at a pixel, from the optical depth or coverage that it adds.
#[inline(always)]
pub fn opacity<S, F>(simd: S, mode: OpacityMode, added: F) -> F
where
    S: Simd,
    F: SimdFloat<S, Element = f32>,
    F::Bits: SimdInt<S, Element = u32>,
{
    match mode {
        OpacityMode::Extinction => opacity_from_optical_depth(simd, added),
        OpacityMode::Linear => added.min(F::splat(simd, 1.0)),
    }
}

/// Adds a vector of a splat's optical depths to the sums.
#[inline(always)]
fn add_lanes<S: Simd>(
    simd: S,
    slice: &mut SliceSums,
    at: RowLanes,
    added: S::f32s,
    splat: &Primitive,
) {
    let range = at.lane..at.lane + S::f32s::LEN;
    let strength = &mut slice.strength[at.row][range.clone()];
    (S::f32s::from_slice(simd, strength) + added).store_slice(strength);
    let [r, g, b] = splat.rgb;
    for (plane, value) in slice.weighted.iter_mut().zip([r, g, b, splat.depth]) {
        let lanes = &mut plane[at.row][range.clone()];
        added
            .mul_add(
                S::f32s::splat(simd, value),
                S::f32s::from_slice(simd, lanes),
            )
            .store_slice(lanes);
    }
}

#[cfg(test)]
mod tests;
