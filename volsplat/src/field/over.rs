//! Samples over one another: each is classified, lit where that is asked for, and composited behind those before it.
//!
//! The plain rule of a gathered sheet, emission and absorption: opacity from the extinction of the transfer function
//! along the ray through the slab.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::composite::{DepthRule, opacity};
use resample_core::tile::TILE_PX;

use crate::field::cell_sample::{Located, interpolated, interpolated_gradient};
use crate::field::gather::{GatherScratch, SampleRule};
use crate::field::job::Job;
use crate::light::Lit;
use crate::sheets::view::{LANES, PlaneView};

/// Emission and absorption, with the light of the shading or without.
pub(super) struct Over<const SHADED: bool>;

impl<const SHADED: bool> SampleRule for Over<SHADED> {
    #[inline(always)]
    fn take<S: Simd>(
        simd: S,
        job: &Job,
        plane: &PlaneView,
        located: &Located<S>,
        scratch: &mut GatherScratch,
    ) -> bool {
        let (settings, at) = (job.settings, located.at);
        let scalar = interpolated(
            simd,
            &job.placed.brick.scalars,
            &located.places,
            located.share,
        );
        let places = settings.sheets.table.places(simd, scalar).to_array();
        let mut strengths = [0.0f32; LANES];
        for (strength, &place) in strengths.iter_mut().zip(&places) {
            *strength = settings.sheets.table.entry(place)[3];
        }
        let zero = f32x8::splat(simd, 0.0);
        let strength = located
            .inside
            .select(f32x8::from_slice(simd, &strengths), zero);
        if strength.simd_gt(zero).all_false() {
            return false;
        }
        let range = at.first..at.first + LANES;
        let load = |plane: &[f32; TILE_PX]| f32x8::from_slice(simd, &plane[range.clone()]);
        let added = strength * load(&job.view.units_per_slab[at.row]);
        let before = load(&scratch.pixels.transmittance[at.row]);
        let weight = before * opacity(simd, settings.sheets.opacity, added);
        (before - weight).store_slice(&mut scratch.pixels.transmittance[at.row][range.clone()]);
        if settings.sheets.depth == DepthRule::Expected {
            let sum = weight.mul_add(
                f32x8::splat(simd, plane.camera_z),
                load(&scratch.pixels.depth[at.row]),
            );
            sum.store_slice(&mut scratch.pixels.depth[at.row][range.clone()]);
        }
        let sums = &mut scratch.rgb[at.row][range];
        // What is not lit has its own colour.
        let lit = if SHADED {
            lit(simd, job, located, weight)
        } else {
            None
        };
        match lit {
            None => {
                let weights = weight.to_array();
                for ((sum, &place), weight) in sums.iter_mut().zip(&places).zip(weights) {
                    for (sum, value) in sum.iter_mut().zip(settings.sheets.table.entry(place)) {
                        *sum += weight * value;
                    }
                }
            }
            Some(lit) => {
                let bodies = (weight * lit.body).to_array();
                let highlights = (weight * lit.highlight).to_array();
                for (lane, sum) in sums.iter_mut().enumerate() {
                    for (sum, value) in sum
                        .iter_mut()
                        .zip(settings.sheets.table.entry(places[lane]))
                    {
                        *sum += bodies[lane] * value + highlights[lane];
                    }
                }
            }
        }
        true
    }
}

/// What light makes of the samples whose weight is above 0; `None` where nothing is shaded.
#[inline(always)]
pub(super) fn lit<S: Simd>(
    simd: S,
    job: &Job,
    located: &Located<S>,
    weight: f32x8<S>,
) -> Option<Lit<S>> {
    let (shade, gradients) = (
        job.settings.sheets.shade.as_ref()?,
        job.placed.brick.gradients.as_ref()?,
    );
    let gradient = interpolated_gradient(simd, gradients, located, weight);
    Some(shade.light(simd, gradient, job.view.rays(simd, located.at)))
}
