//! Samples of a volume in memory: classified voxels, or means over cells.
//!
//! `sample` classifies voxels and `sample_light` lights them; `cell_points` and `cell_samples` average cells; a `layer` holds the samples
//! of one size.

pub(crate) mod sample;
pub(crate) mod sample_light;
pub(crate) mod layer;
