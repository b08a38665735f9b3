//! Volumes and Gaussians in memory, transfer functions, labels, and the files they come from. Volumes: DICOM, NIfTI, NRRD, MetaImage, MGH, VTK, Zarr,
//! TIFF, pictures, `.npy` and raw numbers. Three-dimensional Gaussians: PLY (INRIA's, and PlayCanvas' compressed one), `.splat`,
//! SPZ, SOG and glTF.
//!
//! Takes a path and [`LoadOptions`], returns a checked [`Volume`]: voxels of their own type on a lattice in the world. The format
//! follows from the content, never from the name. A volume larger than memory is a [`VoxelSource`]: any box of its voxels is
//! read when it is asked for. Likewise [`gaussians::load`] takes a path and [`GaussianLoadOptions`], returns [`Gaussians`].
//! Limits: one scalar per voxel (a component of several, if it is chosen), regular lattices.
//!
//! ```
//! use glam::DAffine3;
//! use resample_volume::{Described, Volume, Voxels};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let values = (0..8 * 8 * 8).map(|i| i as f32).collect();
//! let volume = Volume::new([8; 3], Voxels::F32(values), DAffine3::IDENTITY)?;
//! assert_eq!(volume.value_range(), (0.0, 511.0));
//! # Ok(())
//! # }
//! ```

// In the order in which data flow.
#[cfg(feature = "input")]
pub mod input;
pub mod volume;
pub mod gaussians;
pub mod transfer;
pub mod labels;
#[cfg(feature = "input")]
mod label_files;
pub mod source;
pub mod error;

pub use error::Error;
pub use gaussians::{BlendSpace, Gaussian, Gaussians};
#[cfg(feature = "input")]
pub use gaussians::{GaussianFormat, GaussianLoadOptions, is_gaussians};
#[cfg(feature = "input")]
pub use input::{LoadOptions, RawOptions, load, load_components};
pub use labels::{LabelLook, LabelTable};
pub use source::{Region, VoxelSource, Watch};
pub use transfer::{ColourEncoding, ColourMap, Shading, TransferFunction};
pub use volume::{
    Described, Endian, Histogram, Lattice, Modality, NanPolicy, Volume, VoxelType, Voxels,
    procedural,
};
