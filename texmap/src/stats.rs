//! What a frame cost: counts that are the same on every machine, and times that are not.
//!
//! The field names are the keys of the stats file; tools read them, so they do not change.

use std::time::Instant;

use cpu_time::{ProcessTime, ThreadTime};
/// Wall and process-CPU time of one stage, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct StageTime {
    /// Elapsed time, ms. Stages that run interleaved share the frame's time in proportion to their CPU time.
    pub wall_ms: f64,
    /// CPU time of all threads together, ms.
    pub cpu_ms: f64,
}

/// The time of each stage of a frame, in the order in which data flows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct StageTimes {
    /// Triangles are projected; those that cannot be seen are dropped.
    pub cull: StageTime,
    /// Triangles are listed by the screen tiles that they touch.
    pub bin: StageTime,
    /// The depth prepass: which triangle each sub-pixel shows.
    pub visibility: StageTime,
    /// Visible texels are laid as points and splats (or looked up, in backward methods) and lit.
    pub accumulate: StageTime,
    /// Sub-pixels and surfaces are filtered down to pixels.
    pub resolve: StageTime,
    /// Tiles are copied into the picture.
    pub image: StageTime,
}

/// Counts and times of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct FrameStats {
    /// Elapsed time of the frame, ms.
    pub wall_ms: f64,
    /// CPU time of all threads, ms.
    pub cpu_ms: f64,
    /// Time of each stage.
    pub stages: StageTimes,
    /// Triangles of the scene.
    pub triangles: u64,
    /// Triangles seen from behind or edge-on, where only the front is shown, and degenerate ones.
    pub back_facing: u64,
    /// Triangles outside the picture or before the near plane.
    pub off_screen: u64,
    /// Triangles in view of which no sub-pixel shows anything.
    pub hidden: u64,
    /// Triangles that are seen.
    pub drawn: u64,
    /// Triangles times the tiles that each touches.
    pub tile_pairs: u64,
    /// Texels gathered as points, each counted for each pixel that it touches.
    pub points: u64,
    /// Splats and look-ups: texels spread over a sub-pixel, each counted for each sub-pixel (for each pixel in
    /// backward methods) that it touches.
    pub splats: u64,
    /// Pixels that show something.
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
            wall_ms: 1e3 * self.wall.elapsed().as_secs_f64(),
            cpu_ms: cpu.map_or(0.0, |d| 1e3 * d.as_secs_f64()),
        }
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

/// Milliseconds of this thread's CPU time since `start`; 0 where the system keeps no such clock.
pub fn elapsed_ms(start: Option<ThreadTime>) -> f64 {
    start
        .and_then(|s| s.try_elapsed().ok())
        .map_or(0.0, |d| 1e3 * d.as_secs_f64())
}
