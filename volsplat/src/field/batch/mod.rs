//! Samples of a brick, packed: those in cells that may show something, side by side, whatever pixels they belong to.
//!
//! For one channel of scalars: emission and absorption with light or without (`composite`), and statistics of rays
//! (`gathered`). `runs` finds the planes of a long brick that are met at all. A scan over blocks of pixels (`blocks`) finds which samples on the planes of a brick lie in such cells, a bit a cell, and appends them to
//! a list (`scan`). The list is interpolated (`interpolate`), classified and lit a vector at a time (`classify`), and
//! what is left of it is taken in sample by sample. Samples keep the order of planes, so that each pixel sees its own
//! front to back.

mod blocks;
mod classify;
mod composite;
mod gathered;
mod interpolate;
mod rule;
pub(crate) mod runs;
mod scan;

use std::sync::atomic::{Ordering, compiler_fence};

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use crate::field::settings::TileContext;
use crate::field::walk::gather::{GatherScratch, Window};

pub(crate) use composite::Composite;
pub(crate) use gathered::Statistics;
use rule::PackedRule;

/// Keeps the look-ups of a loop single loads. A compiler that makes gathers of them makes them slower: on Zen 5 a look-up in a
/// cell takes 8 cycles by gathers.
#[inline(always)]
fn one_by_one() {
    compiler_fence(Ordering::SeqCst);
}

/// Takes all samples of a brick in. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
pub(crate) fn add_brick<S: Simd, R: PackedRule>(
    simd: S,
    job: &TileContext,
    window: Window,
    scratch: &mut GatherScratch,
) -> (usize, bool) {
    let contributed = scratch.work.contributed;
    let touched = scan::add_planes::<S, R>(simd, job, window, scratch);
    let seen = R::HIDES && scratch.work.contributed > contributed;
    let least = job.settings.sheets.min_transmittance;
    (touched, seen && scratch.pixels.is_opaque(simd, least))
}
