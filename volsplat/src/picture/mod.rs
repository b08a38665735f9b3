//! The picture: tiles of sub-pixels that become pixels.

pub(crate) mod assemble;
mod means;
pub(crate) mod subpixels;
pub(crate) mod tiles;
