//! Slow, obvious f64 references for the volume renderer, the scenes that they are tried on, and the real data.
//!
//! Nothing here is fast and nothing here shares a formula with what it tests: a ray is a line in the grid, a distance
//! is a cross product, an integral is a sum over many small steps, a screen is looped over pixel by pixel. What is
//! taken from the library is its data (volumes, cameras, options, pictures) and the transfer function.

pub mod against_sheets;
pub mod analytic_fields;
pub mod area_truth;
pub mod cell_reference;
pub mod choices;
pub mod clip_reference;
pub mod data;
pub mod exr_read;
pub mod field;
pub mod frames;
pub mod fuzzed;
pub mod import_graph;
pub mod interleaved;
pub mod interpolation_reference;
pub mod iso_reference;
pub mod kernel_sheet_reference;
pub mod light_reference;
pub mod lod_scenes;
pub mod march;
pub mod mesh_views;
pub mod peer_scenes;
pub mod physical_reference;
pub mod popping;
pub mod rays;
pub mod reference;
pub mod scene_reference;
pub mod scenes;
pub mod segment_reference;
pub mod sheet_reference;
pub mod shell_scenes;
pub mod statistic_reference;
pub mod texture_reference;
pub mod texture_scenes;
pub mod textured;
pub mod trilinear;
pub mod warp_edges;
pub mod warp_filtered;
pub mod warp_measure;
pub mod warp_pairs;
pub mod warp_scenes;
pub mod warp_soft;
pub mod warp_thicket;
pub mod warp_truth;
