//! What a frame cost: counts that are the same on every machine, and times that are not.
//!
//! The field names are the keys of the stats file; tools read them, so they do not change.

use std::time::Instant;

use cpu_time::ProcessTime;
use serde::Serialize;

/// Wall and process-CPU time of one stage, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageTime {
    /// Elapsed time, ms. Stages that run interleaved share the frame's time in proportion to their CPU time.
    pub wall_ms: f64,
    /// CPU time of all threads together, ms.
    pub cpu_ms: f64,
}

/// The time of each stage of a frame, in the order in which data flows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageTimes {
    /// Bricks outside the view are dropped.
    pub cull: StageTime,
    /// Samples are projected and become points or splats (sample and select).
    pub project: StageTime,
    /// Footprints are listed by the screen tiles that they touch.
    pub bin: StageTime,
    /// Each tile's list is put in depth order.
    pub sort: StageTime,
    /// Points and splats are accumulated and composited, front to back.
    pub composite: StageTime,
    /// Tiles are copied into the picture.
    pub image: StageTime,
}

/// Counts and times of one frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FrameStats {
    /// Elapsed time of the frame, ms.
    pub wall_ms: f64,
    /// CPU time of all threads, ms.
    pub cpu_ms: f64,
    /// Time of each stage.
    pub stages: StageTimes,
    /// Samples in bricks outside the view, or themselves outside it.
    pub culled: u64,
    /// Samples in view that lie behind opaque tiles alone, and were not listed: in hidden bricks, or by themselves
    /// (every sample).
    pub hidden: u64,
    /// Samples taken as points.
    pub points: u64,
    /// Samples taken as splats, those near the eye included.
    pub splats: u64,
    /// Samples that cross the near plane or hold the eye, integrated from the near plane on (a part of `splats`).
    pub near_splats: u64,
    /// Bricks of cells in view (image sheets that gather).
    pub bricks: u64,
    /// Bricks of cells that were read from the file for this frame (volumes that stay in their file).
    pub bricks_read: u64,
    /// Most bytes that bricks, their index and begun tiles took at once (volumes that stay in their file).
    pub resident_bytes: u64,
    /// Bricks that hold nothing visible: dropped when the volume was prepared.
    pub bricks_empty: u64,
    /// Bricks outside the view.
    pub bricks_outside: u64,
    /// Bricks in view that no tile looked at, because what lies before them is opaque (image sheets that gather), or
    /// that were not projected for the same reason (every sample).
    pub bricks_hidden: u64,
    /// Bricks in view of one colour that rays crossed in one step (cells in memory or in the file).
    pub bricks_uniform: u64,
    /// Footprints, or bricks of cells, times the tiles that each touches.
    pub tile_pairs: u64,
    /// Tile pairs that were never looked at because every pixel of their tile was already opaque.
    pub hidden_pairs: u64,
    /// Pixel updates: how often a footprint added something to a pixel (whole rows of a tile's width are counted as
    /// they are computed).
    pub pixels_touched: u64,
}

/// Measures a stage.
#[derive(Clone, Copy, Debug)]
pub struct StageClock {
    wall: Instant,
    /// `None` where the system keeps no such clock; the stage's CPU time is then 0.
    cpu: Option<ProcessTime>,
}

impl StageClock {
    /// Starts now.
    pub fn start() -> Self {
        Self {
            wall: Instant::now(),
            cpu: ProcessTime::try_now().ok(),
        }
    }

    /// The time since the start.
    pub fn stop(self) -> StageTime {
        let cpu = self.cpu.and_then(|start| start.try_elapsed().ok());
        StageTime {
            wall_ms: seconds_to_ms(self.wall.elapsed().as_secs_f64()),
            cpu_ms: cpu.map_or(0.0, |d| seconds_to_ms(d.as_secs_f64())),
        }
    }
}

impl std::ops::AddAssign for StageTime {
    fn add_assign(&mut self, other: Self) {
        self.wall_ms += other.wall_ms;
        self.cpu_ms += other.cpu_ms;
    }
}

impl StageTime {
    /// Splits the time of stages that ran interleaved, in proportion to the CPU time measured inside each.
    pub fn shared<const N: usize>(self, cpu_ms: [f64; N]) -> [Self; N] {
        let total: f64 = cpu_ms.iter().sum();
        cpu_ms.map(|part| {
            let share = if total > 0.0 {
                part / total
            } else {
                1.0 / N as f64
            };
            Self {
                wall_ms: self.wall_ms * share,
                cpu_ms: self.cpu_ms * share,
            }
        })
    }
}

/// Seconds to milliseconds.
pub fn seconds_to_ms(seconds: f64) -> f64 {
    1e3 * seconds
}
