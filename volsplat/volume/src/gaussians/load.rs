//! Reads a file of Gaussians: finds the format by the content, and returns them with notes on what was decided.
//!
//! Takes a path and the rules of reading. A PLY file holds Gaussians if its vertices have their properties, a glTF file if it
//! names their extension, an archive or a folder if it has a description of them. `.splat` has no mark, and counts only
//! where nothing else fits.

use std::io::{BufReader, Read};
use std::path::Path;

use glam::DVec3;
use resample_io::Gate;
use resample_io::ply::{self as table, Header};

use crate::Error;
use crate::gaussians::Gaussians;
use crate::gaussians::formats::{gltf, packed_ply, ply, sog, splat, spz};
use crate::input::decode::zip;
use crate::input::{cannot_read, invalid, open_sized};

/// Options of reading Gaussians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GaussianLoadOptions {
    /// Rules for names inside files, and the memory the Gaussians may take.
    pub gate: Gate,
}

/// The formats of files of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianFormat {
    /// PLY with the properties of INRIA's code.
    Ply,
    /// PlayCanvas' compressed PLY.
    PackedPly,
    /// `.splat`, 32 bytes a Gaussian.
    Splat,
    /// Niantic's SPZ.
    Spz,
    /// PlayCanvas' SOG: a folder, its description, or an archive.
    Sog,
    /// glTF with the extension `KHR_gaussian_splatting`.
    Gltf,
}

impl GaussianFormat {
    /// The usual name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::PackedPly => "compressed PLY",
            Self::Splat => ".splat",
            Self::Spz => "SPZ",
            Self::Sog => "SOG",
            Self::Gltf => "glTF",
        }
    }

    /// The direction that is up in files of this kind, a unit vector.
    ///
    /// SPZ (right, up, back) and glTF say that y is up. The others keep the axes of the cameras that they were trained with, whose y
    /// usually points down; nothing in the file says so.
    pub fn up_in_world(self) -> DVec3 {
        match self {
            Self::Ply | Self::PackedPly | Self::Splat | Self::Sog => DVec3::NEG_Y,
            Self::Spz | Self::Gltf => DVec3::Y,
        }
    }
}

/// Bytes that tell a format: the unpacked beginning of SPZ takes the most.
const HEAD_BYTES: u64 = 4096;

/// The format of the Gaussians at a path; `None` where it holds something else.
///
/// # Errors
/// [`Error::Read`] for a file that the system cannot read.
pub fn gaussian_format_of(path: &Path) -> Result<Option<GaussianFormat>, Error> {
    if path.is_dir() {
        return Ok(sog::begins(path).then_some(GaussianFormat::Sog));
    }
    let (mut file, bytes) = open_sized(path)?;
    let mut head = Vec::new();
    let read = (&mut file).take(HEAD_BYTES).read_to_end(&mut head);
    read.map_err(|source| cannot_read(path, source))?;
    let found = match head.as_slice() {
        head if table::begins(head) => of_ply(path)?,
        head if spz::begins(head) => Some(GaussianFormat::Spz),
        head if head.starts_with(zip::MAGIC) => sog::is_bundle(path).then_some(GaussianFormat::Sog),
        head if gltf::may_begin(head) => match gltf::begins(path) {
            true => Some(GaussianFormat::Gltf),
            false => sog::begins(path).then_some(GaussianFormat::Sog),
        },
        _ if !matches!(crate::input::format_of(path), Ok(None)) => None,
        _ => {
            let is_splat = splat::begins(&mut file, bytes);
            let is_splat = is_splat.map_err(|source| cannot_read(path, source))?;
            is_splat.then_some(GaussianFormat::Splat)
        }
    };
    Ok(found)
}

fn of_ply(path: &Path) -> Result<Option<GaussianFormat>, Error> {
    let (file, _) = open_sized(path)?;
    let Ok(header) = Header::read(&mut BufReader::new(file)) else {
        return Ok(None);
    };
    Ok(match () {
        () if ply::begins(&header) => Some(GaussianFormat::Ply),
        () if packed_ply::begins(&header) => Some(GaussianFormat::PackedPly),
        () => None,
    })
}

/// Returns true if a path holds Gaussians of a known format.
///
/// ```
/// assert!(!resample_volume::gaussians::is_gaussians(std::path::Path::new("absent.ply")));
/// ```
pub fn is_gaussians(path: &Path) -> bool {
    matches!(gaussian_format_of(path), Ok(Some(_)))
}

/// Reads Gaussians, and notes on what was left out or decided, for the person who reads the file.
///
/// # Errors
/// Each names the file: [`Error::Read`] if the system cannot read it, [`Error::Invalid`] if it contradicts its format or holds no
/// Gaussians, [`Error::Unsupported`] if it is of a rare form that is not read.
pub fn load(path: &Path, options: &GaussianLoadOptions) -> Result<(Gaussians, Vec<String>), Error> {
    let gate = &options.gate;
    let mut notes = Vec::new();
    let read = match gaussian_format_of(path)? {
        Some(GaussianFormat::Ply) => ply::load(path, gate, &mut notes),
        Some(GaussianFormat::PackedPly) => packed_ply::load(path, gate, &mut notes),
        Some(GaussianFormat::Splat) => splat::load(path, gate, &mut notes),
        Some(GaussianFormat::Spz) => spz::load(path, gate, &mut notes),
        Some(GaussianFormat::Sog) => sog::load(path, gate, &mut notes),
        Some(GaussianFormat::Gltf) => gltf::load(path, gate, &mut notes),
        None => Err(unknown(path)),
    };
    Ok((read?, notes))
}

/// The error for what is none of the formats.
fn unknown(path: &Path) -> Error {
    let is_empty = !path.is_dir() && open_sized(path).is_ok_and(|(_, bytes)| bytes == 0);
    let found = match is_empty {
        true => "it is empty",
        false => "it holds no Gaussians of a known format, or is cut off",
    };
    let expected = "expected PLY (as INRIA's code writes it, or compressed), .splat, SPZ, SOG or glTF with KHR_gaussian_splatting";
    invalid(path, format!("{found}: {expected}"))
}

#[cfg(test)]
mod tests;
