//! A list of samples, classified, lit and composited.

use fearless_simd::Simd;

use super::classify::{classify, light};
use super::composite::composite;
use super::samples::LANES;
use crate::field::gather::GatherScratch;
use crate::field::job::Job;

/// Classifies and composites the samples that wait.
#[inline(always)]
pub(super) fn flush<S: Simd, const SHADED: bool>(simd: S, job: &Job, scratch: &mut GatherScratch) {
    if scratch.samples.is_empty() {
        return;
    }
    let count = scratch.samples.len();
    scratch.work.computed += count.next_multiple_of(LANES);
    scratch.work.shown += count;
    classify(simd, job, &mut scratch.samples);
    if SHADED {
        light(simd, job, &mut scratch.samples);
    }
    composite::<S, SHADED>(simd, job, scratch);
    scratch.samples.clear();
}
