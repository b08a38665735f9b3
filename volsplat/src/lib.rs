//! Volume rendering by hybrid forward resampling.
//!
//! `load` reads a volume, a [`TransferFunction`] says what of it is seen, and a [`Renderer`] draws it: the interpolated
//! field on sheets (`field`), or samples with kernels as the paper has them (`samples`), as [`RenderOptions`] says.

mod bricks;
pub mod clip;
pub mod error;
mod field;
#[cfg(feature = "input")]
pub mod input;
pub mod labels;
pub mod large;
mod light;
pub mod options;
mod picture;
pub mod render;
mod reuse;
mod samples;
pub mod scene;
mod sheets;
pub mod stats;
pub mod transfer;
pub mod volume;
mod watch;

pub use clip::{Clip, ClipPlane};
pub use error::Error;
pub use field::Layer;
#[cfg(feature = "input")]
pub use input::{LoadOptions, RawOptions, load};
pub use labels::{LabelLook, LabelTable};
pub use large::LargeVolume;
pub use options::{
    Blend, Cells, Classify, ColourBy, DepthPlane, FieldOptions, Interpolate, Isosurface,
    KernelSheets, Light, Order, RenderOptions, SampleOptions, SampleOrder, Shading, Subpixels,
};
pub use render::{Frame, Renderer};
pub use reuse::Reuse;
pub use samples::sample::Samples;
pub use scene::{Channel, Look, Scene};
pub use stats::{FrameStats, StageTime, StageTimes};
pub use transfer::{ColourEncoding, ColourMap, Histogram, TransferFunction};
pub use volume::{Described, Endian, Lattice, NanPolicy, Volume, VoxelType, Voxels, procedural};
pub use watch::Watch;
