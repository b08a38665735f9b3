//! The cost of a frame: counts that are the same on every machine, and times that are not.
//!
//! The field names are the keys of the stats file; tools read them, so they do not change.

use resample_core::clock::StageTime;

/// The time of each stage of a frame, in the order in which data flows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct StageTimes {
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
}
