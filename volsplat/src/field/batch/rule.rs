//! Rules for packed samples.

use fearless_simd::{Simd, mask32x16};

use crate::field::settings::TileContext;
use crate::field::walk::gather::GatherScratch;

/// A rule for packed samples.
pub(crate) trait PackedRule {
    /// True if samples hide those behind them.
    const HIDES: bool;

    /// The pixels of a row that take samples of the brick. Those that are found later are tested again, one by one.
    fn open<S: Simd>(
        simd: S,
        job: &TileContext,
        scratch: &GatherScratch,
        row: usize,
    ) -> mask32x16<S>;

    /// Takes the samples of the list in. There are some.
    fn take<S: Simd>(simd: S, job: &TileContext, scratch: &mut GatherScratch);
}
