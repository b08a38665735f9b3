//! Light on half a row of samples.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use crate::field::settings::TileContext;
use crate::field::walk::cell_sample::Located;
use crate::field::walk::gradient::interpolated_gradient;
use crate::light::Lit;

/// Lights the samples whose weight is above 0; `None` where nothing is shaded.
#[inline(always)]
pub(crate) fn lit<S: Simd>(
    simd: S,
    job: &TileContext,
    located: &Located<S>,
    weight: f32x8<S>,
) -> Option<Lit<f32x8<S>>> {
    let (shade, gradients) = (
        job.settings.sheets.shade.as_ref()?,
        job.placed.brick.gradients.as_ref()?,
    );
    let gradients = (gradients, &job.settings.from_differences);
    let gradient = interpolated_gradient(simd, gradients, located, weight);
    Some(shade.light(simd, gradient, job.view.rays(simd, located.at)))
}
