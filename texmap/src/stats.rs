//! The cost of a frame: counts that are the same on every machine, and times that are not.
//!
//! The field names are the keys of the stats file; tools read them, so they do not change.

use resample_core::clock::StageTime;

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
    /// Splats and look-ups: texels spread over a pixel or a sub-pixel, each counted for each pixel or sub-pixel that it
    /// touches.
    pub splats: u64,
    /// Pixels that show something.
    pub pixels_touched: u64,
}
