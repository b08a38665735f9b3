//! Reads pictures, their depths and their cameras.
//!
//! Takes paths and what the user says about them, gives a checked [`Reference`]. The format of a file follows from its content, never
//! its name. Whatever the source, what leaves here is one convention: linear light, camera z, and the
//! core's camera (x right, y down, z forward, pixel centres at one half); the conversions stand at this edge alone.
//! Limits: one picture a file; of a fish eye, what a pinhole of its focal length sees.

use std::path::Path;

use resample_core::Camera;

use crate::{Error, Reference};

pub mod cameras;
mod codes;
mod finish;
mod inverted;
pub mod meaning;
mod panoramas;
mod range;
mod regrid;
mod sequence;

use cameras::Distortion;
pub(crate) use finish::nothing_known;
use finish::{along_the_axis, assembled};
pub use meaning::{DepthKind, DepthMeaning};
pub use panoramas::{face_sizes, panorama};
use regrid::{Lens, Model};
use resample_io::files::fault;
pub use resample_io::files::read_text;
pub use resample_io::{MAX_PIXELS, Part, Picture, Plane, Stored, colour, depth};
pub use sequence::range_of_sequence;

/// The camera that a picture was taken with, and how its lens departs from a pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taken {
    /// The camera, as a pinhole.
    pub camera: Camera,
    /// Distortion of its lens; picture and depth are resampled without it.
    pub distortion: Option<Distortion>,
}

impl From<Camera> for Taken {
    fn from(camera: Camera) -> Self {
        Self {
            camera,
            distortion: None,
        }
    }
}

/// Puts a picture, its depth and its camera together.
///
/// `stored` holds the numbers of the depth file and `meaning` what they say. Depth of another size than the picture's is
/// resampled to it, with its edges where the colour's are; disparities count in pixels of their own file. Depth is unknown where the picture's
/// coverage is below one half: the centre of such a pixel shows nothing. Errors if the proportions differ, if the
/// meaning does not fit the numbers, or if no pixel has a usable depth; `depth_file` is named in them.
pub fn reference(
    picture: Picture,
    stored: &Plane,
    taken: impl Into<Taken>,
    meaning: &DepthMeaning,
    depth_file: &Path,
) -> Result<Reference, Error> {
    let Taken { camera, distortion } = taken.into();
    let (size, depth_size) = (
        [picture.width, picture.height],
        [stored.width, stored.height],
    );
    check_camera(size, &camera)?;
    check_proportions(size, depth_size, depth_file)?;
    let (picture, depth) = if size == depth_size && distortion.is_none() {
        let depth = meaning.camera_z(stored, &camera);
        (picture, depth.map_err(|what| fault(depth_file, what))?)
    } else {
        let model = distortion.as_ref().map_or(Model::Pinhole, Model::Distorted);
        let lens = Lens {
            camera: &camera,
            model,
            size,
        };
        let depth = regridded(stored, meaning, &picture, &lens);
        let depth = depth.map_err(|what| fault(depth_file, what))?;
        let picture = match model {
            Model::Pinhole => picture,
            _ => regrid::seen(&picture, &lens),
        };
        (picture, depth)
    };
    assembled(picture, depth, camera)
        .ok_or_else(|| nothing_known(meaning, stored.stored, depth_file))
}

/// Camera z on the pixels of the lens's camera, from a depth of another size or through a lens with distortion.
fn regridded(
    stored: &Plane,
    meaning: &DepthMeaning,
    picture: &Picture,
    lens: &Lens,
) -> Result<Vec<f32>, String> {
    // The numbers' own camera: of the same view, with the pixels of the depth file.
    let own = lens
        .camera
        .resized(stored.width as u32, stored.height as u32)
        .map_err(|error| error.to_string())?;
    let distance = meaning.distance(&meaning.numbers(stored), &own)?;
    let smooth = codes::smoothed(stored, &*distance);
    let stored = smooth.as_ref().unwrap_or(stored);
    let distances = Plane {
        values: stored.values.iter().map(|&v| distance(v) as f32).collect(),
        ..*stored
    };
    let mut z = regrid::distances(&distances, picture, lens);
    if meaning.kind == DepthKind::Ray {
        along_the_axis(&mut z, lens.camera);
    }
    Ok(z)
}

/// Largest stretch of a depth against its picture: networks round sides to multiples of 14 or 32 pixels, which is 4 %
/// of 384; the proportions 5:4 and 4:3 differ by 6 %.
const LARGEST_STRETCH: f64 = 0.05;

/// Picture and depth must show the same view.
fn check_proportions(
    size: [usize; 2],
    depth_size: [usize; 2],
    depth_file: &Path,
) -> Result<(), Error> {
    let ([width, height], [depth_width, depth_height]) = (size, depth_size);
    let expected = height as f64 * depth_width as f64 / width as f64;
    let off_px = (expected - depth_height as f64).abs();
    // Small sides are rounded to whole pixels.
    if off_px <= 0.6 || off_px <= LARGEST_STRETCH * expected {
        return Ok(());
    }
    Err(fault(
        depth_file,
        format!(
            "the depth has {depth_width}x{depth_height} pixels, the picture {width}x{height}: they differ in proportions, \
             so that they cannot show the same view; register the depth to the picture first"
        ),
    ))
}

/// Picture and camera must have one size.
fn check_camera(size: [usize; 2], camera: &Camera) -> Result<(), Error> {
    if [camera.width as usize, camera.height as usize] == size {
        return Ok(());
    }
    let (width, height) = (camera.width, camera.height);
    Err(Error::Input(format!(
        "the camera is for a picture of {width}x{height} pixels, the picture has {}x{}: scale the camera's focal \
         lengths and centre to the picture, or the picture to the camera",
        size[0], size[1]
    )))
}

#[cfg(test)]
mod tests;
