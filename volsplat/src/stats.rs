//! The cost of a frame: counts that are the same on every machine, and times that are not.
//!
//! The field names are the keys of the stats file; tools read them, so they do not change.

use resample_core::clock::StageTime;

/// The time of each stage of a frame, in the order in which data flows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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

/// Counts of a field's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SampleCounts {
    /// Lanes of vectors in which the field was interpolated.
    pub(crate) computed: usize,
    /// Samples among them in cells that may show something.
    pub(crate) shown: usize,
    /// Samples that changed a pixel.
    pub(crate) contributed: usize,
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
    /// Peak bytes of bricks, their index and begun tiles (volumes that stay in their file).
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
    /// Sub-pixels along a pixel's side (the field; of other orders 0).
    pub subpixels: u64,
    /// Pixel updates: how often a footprint added something to a pixel (whole rows of a tile's width are counted as
    /// they are computed).
    pub pixels_touched: u64,
    /// Lanes of vectors in which a field was interpolated.
    pub lanes_computed: u64,
    /// Samples of a field in cells that may show something.
    pub samples_shown: u64,
    /// Samples of a field that changed a pixel.
    pub samples_contributed: u64,
}
