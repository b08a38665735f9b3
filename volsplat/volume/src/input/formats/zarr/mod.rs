//! OME-Zarr images 0.4 and 0.5, and plain Zarr arrays, versions 2 and 3 of Zarr.
//!
//! Takes a folder or a ZIP archive (`store.rs`), returns the parts of a volume. The group's metadata names the levels of the image and its
//! axes: version 0.4 keeps it in `.zattrs`, version 0.5 under `ome` in `zarr.json`; a plain array is an image of one level whose last three
//! axes are z, y and x. The array of the chosen level (`array.rs`) says how its chunks are cut and packed; the chunks that
//! hold the chosen channel and time are unpacked (`codecs.rs`) and copied into the volume, or into a file (`unpacked.rs`).
//! Source: the Zarr storage specifications, versions 2 and 3, and OME-NGFF 0.4 and 0.5. Metadata and chunks are read by our
//! own code, because the crates for Zarr bring C libraries and more than a hundred crates along; compression is left to crates.
//! Limits: local folders and archives; numbers of 8 to 64 bits, no half floats; checksums are not compared.

pub(crate) mod codecs;
mod array;
mod opened;
mod store;
mod unpacked;

pub(crate) use opened::{Opened, axes, load, open};
pub(crate) use store::begins;

#[cfg(test)]
mod tests;
