//! Sections of the trilinear kernel: read on the plane through a slab's middle, times the length of the ray in the slab.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::maps::TilePlane;

use super::{KernelScratch, LANES, Laid, SlabSums, Tile, slab};

/// Adds a voxel to every slab that cuts its kernel. Returns the pixels looked at.
#[inline(always)]
pub(super) fn add_tent<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    first: u32,
    voxel: &Laid,
    scratch: &mut KernelScratch,
) -> usize {
    let mut touched = 0;
    for number in first..first + tile.settings.ring_len as u32 {
        let sums = slab(&tile, number, &mut scratch.ring);
        let Some(reach) = tile
            .settings
            .sections
            .at(sums.view.offset_z - voxel.offset_z)
        else {
            break;
        };
        let [x, y] = voxel.across;
        let [left, top, right, bottom] = reach.ends;
        let [x0, y0, x1, y1] = sums.covered([x + left, y + top, x + right, y + bottom]);
        if x0 >= x1 || y0 >= y1 {
            continue;
        }
        sums.rows = [sums.rows[0].min(y0), sums.rows[1].max(y1)];
        for lane in (x0 / LANES * LANES..x1).step_by(LANES) {
            for row in y0..y1 {
                add_lanes::<_, SUMS>(simd, tile, sums, (row, lane), voxel);
            }
            touched += (y1 - y0) * LANES;
        }
    }
    touched
}

/// Adds a voxel's section to one vector of pixels.
#[inline(always)]
fn add_lanes<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    sums: &mut SlabSums,
    (row, lane): (usize, usize),
    voxel: &Laid,
) {
    let constant = |v: f32| f32x8::splat(simd, v);
    let range = lane..lane + LANES;
    let load = |plane: &TilePlane| f32x8::from_slice(simd, &plane[row][range.clone()]);
    let view = &sums.view;
    let p: [f32x8<S>; 3] = std::array::from_fn(|axis| {
        let start = view.first[axis] - voxel.grid[axis] + row as f32 * view.step_y[axis];
        f32x8::from_slice(simd, &view.lanes[axis][range.clone()]) + constant(start)
    });
    let per_z = load(&tile.rays.per_z);
    let half = per_z * constant(0.5 * tile.settings.thickness as f32);
    let middle_z = constant(view.offset_z);
    let to = ((load(&tile.rays.kept[1]) - middle_z) * per_z).min(half);
    let from = ((load(&tile.rays.kept[0]) - middle_z) * per_z)
        .max(-half)
        .min(to);
    let tent = |d: f32x8<S>| (constant(1.0) - d.abs()).max(constant(0.0));
    let weight =
        tent(p[0]) * tent(p[1]) * tent(p[2]) * (to - from) * load(&tile.rays.unit_per_grid);
    if weight.simd_gt(constant(0.0)).any_true() {
        sums.add::<_, SUMS>(simd, (row, lane), weight, &voxel.value);
    }
}
