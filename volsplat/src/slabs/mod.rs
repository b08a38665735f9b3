//! Slabs parallel to the picture: tables and cameras that both pipelines share.
//!
//! `table` holds a transfer function over scalars and its exact integrals, `settings` joins a look with it, and `view` is the camera of a tile on each plane.

pub(crate) mod settings;
pub(crate) mod table;
pub(crate) mod view;
