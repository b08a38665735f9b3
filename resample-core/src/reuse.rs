//! Reuse of a renderer's preparation when its options change.

/// The result of an update: the preparation serves the new options, or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Reuse {
    /// The preparation was kept; the frames that follow have the new options.
    Kept,
    /// Nothing has changed: the preparation does not hold all that the new options need. Make a new renderer.
    NeedsRenderer,
}
