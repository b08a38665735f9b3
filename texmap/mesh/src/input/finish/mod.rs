//! The last steps of every format: makes the promises of a scene true.
//!
//! `polygon` cuts polygons into triangles, `origin` moves a distant model near zero, and `checked` holds
//! every number and index.

pub(crate) mod polygon;
pub mod origin;
pub(crate) mod checked;
