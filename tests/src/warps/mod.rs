//! Depth images: ray-traced scenes, softened depth, real pairs, and errors by region.

pub mod truth;
pub mod scenes;
pub mod films;
pub mod filtered;
pub mod several;
pub mod soft;
pub mod thicket;
pub mod pairs;
pub mod measure;
pub mod edges;
