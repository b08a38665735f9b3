//! Slow, obvious f64 references for the volume renderer, the scenes that they are tried on, and the real data.
//!
//! Nothing here is fast and nothing here shares a formula with what it tests: a ray is a line in the grid, a distance
//! is a cross product, an integral is a sum over many small steps, a screen is looped over pixel by pixel. What is
//! taken from the library is its data (volumes, cameras, options, pictures) and the transfer function.

pub mod gaussians;
pub mod meshes;
pub mod twins;
pub mod volumes;
pub mod warps;

pub mod choices;
pub mod data;
pub mod extremes;
pub mod frames;
pub mod fuzzed;
pub mod import_graph;
pub mod interleaved;
