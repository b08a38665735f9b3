//! The light around a scene: an equirectangular picture, HDR, EXR or any other that is read as colours.

use std::path::Path;

use resample_io::{Gate, Part, colour};

use crate::Error;
use crate::scene::Surroundings;

/// Bytes of a pixel in memory.
const PIXEL_BYTES: u64 = 12;

/// Reads the picture; light below zero counts as none. The gate says how much memory it may take.
pub(crate) fn read(path: &Path, gate: &Gate) -> Result<Surroundings, Error> {
    let part = Part {
        path: path.to_owned(),
        name: None,
    };
    let storage = colour::storage(&part)?;
    let pixels: u64 = storage.size.map(u64::from).iter().product();
    let bytes = pixels.saturating_mul(PIXEL_BYTES + storage.decoder_bytes);
    let packed = std::fs::metadata(path).map_or(0, |file| file.len());
    gate.ask_unpacked(bytes, packed, "the surroundings")
        .map_err(|what| Error::Input(format!("{}: {what}", path.display())))?;
    let picture = colour::read(&part)?;
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
