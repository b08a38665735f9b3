//! One file for each format: takes an opened file, returns pixels, depths or the head of an array.

pub(crate) mod png;
pub(crate) mod jpeg;
pub(crate) mod radiance;
pub(crate) mod raster;
pub mod exr;
pub mod tiff;
pub(crate) mod tiff_depth;
pub(crate) mod pfm;
pub mod npy;
pub(crate) mod npy_depth;
