//! Requests to a renderer at work: to stop drawing a frame, and to reuse its preparation for new options.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Says that a frame is wanted no longer. Clones share the request.
///
/// ```
/// let stop = resample_core::Stop::default();
/// let of_another_thread = stop.clone();
/// of_another_thread.ask();
/// assert!(stop.is_asked());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks for the end of the frame in work.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Withdraws the request, before a frame that is wanted.
    pub fn clear(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// Returns true if the end was asked for.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The result of an update: the preparation serves the new options, or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Reuse {
    /// The preparation was kept; the frames that follow have the new options.
    Kept,
    /// Nothing has changed: the preparation does not hold all that the new options need. Make a new renderer.
    NeedsRenderer,
}
