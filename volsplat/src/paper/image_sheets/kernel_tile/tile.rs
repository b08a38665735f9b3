//! One tile of sheets, summed from kernels cut into slab sections, or from points.
//!
//! Each voxel adds what it carries, times the integral of its kernel along each pixel's ray through the slab, to every slab
//! that cuts the kernel. As voxels come sorted by the first slab that they reach, only as many slabs are open as a kernel
//! spans. A slab that nothing can reach any more is composited behind those before it: its sums are either extinction and
//! colours (pre-classified), or scalar and weight, whose quotient is classified now (post-classified), and where samples
//! are lit also the gradient. The clip and the near plane cut each ray, and with it the sections, exactly.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::composite::TileCounts;
use resample_core::dispatch;
use resample_core::section::{ALONG, ALONG_POLYNOMIAL, Powers};
use resample_core::sort::{entry_index, entry_key};
use resample_core::tile::TILE_PX;

use super::ball::add_ball;
use super::close::close_slabs;
use super::sums::{
    KernelSample, KernelScratch, SUMS_LIT, SUMS_POST, SUMS_PRE, SlabSums, Tile, slab,
};
use crate::look::options::{Classify, Interpolate};

/// Renders a tile from its sorted entries. `voxels` holds each chunk's voxels.
pub(crate) fn render_tile(
    tile: Tile,
    entries: &[u64],
    voxels: &[&[KernelSample]],
    scratch: &mut KernelScratch,
) -> TileCounts {
    macro_rules! sum {
        ($count:expr) => {
            dispatch!(tile.settings.level, simd => render_entries::<_, { $count }>(simd, tile, entries, voxels, scratch))
        };
    }
    match tile.kernel.classify {
        Classify::Pre => sum!(SUMS_PRE),
        Classify::Post if tile.settings.needs_gradients() => sum!(SUMS_LIT),
        Classify::Post => sum!(SUMS_POST),
    }
}

#[simd]
fn render_entries<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    entries: &[u64],
    voxels: &[&[KernelSample]],
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
            match tile.kernel.profile.powers() {
                Powers::Few => {
                    add_ball::<_, SUMS, ALONG_POLYNOMIAL>(simd, tile, first, voxel, scratch)
                }
                Powers::All => add_ball::<_, SUMS, ALONG>(simd, tile, first, voxel, scratch),
            }
        };
        counts.composited += 1;
    }
    let end = open.saturating_add(ring_len as u32);
    close_slabs::<_, SUMS>(simd, tile, open..end, scratch);
    counts
}

/// Adds a point to the slab that it lies in, through the pixel's Gaussian. Returns the pixels touched.
#[inline(always)]
fn add_point<const SUMS: usize>(
    tile: Tile,
    number: u32,
    point: &KernelSample,
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
