//! References.

pub mod data;
