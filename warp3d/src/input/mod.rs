//! Reads pictures, their depths and their cameras.
//!
//! Takes paths and what the user says about them, gives a checked [`Reference`]. The format of a file follows from its content, never
//! its name. Whatever the source, what leaves here is one convention: linear light, camera z, and the
//! core's camera (x right, y down, z forward, pixel centres at one half); the conversions stand at this edge alone.
//! Limits: pinhole and parallel cameras without lens distortion; one picture a file.

use std::path::Path;

use resample_core::Camera;

use crate::{Error, Reference};

pub mod cameras;
pub mod meaning;

pub use meaning::{DepthKind, DepthMeaning};
use resample_io::files::fault;
pub use resample_io::{MAX_PIXELS, Part, Picture, Plane, Stored, colour, depth};

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

#[cfg(test)]
mod tests;
