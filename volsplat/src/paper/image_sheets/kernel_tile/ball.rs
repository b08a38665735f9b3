//! Sections of a ball: what each ray collects of a radial kernel between the planes of the slabs.
//!
//! How far a ray passes from the centre is the same for all slabs. So pixels come first and slabs after: the distance, the
//! chord and the polynomial of the share are made once for a vector of rays, and the share up to a plane between two slabs
//! serves both of them.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use super::sums::{KernelSample, KernelScratch, LANES, SlabSums, Tile, slab};
use crate::look::options::Interpolate;
use crate::slabs::view::{HalfRow, PlaneView};

/// The slabs that a ball reaches, and the one that its rays are placed on.
struct Slabs {
    first: u32,
    count: u32,
    /// Counted from the first: the slab nearest to the centre, and its plane.
    middle: u32,
    view: PlaneView,
}

/// Adds a voxel to every slab that cuts its kernel. Returns the pixels looked at.
#[inline(always)]
pub(crate) fn add_ball<S: Simd, const SUMS: usize, const POWERS: usize>(
    simd: S,
    tile: Tile,
    first: u32,
    voxel: &KernelSample,
    scratch: &mut KernelScratch,
) -> usize {
    let Some((slabs, [x0, y0, x1, y1])) = placed(&tile, first, voxel, &mut scratch.ring) else {
        return 0;
    };
    // A ball of one vector's width takes one, wherever it begins.
    let starts = if x1 - x0 <= LANES {
        [x0.min(TILE_PX - LANES); 2]
    } else {
        [0, LANES]
    };
    let count = if x1 - x0 <= LANES { 1 } else { 2 };
    for row in y0..y1 {
        for &start in &starts[..count] {
            let open = f32x8::from_slice(
                simd,
                &scratch.pixels.transmittance[row][start..start + LANES],
            );
            if open
                .simd_ge(f32x8::splat(simd, tile.settings.min_transmittance))
                .all_false()
            {
                continue;
            }
            let at = HalfRow { row, first: start };
            add_rays::<_, SUMS, POWERS>(simd, tile, &slabs, at, voxel, &mut scratch.ring);
        }
    }
    (y1 - y0) * count * LANES * slabs.count as usize
}

/// The slabs of a ball and the pixels of the tile that may see it; `None` where none does.
#[inline(always)]
fn placed(
    tile: &Tile,
    first: u32,
    voxel: &KernelSample,
    ring: &mut [SlabSums],
) -> Option<(Slabs, [usize; 4])> {
    let settings = tile.settings;
    let nearest = slab(tile, first, ring);
    let per_slab = 1.0 / settings.thickness as f32;
    let to_centre = (voxel.offset_z - nearest.view.offset_z) * per_slab;
    let reach = settings.sections.reach_z * per_slab;
    // The last slab may begin where the ball ends: it then gets nothing.
    let count = ((to_centre + reach).floor().max(-1.0) as i32 + 1)
        .clamp(0, settings.ring_len as i32) as u32;
    let last = count.checked_sub(1)?;
    let middle = (to_centre.round().max(0.0) as u32).min(last);
    let [x, y] = voxel.across;
    let [left, top, right, bottom] = settings.sections.whole.ends;
    let ends = [x + left, y + top, x + right, y + bottom];
    let near = nearest.covered(ends);
    let far = slab(tile, first + last, ring).covered(ends);
    let [x0, y0] = [near[0].min(far[0]), near[1].min(far[1])];
    let [x1, y1] = [near[2].max(far[2]), near[3].max(far[3])];
    if x0 >= x1 || y0 >= y1 {
        return None;
    }
    for number in first..first + count {
        let sums = slab(tile, number, ring);
        sums.rows = [sums.rows[0].min(y0), sums.rows[1].max(y1)];
    }
    Some((
        Slabs {
            first,
            count,
            middle,
            view: slab(tile, first + middle, ring).view,
        },
        [x0, y0, x1, y1],
    ))
}

/// Adds a voxel to one vector of pixels in all slabs.
#[inline(always)]
fn add_rays<S: Simd, const SUMS: usize, const POWERS: usize>(
    simd: S,
    tile: Tile,
    slabs: &Slabs,
    at: HalfRow,
    voxel: &KernelSample,
    ring: &mut [SlabSums],
) {
    let constant = |v: f32| f32x8::splat(simd, v);
    let (view, row) = (&slabs.view, at.row);
    let range = at.first..at.first + LANES;
    let load = |plane: &TilePlane| f32x8::from_slice(simd, &plane[row][range.clone()]);
    // From the voxel to the ray's place on the middle slab's plane.
    let mut p = [constant(0.0); 3];
    for (axis, p) in p.iter_mut().enumerate() {
        let start = view.first[axis] - voxel.grid[axis] + row as f32 * view.step_y[axis];
        *p = f32x8::from_slice(simd, &view.lanes[axis][range.clone()]) + constant(start);
    }
    let rays = tile.rays;
    let d = [
        load(&rays.direction[0]),
        load(&rays.direction[1]),
        load(&rays.direction[2]),
    ];
    let t = p[0].mul_add(d[0], p[1].mul_add(d[1], p[2] * d[2]));
    let across = [p[0] - t * d[0], p[1] - t * d[1], p[2] - t * d[2]];
    let distance2 = across[0].mul_add(
        across[0],
        across[1].mul_add(across[1], across[2] * across[2]),
    );
    let Some(chord) = tile.kernel.profile.chord::<_, _, POWERS>(simd, distance2) else {
        return;
    };
    // Places on the chord, -1 to 1.
    let per_z = load(&rays.per_z) * chord.per_half;
    let middle = t * chord.per_half;
    let ends = [constant(-1.0), constant(1.0)];
    let mut kept = [load(&rays.kept[0]), load(&rays.kept[1])];
    for end in &mut kept {
        *end = (*end - constant(view.offset_z))
            .mul_add(per_z, middle)
            .max(ends[0])
            .min(ends[1]);
    }
    let [low, high] = kept;
    let step = per_z * constant(tile.settings.thickness as f32);
    let near_end = middle - step * constant(slabs.middle as f32 + 0.5);
    let whole = chord.whole * load(&rays.unit_per_grid);
    let mut before = chord.share(near_end.max(low).min(high));
    for k in 0..slabs.count {
        let place = step.mul_add(constant((k + 1) as f32), near_end);
        let share = chord.share(place.max(low).min(high));
        let weight = whole * (share - before).max(constant(0.0));
        before = share;
        if weight.simd_gt(constant(0.0)).all_false() {
            continue;
        }
        let number = slabs.first + k;
        let sums = &mut ring[number as usize & (tile.settings.ring_len - 1)];
        sums.add::<_, SUMS>(simd, at, weight, &voxel.value);
        if tile.kernel.interpolate == Interpolate::On {
            sums.widen_range(simd, at, weight, voxel.scalar);
        }
    }
}
