//! Samples that show something, composited one by one behind what their pixels hold.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, mask32x16};
use resample_core::composite::DepthRule;
use resample_core::tile::TILE_PX;

use super::classify::{classify, light};
use super::rule::PackedRule;
use crate::field::settings::TileContext;
use crate::field::walk::gather::GatherScratch;
use crate::field::walk::lists::PIXEL_SHIFT;

/// Pixels of a tile.
const PIXELS: usize = TILE_PX * TILE_PX;

/// Emission and absorption, with the light of the shading or without.
pub(crate) struct Composite<const SHADED: bool>;

impl<const SHADED: bool> PackedRule for Composite<SHADED> {
    const HIDES: bool = true;

    /// Opaque pixels take no more samples.
    #[inline(always)]
    fn open<S: Simd>(
        simd: S,
        job: &TileContext,
        scratch: &GatherScratch,
        row: usize,
    ) -> mask32x16<S> {
        let left = f32x16::from_slice(simd, &scratch.pixels.transmittance[row]);
        left.simd_ge(f32x16::splat(simd, job.settings.sheets.min_transmittance))
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, job: &TileContext, scratch: &mut GatherScratch) {
        classify(simd, job, &mut scratch.samples);
        if SHADED {
            light(simd, job, &mut scratch.samples);
        }
        composite::<S, SHADED>(simd, job, scratch);
    }
}

/// Composites what was classified.
#[inline(always)]
fn composite<S: Simd, const SHADED: bool>(simd: S, job: &TileContext, scratch: &mut GatherScratch) {
    let settings = job.settings;
    let least = settings.sheets.min_transmittance;
    let with_depth = settings.sheets.depth == DepthRule::Expected;
    let shown = &scratch.samples.shown;
    let transmittance = scratch.pixels.transmittance.as_flattened_mut();
    let depth = scratch.pixels.depth.as_flattened_mut();
    let rgb = scratch.rgb.as_flattened_mut();
    let mut contributed = 0;
    for k in 0..shown.count {
        let pixel = (shown.place[k] >> PIXEL_SHIFT) as usize % PIXELS;
        let before = transmittance[pixel];
        // Opaque pixels take no more samples, one by one, so that the picture does not depend on which other bricks
        // the tile saw before.
        if !(before >= least) {
            continue;
        }
        contributed += 1;
        let weight = before * shown.opacity[k];
        transmittance[pixel] = before - weight;
        let colour = settings.sheets.table.entry(shown.entry[k] as i32);
        let colour = f32x4::from_slice(simd, &colour);
        let sum = f32x4::from_slice(simd, &rgb[pixel]);
        let added = if SHADED {
            let body = f32x4::splat(simd, weight * shown.body[k]);
            body * colour + f32x4::splat(simd, weight * shown.highlight[k])
        } else {
            f32x4::splat(simd, weight) * colour
        };
        (sum + added).store_slice(&mut rgb[pixel]);
        if with_depth {
            let z = f32x4::splat(simd, shown.camera_z[k]);
            let sum = f32x4::splat(simd, weight).mul_add(z, f32x4::splat(simd, depth[pixel]));
            depth[pixel] = sum.to_array()[0];
        }
    }
    scratch.work.contributed += contributed;
}
