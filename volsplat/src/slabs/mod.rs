//! Slabs parallel to the picture: tables and cameras that both pipelines share.
//!
//! `channel` and `settings` join a look with its tables: exact integrals of a transfer function (`integrals`), a table over scalars
//! (`table`), sections of a kernel (`section`, `projection`). `view` is the camera of a tile on each plane, `lanes` half a row of it.

pub(crate) mod settings;
pub(crate) mod table;
pub(crate) mod section;
pub(crate) mod view;
