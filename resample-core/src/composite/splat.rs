//! Ellipse scan conversion: composites one splat over a tile row by row, or adds it to the open slice.

use fearless_simd::prelude::*;

use super::state::{DepthRule, IndexRule, OpacityMode, SliceSums, TileSettings, TileWork, add};
use crate::composite::maps::TileMaps;
use crate::simd::opacity_from_optical_depth;
use crate::tile::{Primitive, TILE_PX};

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

/// A pixel's opacity from what a splat or a sheet adds to it.
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
