//! Volume rendering by hybrid forward resampling.
//!
//! [`load`] reads a volume, a [`TransferFunction`] says what of it is seen, and a [`Renderer`] draws it: in image sheets
//! (`sheets`), sample over sample (`every_sample`) or in slices of the grid (`axis_sheets`), as [`RenderOptions`] says.

mod axis_sheets;
mod batches;
mod cell_samples;
mod cells;
mod chunks;
pub mod clip;
pub mod cull;
pub mod error;
mod every_sample;

mod geometry;
mod grid;
mod hiding;
pub mod input;
mod interpolate;
mod kernel_field;
pub mod labels;
pub mod large;
mod layer;
pub mod near;
pub mod options;
mod palette;
mod picture;
pub mod procedural;
mod project;
pub mod render;
pub mod sample;
mod sample_light;
pub mod scene;
mod shade;
mod sheets;
pub mod stats;
mod subpixels;
mod support;
mod tiles;
pub mod transfer;
pub mod volume;

pub use clip::{Clip, ClipPlane};
pub use error::Error;
pub use input::{Endian, LoadOptions, RawOptions, VoxelType, load};
pub use labels::{LabelLook, LabelTable};
pub use large::LargeVolume;
pub use options::{
    Blend, Cells, Classify, ColourBy, DepthPlane, FieldOptions, Interpolate, Isosurface,
    KernelSheets, Light, Order, RenderOptions, SampleOptions, SampleOrder, Shading, Subpixels,
};
pub use render::{Frame, Renderer};
pub use scene::{Channel, Look, Scene};
pub use sheets::{Layer, Reuse};
pub use stats::{FrameStats, StageTime, StageTimes};
pub use transfer::{ColourEncoding, ColourMap, Histogram, TransferFunction};
pub use volume::{Described, Lattice, NanPolicy, Volume, Voxels};
