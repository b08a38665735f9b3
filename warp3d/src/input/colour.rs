//! The picture: PNG, JPEG, EXR, TIFF and the other common formats, as linear light.
//!
//! Takes a file, gives linear red, green and blue and, where the file tells, how much of each pixel is covered.
//! Integer formats are taken for sRGB and decoded; floating-point formats are linear already. EXR is premultiplied
//! and is divided by its alpha, because a sample carries the colour of its surface. Limits: colour profiles and gamma
//! chunks are not read; EXR chromaticities are taken for Rec. 709 primaries.

use super::{Part, exr, fault, first_bytes, raster};
use crate::Error;

/// A picture in linear light.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// Linear red, green and blue, not premultiplied, all finite; rows from the top.
    pub rgb: Vec<[f32; 3]>,
    /// Covered part of each pixel, 0 to 1, where the file tells; 0 where it holds no pixel.
    pub coverage: Option<Vec<f32>>,
}

/// Largest value that is kept, the largest of half precision: sums of weighted colours must stay finite, and nothing
/// that a screen or a light meter shows is brighter.
const BRIGHTEST: f32 = 65_504.0;

/// Reads a picture. An EXR file may name a layer: `stereo.exr:left`.
pub fn read(part: &Part) -> Result<Picture, Error> {
    let picture = if exr::is_exr(&first_bytes(&part.path, 8)?) {
        exr::read_colour(&part.path, part.name.as_deref())?
    } else if let Some(name) = &part.name {
        return Err(fault(&part.path, format!("only an EXR file has layers, leave out ':{name}'")));
    } else {
        raster::read_colour(&part.path)?
    };
    Ok(tamed(picture))
}

/// Width and height of a picture, px, from its header alone.
///
/// # Errors
/// A file that cannot be read, or whose header claims more than the file can hold.
pub fn size(part: &Part) -> Result<[u32; 2], Error> {
    if exr::is_exr(&first_bytes(&part.path, 8)?) { exr::size(&part.path) } else { raster::size(&part.path) }
}

/// A colour that is not a number is no colour: its pixel is not covered. Infinite light is the brightest.
fn tamed(mut picture: Picture) -> Picture {
    let unknown = |rgb: &[f32; 3]| rgb.iter().any(|channel| channel.is_nan());
    if picture.rgb.iter().any(unknown) {
        let pixels = picture.rgb.len();
        let coverage = picture.coverage.get_or_insert_with(|| vec![1.0; pixels]);
        for (rgb, coverage) in picture.rgb.iter_mut().zip(coverage).filter(|(rgb, _)| unknown(rgb)) {
            (*rgb, *coverage) = ([0.0; 3], 0.0);
        }
    }
    for channel in picture.rgb.iter_mut().flatten() {
        *channel = channel.clamp(-BRIGHTEST, BRIGHTEST);
    }
    picture
}
