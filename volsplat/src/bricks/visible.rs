//! Culling: the bricks that may reach into the view.

use rayon::prelude::*;
use resample_core::clock::StageClock;

use super::cells::CellBrick;
use super::cull::ViewVolume;
use crate::grid::bounds::Bounds;
use crate::stats::FrameStats;

/// A brick of either kind, as culling and chunking see it.
pub(crate) trait BrickOfSamples: Sync {
    /// Where its samples lie.
    fn bounds(&self) -> &Bounds;
    /// How many there are.
    fn sample_count(&self) -> usize;
}

impl BrickOfSamples for CellBrick {
    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Cells in the box of the visible ones: what a brick out of view spares.
    fn sample_count(&self) -> usize {
        let [low, high] = self.bounds.range();
        (0..3)
            .map(|axis| usize::from(high[axis] - low[axis]))
            .product()
    }
}

/// The bricks that may reach into the view; the samples of the others are counted as culled.
pub(crate) fn visible_bricks<B: BrickOfSamples>(
    bricks: &[B],
    view_volume: &ViewVolume,
    stats: &mut FrameStats,
) -> Vec<usize> {
    let clock = StageClock::start();
    let seen: Vec<bool> = bricks
        .par_iter()
        .map(|brick| view_volume.sees(brick.bounds()))
        .collect();
    let (visible, hidden): (Vec<usize>, Vec<usize>) = (0..bricks.len()).partition(|&i| seen[i]);
    stats.bricks_outside += hidden.len() as u64;
    stats.culled += hidden
        .iter()
        .map(|&i| bricks[i].sample_count() as u64)
        .sum::<u64>();
    stats.stages.cull += clock.stop();
    visible
}
