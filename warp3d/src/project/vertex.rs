//! Samples and other corners on the screen.

/// Cells that are drawn at once.
pub(crate) const LANES: usize = 8;

/// Cells of a row that share one entry in the table of screen rows; one bit each.
pub(crate) const SEGMENT: usize = 32;

/// A sample or another corner on the screen; x is NaN where it is not in front of the near plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    /// Screen x, px.
    pub(crate) x: f32,
    /// Screen y, px.
    pub(crate) y: f32,
    /// Larger is nearer; linear over the screen on a plane.
    pub(crate) nearness: f32,
}
