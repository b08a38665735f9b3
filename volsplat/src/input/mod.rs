//! Volume files: finds the format by the content and gives a checked volume.
//!
//! Limits: one scalar per voxel, of colours and vectors one component; one volume per file. World coordinates stay as the format defines them.

mod axes;
mod colours;
mod component;
mod data_files;
mod decode;
mod dicom;
mod fault;
mod file;
pub mod format;
mod lines;
mod load;
mod meta_image;
mod mgh;
mod nifti;
mod npy;
mod nrrd;
mod options;
mod packed;
mod picture_slices;
pub mod raw;
mod rescale;
mod slices;
mod stays;
mod stored;
mod tiff_stack;
mod vti;
mod vtk;
mod zarr;

pub use colours::{ColourVoxels, arrays_of, colours_of, load_colours};
pub(crate) use file::{Parts, cannot_read, invalid, open, open_sized, unsupported_file};
pub use format::{Format, format_of};
pub use load::{load, of_memory};
pub use options::LoadOptions;
pub use raw::RawOptions;
pub use stays::{Unread, open_unread, peek};
pub use tiff_stack::pages_of;

#[cfg(test)]
mod test_files;
#[cfg(test)]
mod tests;
