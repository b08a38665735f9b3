//! The last steps of every format: makes the promises of a scene true.
//!
//! `polygon` cuts polygons into triangles, `origin` moves a distant model near zero, `indices` checks a scene that a program made, and
//! `checked` holds every number and index.

pub(crate) mod polygon;
pub mod origin;
pub(crate) mod indices;
pub(crate) mod checked;
