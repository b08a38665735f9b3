//! Chunks: the bricks in view, cut into runs that one task projects.
//!
//! The cut looks at the bricks alone, never at the number of threads.

use rayon::prelude::*;
use resample_core::clock::{StageClock, ThreadClock};

use crate::bricks::visible::BrickOfSamples;
use crate::stats::FrameStats;

/// Samples of a chunk: its primitives (48 bytes each) then stay in the second-level cache while they are binned.
const CHUNK_SAMPLES: usize = 1 << 14;

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
            let start = ThreadClock::start();
            project(chunk, run);
            let project_ms = start.elapsed_ms();
            let start = ThreadClock::start();
            bin(chunk, number);
            [project_ms, start.elapsed_ms()]
        })
        .collect();
    let cpu_ms = parts
        .iter()
        .fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
    let [project, bin] = clock.stop().shared(cpu_ms);
    stats.stages.project += project;
    stats.stages.bin += bin;
}
