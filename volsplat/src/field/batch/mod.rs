//! Samples of a brick, packed: those in cells that may show something, side by side, whatever pixels they belong to.
//!
//! A scan over blocks of pixels finds the samples on the planes of a brick (`planes`) that lie in such cells, a bit a cell, and appends
//! them to a list (`scan`). The list is interpolated, classified and lit a vector at a time (`classify`), and a rule takes its samples
//! one by one: emission and absorption of one channel (`composite`) or of several (`mixed`), or a statistic of rays (`statistic`).
//! Samples keep the order of planes, so that each pixel sees its own front to back.

pub(crate) mod planes;
mod scan;
mod classify;
mod composite;
mod mixed;
pub(crate) mod statistic;

use std::sync::atomic::{Ordering, compiler_fence};

use fearless_simd::{Simd, mask32x16};

use crate::field::settings::TileContext;
use crate::field::walk::scratch::FieldScratch;

pub(crate) use composite::Composite;
pub(crate) use mixed::Mixed;
pub(crate) use scan::add_brick;
pub(crate) use statistic::Statistics;

/// A rule for packed samples.
pub(crate) trait PackedRule {
    /// True if samples hide those behind them.
    const HIDES: bool;

    /// The pixels of a row that take samples of the brick. Those that are found later are tested again, one by one.
    fn open<S: Simd>(
        simd: S,
        job: &TileContext,
        scratch: &FieldScratch,
        row: usize,
    ) -> mask32x16<S>;

    /// Takes the samples of the list in. There are some.
    fn take<S: Simd>(simd: S, job: &TileContext, scratch: &mut FieldScratch);
}

/// Keeps the look-ups of a loop single loads. A compiler that makes gathers of them makes them slower: on Zen 5 a look-up in a
/// cell takes 8 cycles by gathers.
#[inline(always)]
fn one_by_one() {
    compiler_fence(Ordering::SeqCst);
}
