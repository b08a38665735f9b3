//! Samples of a regular grid, each with a kernel around it: the paper.
//!
//! One pipeline with three orders: every sample over those behind it, slices of the grid (`axis_sheets`), and slabs
//! parallel to the picture in which kernels are summed (`kernel_sheets`).

mod axis_sheets;
mod batches;
mod cell_points;
mod cell_samples;
mod chunks;
mod every_sample;
mod geometry;
mod hiding;
mod interpolate;
mod kernel_field;
mod kernel_project;
mod kernel_sheets;
mod kernel_tile;
mod layer;
mod near;
mod project;
pub(crate) mod sample;
mod sample_light;
mod setup;
mod tile_stage;

pub(crate) use every_sample::EverySample;
pub(crate) use kernel_sheets::KernelSheets;
pub(crate) use project::Painting;
