//! Samples of a brick that the clip or the mask cuts: those that are hidden are left out, exactly.
//!
//! A half-space of the clip is an affine function of the position in the grid; it is evaluated at the sample's own
//! position, for the half-spaces alone that cut the brick. The mask is that of the nearest voxel.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use crate::bricks::cells::TABLE_LEN;
use crate::field::settings::TileContext;
use crate::field::walk::cell_sample::{Located, nearest_places};
use crate::slabs::view::LANES;

/// The samples that clip and mask keep; `None` if they keep none.
#[inline(always)]
pub(crate) fn clipped<S: Simd>(
    simd: S,
    job: &TileContext,
    located: &Located<S>,
) -> Option<Located<S>> {
    let kept = masked(simd, job, &unclipped(simd, job, located));
    (!kept.inside.all_false()).then_some(kept)
}

/// The samples without those that the clip cuts off.
#[inline(always)]
fn unclipped<S: Simd>(simd: S, job: &TileContext, located: &Located<S>) -> Located<S> {
    let constant = |v: f32| f32x8::splat(simd, v);
    let mut kept = *located;
    for (number, half) in job.settings.clip.iter().enumerate() {
        if job.placed.cuts >> number & 1 == 1 {
            let [x, y, z] = located.position;
            let height = x.mul_add(
                constant(half.normal[0]),
                y.mul_add(
                    constant(half.normal[1]),
                    z.mul_add(constant(half.normal[2]), constant(half.offset)),
                ),
            );
            kept.inside &= height.simd_ge(constant(0.0));
        }
    }
    kept
}

/// The samples without those whose nearest voxel the mask hides.
#[inline(always)]
pub(crate) fn masked<S: Simd>(simd: S, job: &TileContext, located: &Located<S>) -> Located<S> {
    let Some(mask) = job.placed.brick.mask.as_deref() else {
        return *located;
    };
    let places = nearest_places(simd, located);
    let mut shown = [0.0f32; LANES];
    for (shown, place) in shown.iter_mut().zip(places) {
        *shown = f32::from(mask[(place as usize).min(TABLE_LEN - 1)]);
    }
    let shown = f32x8::from_slice(simd, &shown).simd_gt(f32x8::splat(simd, 0.0));
    Located {
        inside: located.inside & shown,
        ..*located
    }
}
