//! The end of a slab: its sums are clamped and classified where that is wanted, and composited.

use fearless_simd::prelude::*;
use resample_core::composite::{DepthRule, TilePixels, opacity};
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use super::{KernelScratch, KernelSettings, SlabSums};
use crate::options::{Classify, Interpolate};
use crate::sheets::frame::SheetSettings;

/// Composites slabs, nearest first, and empties them. Returns whether the tile is opaque.
#[inline(always)]
pub(super) fn close_slabs<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    kernel: &KernelSettings,
    numbers: std::ops::Range<u32>,
    scratch: &mut KernelScratch,
) -> bool {
    let mut changed = false;
    for number in numbers {
        let sums = &mut scratch.ring[number as usize & (settings.ring_len - 1)];
        let [first, end] = sums.rows;
        for row in first..end {
            if kernel.interpolate == Interpolate::On {
                clamp_row(sums, row);
            }
            if kernel.classify == Classify::Post {
                classify_row(settings, sums, row);
            }
            composite_row(simd, settings, (sums, &mut scratch.pixels), row);
            for plane in &mut sums.planes {
                plane[row] = [0.0; TILE_PX];
            }
            changed = true;
        }
        sums.rows = [TILE_PX, 0];
    }
    changed && scratch.pixels.is_opaque(simd, settings.min_transmittance)
}

/// Clamps a row's sums of scalar times weight to what the voxels in reach allow, and forgets these.
#[inline(always)]
fn clamp_row(sums: &mut SlabSums, row: usize) {
    let [scalars, weights, _, _] = &mut sums.planes;
    for x in 0..TILE_PX {
        let ends = [0, 1].map(|end| sums.range[end][row][x] * weights[row][x]);
        // Where nothing reaches, the ends are no numbers, and the sum stays 0.
        scalars[row][x] = scalars[row][x].max(ends[0]).min(ends[1]);
        (sums.range[0][row][x], sums.range[1][row][x]) = (f32::INFINITY, f32::NEG_INFINITY);
    }
}

/// Turns a row's sums of scalar and weight into those of colours and strength.
#[inline(always)]
fn classify_row(settings: &SheetSettings, sums: &mut SlabSums, row: usize) {
    let [scalars, weights, needed, strengths] = &mut sums.planes;
    for x in 0..TILE_PX {
        let weight = weights[row][x];
        // Where no voxel that matters reaches, nothing is visible, and some of those that reach it may be missing.
        let classified = if needed[row][x] > 0.0 && weight > f32::MIN_POSITIVE {
            settings.table.at(scalars[row][x] / weight)
        } else {
            [0.0; 4]
        };
        let [r, g, b, strength] = classified;
        let added = strength * weight;
        (scalars[row][x], weights[row][x], needed[row][x]) = (r * added, g * added, b * added);
        strengths[row][x] = added;
    }
}

/// Composites a row of colours times strength, and strength, behind what the pixels hold.
#[inline(always)]
fn composite_row<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    (sums, pixels): (&SlabSums, &mut TilePixels),
    row: usize,
) {
    for lane in (0..TILE_PX).step_by(S::f32s::LEN) {
        let range = lane..lane + S::f32s::LEN;
        let load = |plane: &TilePlane| S::f32s::from_slice(simd, &plane[row][range.clone()]);
        let strength = load(&sums.planes[3]);
        let before = load(&pixels.transmittance);
        let weight = before * opacity(simd, settings.opacity, strength);
        (before - weight).store_slice(&mut pixels.transmittance[row][range.clone()]);
        let share = weight / strength.max(S::f32s::splat(simd, f32::MIN_POSITIVE));
        for (plane, colour) in pixels.rgb.iter_mut().zip(&sums.planes) {
            let sum = share.mul_add(load(colour), load(plane));
            sum.store_slice(&mut plane[row][range.clone()]);
        }
        if settings.depth == DepthRule::Expected {
            let sum = weight.mul_add(S::f32s::splat(simd, sums.view.camera_z), load(&pixels.depth));
            sum.store_slice(&mut pixels.depth[row][range.clone()]);
        }
    }
}
