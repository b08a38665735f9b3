//! Volumes with cameras and looks: by formula, from the real data, and their antialiased truth.

pub mod lit_scenes;
pub mod scenes;
pub mod analytic_fields;
pub mod area_truth;
pub mod shadow_truth;
pub mod shells;
pub mod lod_scenes;
pub mod peer_scenes;
pub mod papers_table;
pub mod popping;
pub mod against_sheets;
