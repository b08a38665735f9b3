//! Slabs parallel to the picture: tables and cameras that both pipelines share.
//!
//! `table` holds a transfer function over scalars and its exact integrals, `section` the outlines of a kernel or brick on a plane;
//! `settings` joins a look with them, and `view` is the camera of a tile on each plane.

pub(crate) mod settings;
pub(crate) mod table;
pub(crate) mod section;
pub(crate) mod view;
