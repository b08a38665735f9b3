//! Volume files: finds the format by the content and gives a checked volume.
//!
//! Limits: one scalar per voxel, of colours and vectors one component; one volume per file. World coordinates stay as the format defines them.

pub(crate) mod formats;

mod colours;
mod data_files;
mod decode;
mod fault;
mod file;
pub mod format;
mod lines;
mod load;
mod options;
mod slices;
mod stays;

pub use colours::{ColourVoxels, arrays_of, colours_of, load_colours};
pub(crate) use file::{Parts, cannot_read, invalid, open, open_sized, unsupported_file};
pub use format::{Format, format_of};
pub use formats::raw::RawOptions;
pub use formats::tiff_stack::pages_of;
pub use load::{load, of_memory};
pub use options::LoadOptions;
pub use stays::{Unread, open_unread, peek};

#[cfg(test)]
mod test_files;
#[cfg(test)]
mod tests;
