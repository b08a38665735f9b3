//! What a frame cost: counts that are the same on every machine, and times that are not.
//!
//! The field names are the keys of the stats file; tools read them, so they do not change.

use std::time::Instant;

use cpu_time::ProcessTime;

/// Wall and process-CPU time of one stage, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct StageTime {
    /// Elapsed time, ms.
    pub wall_ms: f64,
    /// CPU time of all threads together, ms.
    pub cpu_ms: f64,
}

/// The time of each stage of a frame, in the order in which data flows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct StageTimes {
    /// Parts of references that stayed in a file are read and prepared.
    pub prepare: StageTime,
    /// Samples are warped to the screen.
    pub project: StageTime,
    /// Surfaces or footprints are laid on the screen and visibility is decided.
    pub accumulate: StageTime,
    /// Coverage and colour of each pixel.
    pub resolve: StageTime,
    /// References are blended into one picture.
    pub blend: StageTime,
    /// Holes are filled.
    pub fill: StageTime,
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
    /// Reference samples with a depth, over all references.
    pub samples: u64,
    /// Samples outside the picture or before the near plane.
    pub outside: u64,
    /// Pixels in which something was seen.
    pub seen: u64,
    /// Pixels resolved at sub-pixels because a depth edge is near.
    pub edge_pixels: u64,
    /// Pixels of holes that were filled.
    pub filled: u64,
    /// Parts in which the picture was drawn, where the references stayed in a file; 0 where they were in memory.
    pub windows: u64,
    /// Samples that were read from that file and prepared for this picture.
    pub read_samples: u64,
}

impl StageTime {
    /// Adds another time to this one.
    pub fn add(&mut self, other: Self) {
        self.wall_ms += other.wall_ms;
        self.cpu_ms += other.cpu_ms;
    }
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
