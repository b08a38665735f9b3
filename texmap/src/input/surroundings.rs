//! The light around a scene: an equirectangular picture, HDR, EXR or any other that is read as colours.

use std::path::Path;

use resample_io::{Part, colour};

use crate::Error;
use crate::scene::Surroundings;

/// Reads the picture; light below zero counts as none.
pub(super) fn read(path: &Path) -> Result<Surroundings, Error> {
    let picture = colour::read(&Part {
        path: path.to_owned(),
        name: None,
    })?;
    let (width, height) = (picture.width, picture.height);
    if width != 2 * height {
        return Err(Error::Input(format!(
            "{}: {width}x{height} pixels, expected an equirectangular picture, twice as wide as high",
            path.display()
        )));
    }
    let rgb = picture.rgb.into_iter();
    Ok(Surroundings {
        width,
        height,
        rgb: rgb.map(|pixel| pixel.map(|light| light.max(0.0))).collect(),
    })
}
