//! Samples of a regular grid, each with a kernel around it: the paper.
//!
//! One pipeline with three orders: every sample over those behind it, slices of the grid (`axis_sheets`), and slabs
//! parallel to the picture in which kernels are summed (`kernel_sheets`).

pub(crate) mod samples;
mod every_sample;
mod batches;
mod geometry;
mod project;
mod axis_sheets;
pub(crate) mod image_sheets;

pub(crate) use every_sample::EverySample;
pub(crate) use image_sheets::kernel_sheets::KernelSheets;
pub(crate) use project::Painting;
