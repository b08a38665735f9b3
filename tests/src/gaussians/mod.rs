//! Gaussians: scenes by formula, and the slow twin of their drawing as a volume.

pub mod scenes;
pub mod twin;
pub mod viewers;
