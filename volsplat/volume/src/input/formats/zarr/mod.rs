//! OME-Zarr images 0.4 and 0.5, and plain Zarr arrays, versions 2 and 3 of Zarr.
//!
//! Takes a folder, gives the parts of a volume. The group's metadata (`image.rs`) names the levels of the image and what the
//! axes are; the array of the level that was asked for (`array.rs`) says how its chunks are cut and packed; the chunks that
//! hold the chosen channel and time are unpacked (`codecs.rs`, `blosc.rs`) and laid into the volume (`boxes.rs`).
//! Source: the Zarr storage specifications, versions 2 and 3, and OME-NGFF 0.4 and 0.5. Metadata and chunks are read by our
//! own code, because the crates for Zarr bring C libraries and more than a hundred crates along; compression is left to crates.
//! Limits: local folders; numbers of 8 to 64 bits, no half floats; checksums are not compared.

mod array;
mod blosc;
mod boxes;
mod codecs;
mod image;
mod metadata;
mod opened;
mod packed;
mod unpacked;

pub(crate) use opened::{Choice, Opened, begins, load, open};

#[cfg(test)]
mod tests;
