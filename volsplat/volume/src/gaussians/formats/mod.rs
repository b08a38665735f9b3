//! One file or folder for each format of files of Gaussians: takes a path, returns the Gaussians, which `sink` collects.
//!
//! Coordinates stay as the file has them. The formats have customs, not rules: INRIA's PLY files and `.splat` usually have y down
//! and z forward, SPZ and SOG y up and z backward, glTF y up by its specification.

pub(super) mod sink;
pub(super) mod ply;
pub(super) mod packed_ply;
pub(super) mod splat;
pub(super) mod spz;
pub(super) mod sog;
pub(super) mod gltf;
#[cfg(test)]
mod test_files;
