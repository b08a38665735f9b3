//! Triangles on the screen: takes the prepared scene and a camera, returns those in view with their attributes as functions
//! of the pixel.
//!
//! `cull` projects and lists triangles for each tile; `surface` is a triangle as a tile sees it, evaluated at
//! vectors of sub-pixels.

pub(crate) mod cull;
pub(crate) mod surface;
