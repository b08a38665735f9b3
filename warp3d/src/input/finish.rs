//! The last steps of every picture with depth: camera z, unknown pixels, and the error where nothing is known.

use std::path::Path;

use resample_core::Camera;

use super::meaning::{self, DepthMeaning};
use crate::{Error, Reference};
use resample_io::files::fault;
use resample_io::{Picture, Stored};

/// The reference of a picture and its camera z; `None` if no pixel has a usable depth.
pub(super) fn assembled(
    picture: Picture,
    mut depth: Vec<f32>,
    camera: Camera,
) -> Option<Reference> {
    if let Some(coverage) = &picture.coverage {
        let uncovered = coverage
            .iter()
            .zip(&mut depth)
            .filter(|(coverage, _)| **coverage < 0.5);
        uncovered.for_each(|(_, z)| *z = f32::NAN);
    }
    let is_known = depth.iter().any(|z| !z.is_nan());
    is_known.then_some(Reference {
        camera,
        colour: picture.rgb,
        depth,
    })
}

/// Makes camera z of distances along the rays.
pub(super) fn along_the_axis(distances: &mut [f32], camera: &Camera) {
    let width = camera.width as usize;
    for (index, z) in distances.iter_mut().enumerate() {
        let ray = meaning::ray_length(camera, index % width, index / width);
        *z = (f64::from(*z) / ray) as f32;
    }
}

/// The error for a depth file of which nothing can be used.
pub(crate) fn nothing_known(meaning: &DepthMeaning, stored: Stored, depth_file: &Path) -> Error {
    fault(
        depth_file,
        format!(
            "no pixel has a usable depth (read as {})",
            meaning.told(stored)
        ),
    )
}
