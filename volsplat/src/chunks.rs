//! Chunks: the bricks in view, cut into runs that one task projects.
//!
//! The cut looks at the bricks alone, never at the number of threads.

use cpu_time::ThreadTime;
use rayon::prelude::*;

use crate::cells::CellBrick;
use crate::cull::ViewVolume;
use crate::sample::{Bounds, Brick};
use crate::stats::{FrameStats, StageClock};
use crate::tiles::elapsed_ms;

/// Samples of a chunk: its primitives (48 bytes each) then stay in the second-level cache while they are binned.
const CHUNK_SAMPLES: usize = 1 << 14;

/// A brick of either kind, as culling and chunking see it.
pub(crate) trait BrickOfSamples: Sync {
    /// Where its samples lie.
    fn bounds(&self) -> &Bounds;
    /// How many there are.
    fn sample_count(&self) -> usize;
}

impl BrickOfSamples for Brick {
    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    fn sample_count(&self) -> usize {
        self.places.len()
    }
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

/// Samples that a chunk is to hold where there are so many in all.
pub(crate) fn chunk_target(samples: usize) -> usize {
    // A chunk's number has 16 bits: beyond 2^28 samples the chunks grow.
    CHUNK_SAMPLES.max(samples >> 14)
}

/// Cuts the visible bricks into runs of about `target` samples, one chunk each.
pub(crate) fn runs_of_bricks<B: BrickOfSamples>(
    bricks: &[B],
    visible: Vec<usize>,
    target: usize,
) -> Vec<Vec<usize>> {
    let mut runs: Vec<Vec<usize>> = Vec::new();
    let mut filled = usize::MAX;
    for brick in visible {
        let samples = bricks[brick].sample_count();
        match runs.last_mut() {
            Some(run) if filled + samples <= target => {
                run.push(brick);
                filled += samples;
            }
            _ => {
                runs.push(vec![brick]);
                filled = samples;
            }
        }
    }
    runs
}

/// Projects each run of bricks into its chunk and lists it by tile, one task a chunk; the two are timed apart.
pub(crate) fn project_runs<C: Send, R: Sync>(
    chunks: &mut [C],
    runs: &[R],
    stats: &mut FrameStats,
    project: impl Fn(&mut C, &R) + Sync,
    bin: impl Fn(&mut C, usize) + Sync,
) {
    let clock = StageClock::start();
    let parts: Vec<[f64; 2]> = chunks
        .par_iter_mut()
        .zip(runs)
        .enumerate()
        .map(|(number, (chunk, run))| {
            let start = ThreadTime::try_now().ok();
            project(chunk, run);
            let project_ms = elapsed_ms(start);
            let start = ThreadTime::try_now().ok();
            bin(chunk, number);
            [project_ms, elapsed_ms(start)]
        })
        .collect();
    let cpu_ms = parts
        .iter()
        .fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
    let [project, bin] = clock.stop().shared(cpu_ms);
    stats.stages.project += project;
    stats.stages.bin += bin;
}
