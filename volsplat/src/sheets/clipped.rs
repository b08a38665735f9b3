//! Samples of a brick that the clip cuts: those outside are left out, exactly, and a rule takes the others in.
//!
//! A half-space of the clip is an affine function of the position in the grid; it is evaluated at the sample's own
//! position, for the half-spaces alone that cut the brick.

use std::marker::PhantomData;

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::cell_sample::{HalfRow, Located};
use super::frame::PlaneView;
use super::gather::{GatherScratch, Job, SampleRule};

/// The rule `R` for the samples that the clip keeps.
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
        let kept = kept(simd, job, located);
        if kept.inside.all_false() {
            return false;
        }
        R::take(simd, job, on, &kept, scratch)
    }
}

/// The samples without those that the clip cuts off.
#[inline(always)]
pub(super) fn kept<S: Simd>(simd: S, job: &Job, located: &Located<S>) -> Located<S> {
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
