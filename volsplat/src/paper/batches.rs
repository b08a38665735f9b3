//! Batches: bricks of samples in view, front to back, as many at a time as pay for a test of what is hidden behind them.
//!
//! Bricks are put in order of the least depth that a sample of theirs may have, and cut into runs that one task projects. A batch is
//! composited up to the least depth
//! of the next one, and samples beyond wait: so every sample still comes over those behind it. The batches and runs are cut
//! without regard to the number of threads.
//!
//! After each batch the opaque tiles are counted into a table of sums, so that the question whether every tile of
//! a rectangle is opaque takes four reads, however large it is: a pyramid of tiles and larger squares would need a
//! descent. A pixel of an opaque tile changes no more than by its bound, whatever lies behind; so samples that touch opaque
//! tiles alone need not be projected.
//! Source: hidden voxels are the paper's future work (section 6).

use glam::DVec3;
use rayon::prelude::*;
use resample_core::clock::{StageClock, ThreadClock};
use resample_core::tile::{TileGrid, TileRect};
use resample_core::{Camera, GridView, Projection};

use crate::bricks::cull::BrickOfSamples;
use crate::grid::Bounds;
use crate::paper::samples::layer::Layer;
use crate::stats::FrameStats;

/// Pixels around a brick's box that its samples may still reach: the pixel filter has four taps.
const MARGIN_PX: f64 = 2.0;

/// Opaque tiles, summed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hiding {
    columns: usize,
    /// Opaque tiles above and left of each corner of the tiles, row by row; empty where no tile is opaque.
    sums: Vec<u32>,
}

impl Hiding {
    /// Counts the tiles of a picture that are opaque.
    pub(crate) fn new(grid: &TileGrid, is_opaque: impl Fn(usize) -> bool) -> Self {
        let (columns, rows) = (grid.columns(), grid.rows());
        let mut sums = vec![0; (columns + 1) * (rows + 1)];
        for y in 0..rows {
            let mut row = 0;
            for x in 0..columns {
                row += u32::from(is_opaque(y * columns + x));
                sums[(y + 1) * (columns + 1) + x + 1] = sums[y * (columns + 1) + x + 1] + row;
            }
        }
        if sums.last().is_none_or(|&all| all == 0) {
            sums.clear();
        }
        Self { columns, sums }
    }

    /// Returns true if a rectangle holds tiles, and all of them are opaque.
    #[inline(always)]
    pub(crate) fn hides(&self, rect: &TileRect) -> bool {
        if self.sums.is_empty() || rect.area() == 0 {
            return false;
        }
        let at = |x: u16, y: u16| self.sums[usize::from(y) * (self.columns + 1) + usize::from(x)];
        let opaque = at(rect.x1, rect.y1) + at(rect.x0, rect.y0)
            - at(rect.x1, rect.y0)
            - at(rect.x0, rect.y1);
        opaque as usize == rect.area()
    }
}

/// Where a brick of samples lies for a camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BrickPlace {
    /// No sample is nearer than this: distance from the eye, or camera z of parallel rays.
    pub(crate) nearest: f64,
    /// The tiles that its kernels may touch; `None` where one may reach the near plane.
    pub(crate) rect: Option<TileRect>,
}

/// Rounding of f32 positions, as a share of their size, with much to spare.
const ROUNDING: f64 = 1e-5;

impl BrickPlace {
    /// Where the samples of `bounds` lie, whose kernels have this radius in the grid.
    pub(crate) fn new(bounds: &Bounds, radius: f64, view: &GridView, camera: &Camera) -> Self {
        let in_camera = |corner: DVec3| view.camera_from_grid.transform_point3(corner);
        let samples = bounds.corners_in_grid(0.0).map(in_camera);
        let kernels = bounds.corners_in_grid(radius).map(in_camera);
        let margin = ROUNDING
            * kernels
                .iter()
                .map(|corner| corner.length())
                .fold(0.0, f64::max);
        let nearest = match view.projection {
            // The ball around the box: the box itself may be sheared.
            Projection::Perspective => {
                let middle = 0.5 * (samples[0] + samples[7]);
                let reach = samples
                    .iter()
                    .map(|corner| corner.distance(middle))
                    .fold(0.0, f64::max);
                (middle.length() - reach - margin).max(0.0)
            }
            Projection::Orthographic => {
                samples
                    .iter()
                    .map(|corner| corner.z)
                    .fold(f64::INFINITY, f64::min)
                    - margin
            }
        };
        let nearest_front = match view.projection {
            Projection::Perspective => view.near.max(0.0),
            Projection::Orthographic => view.near,
        };
        let in_front = kernels
            .iter()
            .all(|corner| corner.z > nearest_front + margin);
        Self {
            nearest,
            rect: in_front.then(|| rect(&kernels, view, camera)),
        }
    }
}

/// The tiles of the picture that a box in front of the near plane touches.
fn rect(corners: &[DVec3; 8], view: &GridView, camera: &Camera) -> TileRect {
    let grid = TileGrid::new(camera.width as usize, camera.height as usize);
    let ends = |axis: usize, count: usize| {
        let at = corners.map(|corner| {
            let scale = if view.projection == Projection::Perspective {
                corner.z
            } else {
                1.0
            };
            corner[axis] * view.focal[axis] / scale + view.principal_px[axis]
        });
        let low = at.iter().copied().fold(f64::INFINITY, f64::min) - MARGIN_PX;
        let high = at.iter().copied().fold(f64::NEG_INFINITY, f64::max) + MARGIN_PX;
        let pixel = |p: f64| p.clamp(0.0, count as f64) as u16;
        [pixel(low.floor()), pixel(high.ceil())]
    };
    grid.rect(ends(0, grid.width), ends(1, grid.height))
}

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

    #[test]
    fn rectangles_are_hidden_where_every_tile_of_theirs_is_opaque() {
        let grid = TileGrid::new(16 * 7, 16 * 5);
        let opaque = |tile: usize| tile * 7 % 11 < 8;
        let hiding = Hiding::new(&grid, opaque);
        for (x0, y0) in (0..7u16).flat_map(|x| (0..5u16).map(move |y| (x, y))) {
            for (x1, y1) in (x0..=7).flat_map(|x| (y0..=5).map(move |y| (x, y))) {
                let rect = TileRect { x0, x1, y0, y1 };
                let mut tiles =
                    (y0..y1).flat_map(|y| (x0..x1).map(move |x| usize::from(y * 7 + x)));
                let expected = rect.area() > 0 && tiles.all(opaque);
                assert_eq!(hiding.hides(&rect), expected, "{rect:?}");
            }
        }
        let nothing = Hiding::new(&grid, |_| false);
        assert!(
            !nothing.hides(&TileRect {
                x0: 0,
                x1: 7,
                y0: 0,
                y1: 5
            }),
            "no tile is opaque"
        );
    }

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
