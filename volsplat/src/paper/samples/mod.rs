//! Samples of a volume in memory: classified voxels, or means over cells.
//!
//! `sample` classifies voxels and `sample_light` lights them; a `layer` holds the samples of one size, and averages cells.

pub(crate) mod sample;
pub(crate) mod sample_light;
pub(crate) mod layer;
