//! Volume rendering by hybrid forward resampling.
//!
//! A [`Volume`] comes from an array in memory or from a file (`load`), a [`TransferFunction`] says what of it is seen, and
//! a [`Renderer`] draws it: the interpolated field on sheets (`field`), or samples with kernels as the paper has them
//! (`paper`), as [`RenderOptions`] says.
//!
//! ```
//! use glam::{DAffine3, DVec3};
//! use resample_core::Framing;
//! use volsplat::{ColourMap, Described, RenderOptions, Renderer, TransferFunction, Volume, Voxels};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let values = (0..32 * 32 * 32).map(|i| (i % 32) as f32).collect();
//! let volume = Volume::new([32; 3], Voxels::F32(values), DAffine3::IDENTITY)?;
//! let transfer = TransferFunction::automatic(&volume.histogram(), ColourMap::default());
//! let mut renderer = Renderer::new(&volume, &transfer, &RenderOptions::default())?;
//! let bounds = renderer.visible_bounds_in_world().ok_or("nothing is visible")?;
//! let framing = Framing {
//!     towards_eye: DVec3::new(0.5, 0.4, 1.0),
//!     up: DVec3::Y,
//!     fov_y_rad: 0.5,
//! };
//! let frame = renderer.render(&framing.camera(bounds, [64, 64])?)?;
//! let pixels = frame.image.over_background([1.0; 3]).srgb8();
//! assert_eq!(pixels.len(), 64 * 64);
//! # Ok(())
//! # }
//! ```
//!
//! Options, transfer functions and clips change between pictures ([`Renderer::update`] and the others), without
//! another preparation where that is possible. For a program in which a person turns the knobs, a renderer keeps all of the
//! volume ([`Renderer::for_changes`]) and takes every change quickly ([`Renderer::update_scene`]).

// In the order in which data flow.
mod look;
pub(crate) mod grid;
mod light;
mod slabs;
mod bricks;
mod shadow;
pub mod large;
pub(crate) mod picture;
pub(crate) mod field;
mod paper;
pub mod render;
pub mod gaussians;
pub mod stats;

pub use field::Layer;
pub use gaussians::{
    GaussianLayer, GaussianModel, GaussianOptions, GaussianRenderer, PixelSamples,
};
pub use large::LargeVolume;
pub use look::clip::{Clip, ClipPlane};
pub use look::options::{
    Blend, Cells, Classify, ColourBy, DepthPlane, FieldOptions, GradientFilter, Interpolate,
    Isosurface, KernelSheets, Light, LightGrid, Occlusion, Order, RenderOptions, SampleOptions,
    SampleOrder, Shadow, Subpixels,
};
pub use look::scene::{Channel, Look, Scene};
pub use look::transfer::{ColourEncoding, ColourMap, GradientOpacity, Shading, TransferFunction};
pub use look::{clip, options, scene, transfer};
pub use paper::samples::sample::Samples;
pub use render::{Frame, Renderer};
pub use resample_core::Reuse;
pub use resample_core::clock::StageTime;
#[cfg(feature = "input")]
pub use resample_volume::gaussians::{gaussian_format_of, is_gaussians, load as load_gaussians};
pub use resample_volume::{
    BlendSpace, Described, Endian, Error, Gaussian, Gaussians, Histogram, LabelLook, LabelTable,
    Lattice, Modality, NanPolicy, Volume, VoxelType, Voxels, Watch, error, labels, procedural,
    volume,
};
#[cfg(feature = "input")]
pub use resample_volume::{
    GaussianFormat, GaussianLoadOptions, LoadOptions, RawOptions, input, load, load_components,
};
pub use stats::{FrameStats, StageTimes};
