//! Triangles on the screen: takes the prepared scene and a camera, returns those in view with their attributes as functions
//! of the pixel.
//!
//! `cull` projects and lists triangles for each tile; `surface` is a triangle as a tile sees it; `pixel` and `batch` are
//! the places at which a surface is evaluated: one pixel, or a vector of sub-pixels.

pub(crate) mod cull;
pub(crate) mod surface;
pub(crate) mod pixel;
pub(crate) mod batch;
