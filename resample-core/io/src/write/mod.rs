//! Pictures and films as files: whole files under a name, and the bytes of each format.
//!
//! Takes a [`resample_core::Image`], gives files that appear complete or not at all: everything goes to a temporary file
//! in the target's own folder, which is renamed when it is complete. What stood there before stays until then.

pub mod exr;
pub mod gif;
pub mod png;
pub mod webp;
mod checks;
mod failure;
mod files;
mod films;
mod pieces;
mod runs;
mod stereo_jpeg;
mod temporary;
#[cfg(test)]
mod tests;

pub use checks::{
    check_name, check_new, check_not_input, check_not_inputs, check_writable, make_folder,
};
pub use failure::WriteFailure;
pub use files::{
    Format, format_of, png_codes, png_file, write_bytes, write_grey, write_marked_picture,
    write_picture, write_text, write_tile,
};
pub use films::{DEFAULT_FPS, Film, FilmKind, FilmPlan, kind_of};
pub use pieces::Left;
pub use stereo_jpeg::Views;
pub use temporary::{Listed, remove_all_and_exit, temporary_file};
