//! Samples that show something, composited one by one behind what their pixels hold.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, mask32x16};
use resample_core::composite::DepthRule;

use super::PackedRule;
use super::classify::{classify, light};
use crate::field::settings::TileContext;
use crate::field::walk::lists::PIXEL_SHIFT;
use crate::field::walk::scratch::FieldScratch;

/// Emission and absorption, with the light of the shading or without.
pub(crate) struct Composite<const SHADED: bool>;

impl<const SHADED: bool> PackedRule for Composite<SHADED> {
    const HIDES: bool = true;

    #[inline(always)]
    fn open<S: Simd>(
        simd: S,
        job: &TileContext,
        scratch: &FieldScratch,
        row: usize,
    ) -> mask32x16<S> {
        not_opaque(simd, job, scratch, row)
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, job: &TileContext, scratch: &mut FieldScratch) {
        classify(simd, job, &mut scratch.samples);
        if SHADED {
            let gradients = job.placed.brick.gradients.as_ref();
            light(simd, job, gradients, &mut scratch.samples);
        }
        composite::<S, SHADED>(simd, job, scratch);
    }
}

/// Composites what was classified.
#[inline(always)]
fn composite<S: Simd, const SHADED: bool>(simd: S, job: &TileContext, scratch: &mut FieldScratch) {
    let settings = job.settings;
    let least = settings.sheets.min_transmittance;
    let with_depth = settings.sheets.depth == DepthRule::Expected;
    let FieldScratch {
        samples,
        pixels,
        work,
        ..
    } = scratch;
    let shown = &samples.shown;
    let mut contributed = 0;
    for k in 0..shown.count {
        let colour = |weight: f32| {
            let entry = settings.sheets.table.entry(shown.entry[k] as i32);
            let entry = f32x4::from_slice(simd, &entry);
            if SHADED {
                let body = f32x4::splat(simd, weight * shown.body[k]);
                body * entry + f32x4::splat(simd, weight * shown.highlight[k])
            } else {
                f32x4::splat(simd, weight) * entry
            }
        };
        let pixel = (shown.place[k] >> PIXEL_SHIFT) as usize;
        let z = with_depth.then_some(shown.camera_z[k]);
        contributed += usize::from(pixels.add(simd, pixel, (shown.opacity[k], least), z, colour));
    }
    work.contributed += contributed;
}

/// The pixels of a row that are not opaque: the others take no more samples.
#[inline(always)]
pub(crate) fn not_opaque<S: Simd>(
    simd: S,
    job: &TileContext,
    scratch: &FieldScratch,
    row: usize,
) -> mask32x16<S> {
    let left = f32x16::from_slice(simd, &scratch.pixels.transmittance[row]);
    left.simd_ge(f32x16::splat(simd, job.settings.sheets.min_transmittance))
}
