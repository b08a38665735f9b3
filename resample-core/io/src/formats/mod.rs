//! One file for each format: takes an opened file, returns pixels, depths or the head of an array.

pub(crate) mod radiance;
pub(crate) mod raster;
pub mod exr;
pub mod tiff;
pub(crate) mod pfm;
pub mod npy;
pub mod ply;
pub mod rendered;
