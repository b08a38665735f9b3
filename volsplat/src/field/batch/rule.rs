//! What becomes of packed samples.

use fearless_simd::{Simd, mask32x16};

use crate::field::setup::tile_context::Job;
use crate::field::walk::gather::GatherScratch;

/// What becomes of packed samples.
pub(crate) trait PackedRule {
    /// True if samples hide those behind them.
    const HIDES: bool;

    /// Which pixels of a row take samples of the brick. Those that are found later are asked again, one by one.
    fn open<S: Simd>(simd: S, job: &Job, scratch: &GatherScratch, row: usize) -> mask32x16<S>;

    /// Takes the samples of the list in. There are some.
    fn take<S: Simd>(simd: S, job: &Job, scratch: &mut GatherScratch);
}
