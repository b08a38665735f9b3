//! Samples of a brick that the clip or the mask cuts: those that are hidden are left out, exactly, and a rule takes the
//! others in.
//!
//! A half-space of the clip is an affine function of the position in the grid; it is evaluated at the sample's own
//! position, for the half-spaces alone that cut the brick. The mask is that of the nearest voxel.

use std::marker::PhantomData;

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use crate::bricks::cells::TABLE_LEN;
use crate::field::cell_sample::{Located, nearest_places};
use crate::field::gather::{GatherScratch, Job, SampleRule};
use crate::sheets::view::{HalfRow, LANES, PlaneView};

/// The rule `R` for the samples that clip and mask keep.
pub(super) struct Clipped<R>(PhantomData<R>);

impl<R: SampleRule> SampleRule for Clipped<R> {
    #[inline(always)]
    fn take<S: Simd>(
        simd: S,
        job: &Job,
        on: (HalfRow, &PlaneView),
        located: &Located<S>,
        scratch: &mut GatherScratch,
    ) -> bool {
        let kept = masked(simd, job, &unclipped(simd, job, located));
        if kept.inside.all_false() {
            return false;
        }
        R::take(simd, job, on, &kept, scratch)
    }
}

/// The samples without those that the clip cuts off.
#[inline(always)]
fn unclipped<S: Simd>(simd: S, job: &Job, located: &Located<S>) -> Located<S> {
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
pub(super) fn masked<S: Simd>(simd: S, job: &Job, located: &Located<S>) -> Located<S> {
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
