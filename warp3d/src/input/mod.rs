//! What users bring: a picture, its depth and its camera, in the formats that people hold.
//!
//! Takes paths and what the user says about them, gives a checked [`Reference`]. Formats are told by the content of a
//! file, never by its name. Whatever the source, what leaves here is one convention: linear light, camera z, and the
//! core's camera (x right, y down, z forward, pixel centres at one half); the conversions stand at this edge alone.
//! Limits: pinhole and parallel cameras without lens distortion; one picture a file.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use resample_core::Camera;

use crate::{Error, Reference};

pub mod cameras;
pub mod colour;
pub mod depth;
pub mod meaning;
pub mod plane;

mod exr;
mod npy;
mod pfm;
mod png;
mod raster;
pub(crate) mod receiver;
mod tiff;

pub use colour::Picture;
pub use meaning::{DepthKind, DepthMeaning};
pub use plane::{Plane, Stored};

/// A file and, behind a `#`, the channel or layer of it: `ref.exr#Z`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The file.
    pub path: PathBuf,
    /// Channel, layer or part inside the file.
    pub name: Option<String>,
}

/// Most pixels of a picture that is read: 16384 x 16384.
///
/// A colour picture of that size takes 3 GiB in memory and its depth 1 GiB; a forged header must not be able to ask
/// for more.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Largest file of cameras, numbers or lists that is read as text, bytes. A pose takes about 200 bytes.
const MAX_TEXT_BYTES: u64 = 256 << 20;

impl Part {
    /// Splits `FILE#NAME` at the last `#`; a file whose own name holds it wins.
    pub fn from_text(text: &str) -> Self {
        match text.rsplit_once('#') {
            Some((path, name))
                if !path.is_empty() && !name.is_empty() && !Path::new(text).exists() =>
            {
                Self {
                    path: PathBuf::from(path),
                    name: Some(name.to_owned()),
                }
            }
            _ => Self {
                path: PathBuf::from(text),
                name: None,
            },
        }
    }
}

/// Puts a picture, its depth and its camera together.
///
/// `stored` holds the numbers of the depth file and `meaning` what they say. Depth is unknown where the picture's
/// coverage is below one half: the centre of such a pixel shows nothing. Errors if the sizes differ, if the meaning
/// does not fit the numbers, or if no pixel has a usable depth; `depth_file` is named in them.
pub fn reference(
    picture: Picture,
    stored: &Plane,
    camera: Camera,
    meaning: &DepthMeaning,
    depth_file: &Path,
) -> Result<Reference, Error> {
    let size = [picture.width, picture.height];
    check_sizes(size, [stored.width, stored.height], &camera, depth_file)?;
    let mut depth = meaning
        .camera_z(stored, &camera)
        .map_err(|what| fault(depth_file, what))?;
    if let Some(coverage) = &picture.coverage {
        let uncovered = coverage
            .iter()
            .zip(&mut depth)
            .filter(|(coverage, _)| **coverage < 0.5);
        uncovered.for_each(|(_, z)| *z = f32::NAN);
    }
    if depth.iter().all(|z| z.is_nan()) {
        return Err(nothing_known(meaning, stored.stored, depth_file));
    }
    Ok(Reference {
        camera,
        colour: picture.rgb,
        depth,
    })
}

/// Picture, depth and camera must have one size.
pub(crate) fn check_sizes(
    size: [usize; 2],
    depth_size: [usize; 2],
    camera: &Camera,
    depth_file: &Path,
) -> Result<(), Error> {
    if depth_size != size {
        let ([width, height], [depth_width, depth_height]) = (size, depth_size);
        return Err(fault(
            depth_file,
            format!(
                "the depth has {depth_width}x{depth_height} pixels, the picture {width}x{height}: both must have one size"
            ),
        ));
    }
    if [camera.width as usize, camera.height as usize] != size {
        let (width, height) = (camera.width, camera.height);
        return Err(Error::Input(format!(
            "the camera is for a picture of {width}x{height} pixels, the picture has {}x{}: scale the camera's focal \
             lengths and centre to the picture, or the picture to the camera",
            size[0], size[1]
        )));
    }
    Ok(())
}

pub(crate) fn nothing_known(meaning: &DepthMeaning, stored: Stored, depth_file: &Path) -> Error {
    fault(
        depth_file,
        format!(
            "no pixel has a usable depth (read as {})",
            meaning.told(stored)
        ),
    )
}

/// An error that names the file.
pub(crate) fn fault(path: &Path, what: impl std::fmt::Display) -> Error {
    Error::Input(format!("{}: {what}", path.display()))
}

fn cannot_read(path: &Path, source: &std::io::Error) -> Error {
    fault(path, format!("cannot read: {source}"))
}

/// Opens a file and gives its length; a folder is an error here, not later.
fn open(path: &Path) -> Result<(File, u64), Error> {
    let opened = || -> std::io::Result<(File, u64)> {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        if metadata.is_dir() {
            return Err(std::io::ErrorKind::IsADirectory.into());
        }
        Ok((file, metadata.len()))
    };
    opened().map_err(|source| cannot_read(path, &source))
}

/// The first bytes of a file, at most `count`.
pub(crate) fn first_bytes(path: &Path, count: u64) -> Result<Vec<u8>, Error> {
    let (file, _) = open(path)?;
    let mut bytes = Vec::new();
    file.take(count)
        .read_to_end(&mut bytes)
        .map_err(|source| cannot_read(path, &source))?;
    Ok(bytes)
}

/// A whole file of text.
fn read_text(path: &Path) -> Result<String, Error> {
    let (file, _) = open(path)?;
    let mut text = String::new();
    // A limit on what is read, not on the size that the system tells: a pipe or a device tells none.
    file.take(MAX_TEXT_BYTES + 1)
        .read_to_string(&mut text)
        .map_err(|source| cannot_read(path, &source))?;
    if text.len() as u64 > MAX_TEXT_BYTES {
        return Err(fault(
            path,
            format!("more than {MAX_TEXT_BYTES} bytes, more than any list of cameras"),
        ));
    }
    Ok(text)
}

/// Checks a claimed picture size against [`MAX_PIXELS`] and against what a file of this length can unpack to.
///
/// `most_per_byte` is the largest number of pixels that one byte of the format can stand for.
fn check_claim(width: u64, height: u64, file_bytes: u64, most_per_byte: u64) -> Result<(), String> {
    let pixels = width.saturating_mul(height);
    if pixels == 0 {
        return Err(format!(
            "the header says {width}x{height} pixels: there is nothing to show"
        ));
    }
    if pixels > MAX_PIXELS {
        return Err(format!(
            "{width}x{height} pixels, more than the {MAX_PIXELS} that are read"
        ));
    }
    if pixels > file_bytes.saturating_mul(most_per_byte) {
        return Err(format!(
            "the header says {width}x{height} pixels, more than a file of {file_bytes} bytes can hold"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
