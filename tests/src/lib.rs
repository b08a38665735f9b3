//! References.

pub mod data;
pub mod exr_read;
