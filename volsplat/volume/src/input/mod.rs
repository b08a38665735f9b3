//! Volume files: finds the format by the content and returns a checked volume.
//!
//! In the order in which data flow: opened files (`file`, `slices`, `data_files`); scalars (`decode`);
//! the user's `options`; one part for each format (`formats`), found by content (`format`); `load` for a volume in
//! memory or in its file; `colours` for what a file holds beside one scalar a voxel, in the types of `axes`.
//! Limits: one scalar per voxel, of colours and vectors one component; one volume per file. World coordinates stay as the format defines them.

mod axes;
mod file;
mod slices;
mod data_files;
pub(crate) mod decode;
mod options;
pub(crate) mod formats;
pub mod format;
mod load;
mod colours;

pub use axes::{ImageAxes, ImageChannel};
pub use colours::{ColourVoxels, arrays_of, axes_of, colours_of, load_colours};
pub(crate) use file::{
    Fault, Parts, cannot_read, invalid, open, open_sized, unsupported, unsupported_file,
};
pub use format::{Format, format_of, step_files};
pub use formats::tiff_stack::pages_of;
pub use load::{Unread, load, load_components, of_memory, open_unread, peek};
pub use options::{LoadOptions, RawOptions};

#[cfg(test)]
pub(crate) mod test_files;
#[cfg(test)]
mod tests;
