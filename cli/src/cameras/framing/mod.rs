//! Automatic framing: the visible part of each kind of scene, and a camera of `resample_core::camera::orbit` that shows it.

pub mod volume;
#[cfg(test)]
mod tests;

pub use resample_core::camera::orbit::{
    DEFAULT_ORBIT, Extent, FILL, Lens, Seen, Stance, View, fit, frame, of_pixels, seen_points,
    turned,
};

/// Measures where the scene is seen in a small picture of a camera; `None` where nothing is seen.
pub type Measure<'a> = resample_core::camera::orbit::Measure<'a, anyhow::Error>;
