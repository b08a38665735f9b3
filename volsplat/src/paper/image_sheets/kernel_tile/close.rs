//! The end of a slab: its sums are clamped, classified and lit where that is wanted, and composited.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::composite::{DepthRule, TilePixels, opacity};
use resample_core::tile::TILE_PX;

use super::sums::{KernelScratch, LANES, MOST_SUMS, SUMS_LIT, SlabSums, Tile};
use crate::look::options::{Classify, Interpolate};
use crate::slabs::settings::SheetSettings;
use crate::slabs::view::HalfRow;

/// A vector of pixels of one kind of sum.
type Lanes<S> = f32x8<S>;

/// Composites slabs, nearest first, and empties them. Returns whether the tile is opaque.
#[inline(always)]
pub(crate) fn close_slabs<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    numbers: std::ops::Range<u32>,
    scratch: &mut KernelScratch,
) -> bool {
    let mut changed = false;
    for number in numbers {
        let sums = &mut scratch.ring[number as usize & (tile.settings.ring_len - 1)];
        let [first, end] = sums.rows;
        for row in first..end {
            if tile.kernel.interpolate == Interpolate::On {
                clamp_row(sums, row);
            }
            for half in [0, LANES] {
                let at = HalfRow { row, first: half };
                close_half::<_, SUMS>(simd, tile, sums, &mut scratch.pixels, at);
            }
            sums.sums[row] = [[0.0; TILE_PX]; MOST_SUMS];
            changed = true;
        }
        sums.rows = [TILE_PX, 0];
    }
    changed
        && scratch
            .pixels
            .is_opaque(simd, tile.settings.min_transmittance)
}

/// Clamps a row's sums of scalar times weight to what the voxels in reach allow, and forgets these.
#[inline(always)]
fn clamp_row(sums: &mut SlabSums, row: usize) {
    let [scalars, weights, ..] = &mut sums.sums[row];
    for x in 0..TILE_PX {
        let ends = [0, 1].map(|end| sums.range[end][row][x] * weights[x]);
        // Where nothing reaches, the ends are no numbers, and the sum stays 0.
        scalars[x] = scalars[x].max(ends[0]).min(ends[1]);
        (sums.range[0][row][x], sums.range[1][row][x]) = (f32::INFINITY, f32::NEG_INFINITY);
    }
}

/// Composites half a row of a slab's sums.
#[inline(always)]
fn close_half<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    sums: &SlabSums,
    pixels: &mut TilePixels,
    at: HalfRow,
) {
    let row = &sums.sums[at.row];
    let load = |k: usize| f32x8::from_slice(simd, &row[k][at.first..at.first + LANES]);
    let added = match tile.kernel.classify {
        Classify::Pre => [load(0), load(1), load(2), load(3)],
        Classify::Post => {
            let Some(classified) = classified(simd, tile.settings, [load(0), load(1), load(2)])
            else {
                return;
            };
            if SUMS == SUMS_LIT {
                lit(
                    simd,
                    tile,
                    at,
                    load(1),
                    [load(3), load(4), load(5)],
                    classified,
                )
            } else {
                classified
            }
        }
    };
    composite(simd, tile.settings, sums.view.camera_z, pixels, at, added);
}

/// From sums of scalar, weight and need to colours times optical depth, and optical depth; `None` where nothing is seen.
#[inline(always)]
fn classified<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    [scalars, weights, needed]: [Lanes<S>; 3],
) -> Option<[Lanes<S>; 4]> {
    let zero = f32x8::splat(simd, 0.0);
    // Where no voxel that matters reaches, nothing is visible, and some of those that reach it may be missing.
    let matters = needed.simd_gt(zero) & weights.simd_gt(f32x8::splat(simd, f32::MIN_POSITIVE));
    if matters.all_false() {
        return None;
    }
    let weights = matters.select(weights, zero);
    let quotient = scalars / matters.select(weights, f32x8::splat(simd, 1.0));
    let places = settings.table.places(simd, quotient).to_array();
    let mut values = [[0.0f32; LANES]; 4];
    for lane in 0..LANES {
        let entry = settings.table.entry(places[lane]);
        for channel in 0..4 {
            values[channel][lane] = entry[channel];
        }
    }
    let value = |channel: usize| f32x8::from_slice(simd, &values[channel]);
    let depth = value(3) * weights;
    Some([value(0) * depth, value(1) * depth, value(2) * depth, depth])
}

/// Lights classified samples, and applies the ramp over the gradient.
#[inline(always)]
fn lit<S: Simd>(
    simd: S,
    tile: Tile,
    at: HalfRow,
    weights: Lanes<S>,
    gradient_sums: [Lanes<S>; 3],
    [red, green, blue, depth]: [Lanes<S>; 4],
) -> [Lanes<S>; 4] {
    let per_weight = f32x8::splat(simd, 1.0) / weights.max(f32x8::splat(simd, f32::MIN_POSITIVE));
    let [x, y, z] = gradient_sums;
    let gradient = [x * per_weight, y * per_weight, z * per_weight];
    let one = f32x8::splat(simd, 1.0);
    let left = tile
        .settings
        .gradient_ramp
        .map_or(one, |ramp| ramp.factor(simd, gradient));
    let depth = depth * left;
    let (body, added) = match &tile.settings.shade {
        None => (left, f32x8::splat(simd, 0.0)),
        Some(shade) => {
            let lit = shade.light(simd, gradient, tile.view.rays(simd, at));
            (left * lit.body, lit.highlight * depth)
        }
    };
    [
        red.mul_add(body, added),
        green.mul_add(body, added),
        blue.mul_add(body, added),
        depth,
    ]
}

/// Composites colours times optical depth, and optical depth, behind what the pixels hold.
#[inline(always)]
fn composite<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    camera_z: f32,
    pixels: &mut TilePixels,
    at: HalfRow,
    [red, green, blue, depth]: [Lanes<S>; 4],
) {
    let range = at.first..at.first + LANES;
    let load = |plane: &[f32; TILE_PX]| f32x8::from_slice(simd, &plane[range.clone()]);
    let before = load(&pixels.transmittance[at.row]);
    // Opaque pixels take no more: whether its sums are whole depends on the pixels beside it.
    let open = before.simd_ge(f32x8::splat(simd, settings.min_transmittance));
    let weight = open.select(
        before * opacity(simd, settings.opacity, depth),
        f32x8::splat(simd, 0.0),
    );
    (before - weight).store_slice(&mut pixels.transmittance[at.row][range.clone()]);
    let share = weight / depth.max(f32x8::splat(simd, f32::MIN_POSITIVE));
    for (plane, colour) in pixels.rgb.iter_mut().zip([red, green, blue]) {
        let sum = share.mul_add(colour, load(&plane[at.row]));
        sum.store_slice(&mut plane[at.row][range.clone()]);
    }
    if settings.depth == DepthRule::Expected {
        let sum = weight.mul_add(f32x8::splat(simd, camera_z), load(&pixels.depth[at.row]));
        sum.store_slice(&mut pixels.depth[at.row][range.clone()]);
    }
}
