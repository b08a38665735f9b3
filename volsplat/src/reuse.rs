//! Reuse of a renderer's preparation for other options.

/// The part of a renderer that a change kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Reuse {
    /// It does, and the frames that follow show it.
    Done,
    /// Nothing has changed: what was prepared of the volume does not hold all that is asked for. A new renderer is
    /// needed.
    NeedsRenderer,
}
