//! Batches: bricks of samples in view, front to back, as many at a time as are worth looking again what they hide.
//!
//! Bricks are put in order of the least depth that a sample of theirs may have. A batch is composited up to the least depth
//! of the next one, and what lies beyond waits: so every sample still comes over those behind it. The batches are cut
//! without regard to the number of threads.

use crate::paper::chunks::{chunk_target, runs_of_bricks};
use crate::paper::hiding::{BrickPlace, Hiding};
use crate::paper::samples::layer::Layer;
use crate::stats::FrameStats;

/// Samples of a batch at least: below, visiting the tiles costs more than projecting hidden samples. A guess.
const BATCH_SAMPLES: usize = 1 << 15;

/// Chunks of a batch, so that every thread has some.
const CHUNKS_OF_BATCH: usize = 8;

/// Batches of a frame at most, about: every tile is visited for each. A guess, flat between 12 and 48.
const BATCHES: usize = 24;

/// A brick in view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedBrick {
    pub(crate) layer: usize,
    pub(crate) number: usize,
    pub(crate) samples: usize,
    pub(crate) place: BrickPlace,
}

/// The extent of footprints: within the outlines of their kernels, or beyond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outlines {
    /// They do.
    Kernels,
    /// They may reach farther, so that nothing is known of a brick's footprints together.
    Wider,
}

/// Bricks that are projected and composited together.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    bricks: Vec<PlacedBrick>,
    /// No sample of this batch, or of a later one, is nearer than this.
    pub(crate) nearest: f64,
    outlines: Outlines,
    target: usize,
}

/// Bricks of one layer that one task projects.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    pub(crate) layer: usize,
    pub(crate) bricks: Vec<usize>,
}

/// Puts bricks in order and cuts them into batches, or keeps them in one, as they are. Those at the near plane, whose samples
/// are composited before all others, are in the first.
pub(crate) fn in_batches(
    mut bricks: Vec<PlacedBrick>,
    is_one: bool,
    outlines: Outlines,
) -> Vec<Batch> {
    let total: usize = bricks.iter().map(|brick| brick.samples).sum();
    let size = if is_one {
        usize::MAX
    } else {
        BATCH_SAMPLES.max(total / BATCHES)
    };
    let target = (size / CHUNKS_OF_BATCH).min(chunk_target(total));
    if !is_one {
        bricks.sort_unstable_by(|a, b| {
            let at_eye = |brick: &PlacedBrick| brick.place.rect.is_some();
            let order = at_eye(a)
                .cmp(&at_eye(b))
                .then(a.place.nearest.total_cmp(&b.place.nearest));
            order.then((a.layer, a.number).cmp(&(b.layer, b.number)))
        });
    }
    let mut batches: Vec<Batch> = Vec::new();
    let mut filled = usize::MAX;
    for brick in bricks {
        match batches.last_mut() {
            Some(batch) if filled < size || brick.place.rect.is_none() => {
                filled = filled.saturating_add(brick.samples);
                batch.bricks.push(brick);
            }
            _ => {
                filled = brick.samples;
                batches.push(Batch {
                    bricks: vec![brick],
                    nearest: brick.place.nearest,
                    outlines,
                    target,
                });
            }
        }
    }
    batches
}

impl Batch {
    /// The part of the batch that is not hidden, cut into runs of one task.
    pub(crate) fn runs(
        &self,
        layers: &[Layer],
        hiding: &Hiding,
        stats: &mut FrameStats,
    ) -> Vec<Run> {
        let mut seen: Vec<Vec<usize>> = vec![Vec::new(); layers.len()];
        for brick in &self.bricks {
            let rect = brick
                .place
                .rect
                .filter(|_| self.outlines == Outlines::Kernels);
            if rect.is_some_and(|rect| hiding.hides(&rect)) {
                stats.bricks_hidden += 1;
                stats.hidden += brick.samples as u64;
            } else {
                seen[brick.layer].push(brick.number);
            }
        }
        let cut = |(layer, seen): (usize, Vec<usize>)| {
            let runs = runs_of_bricks(&layers[layer].samples.bricks, seen, self.target);
            runs.into_iter().map(move |bricks| Run { layer, bricks })
        };
        seen.into_iter().enumerate().flat_map(cut).collect()
    }
}

#[cfg(test)]
mod tests {
    use resample_core::tile::TileRect;

    use super::*;

    fn brick(number: usize, nearest: f64, at_eye: bool) -> PlacedBrick {
        let rect = (!at_eye).then_some(TileRect {
            x0: 0,
            x1: 1,
            y0: 0,
            y1: 1,
        });
        PlacedBrick {
            layer: 0,
            number,
            samples: 60_000,
            place: BrickPlace { nearest, rect },
        }
    }

    #[test]
    fn batches_go_front_to_back_and_begin_at_the_eye() {
        let bricks: Vec<_> = (0..40)
            .map(|i| brick(i, (i * 17 % 40) as f64, i % 10 == 3))
            .collect();
        let batches = in_batches(bricks.clone(), false, Outlines::Kernels);
        assert!(batches.len() > 5, "{} batches", batches.len());
        assert_eq!(
            batches
                .iter()
                .map(|batch| batch.bricks.len())
                .sum::<usize>(),
            40,
            "none is lost"
        );
        let at_eye = |batch: &Batch| {
            batch
                .bricks
                .iter()
                .filter(|b| b.place.rect.is_none())
                .count()
        };
        assert_eq!(at_eye(&batches[0]), 4, "all at the eye come first");
        for (before, after) in batches.iter().zip(&batches[1..]) {
            assert!(
                after
                    .bricks
                    .iter()
                    .all(|b| b.place.nearest >= after.nearest),
                "nothing lies before its batch"
            );
            assert!(
                before.nearest <= after.nearest || at_eye(before) > 0,
                "front to back"
            );
        }
        let one = in_batches(bricks, true, Outlines::Kernels);
        assert_eq!(one.len(), 1, "all in one");
    }
}
