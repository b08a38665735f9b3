//! Points of a sheet: gathered pixel by pixel, composited once.
//!
//! A point does not cover a pixel, so the points of one depth range are summed, each through the pixel's Gaussian, and
//! the sums are composited as one sample of their optical depth and their extinction-weighted mean colour.
//! Source: Yuan et al. 2003, section 4.1.

use fearless_simd::prelude::*;

use super::splat::{RowLanes, opacity};
use super::state::{DepthRule, Sheet, TileCounts, TileSettings, TileWork, add};
use crate::tile::{Primitive, TILE_PX};

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
