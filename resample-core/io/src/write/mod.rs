//! Pictures as files: takes a [`resample_core::Image`] and something to write to, gives the bytes of a format.
//!
//! Names, temporary files and the choice of a format are the caller's. Errors are those of writing, and numbers that the format has no
//! place for.

pub mod exr;
pub mod gif;
pub mod png;
pub mod webp;
mod runs;
