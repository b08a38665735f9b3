//! Image-aligned sheets of samples (Mueller and Crawfis): slabs of radial kernels, parallel to the picture.
//!
//! `kernel_field` prepares the samples and solves for kernel coefficients, `kernel_project` lays them on slabs,
//! `kernel_tile` sums a slab in one tile, and `kernel_sheets` is the driver.

pub(crate) mod kernel_field;
pub(crate) mod kernel_sheets;
pub(crate) mod kernel_project;
pub(crate) mod kernel_tile;
