//! The picture: PNG, JPEG, EXR, TIFF and the other common formats, as linear light.
//!
//! Takes a file, gives linear red, green and blue and, where the file holds it, the covered part of each pixel.
//! Integer formats are taken for sRGB and decoded; floating-point formats are linear already. EXR is premultiplied
//! and is divided by its alpha, because a sample carries the colour of its surface. Limits: colour profiles and gamma
//! chunks are not read; EXR chromaticities are taken for Rec. 709 primaries.

use super::files::{Part, fault, first_bytes};
use super::picture::Picture;
pub use super::picture::Storage;
use super::receiver::{HeldPicture, Receiver, Room};
use crate::formats::{exr, raster};
use resample_core::Error;

/// Largest value that is kept, the largest of half precision: sums of weighted colours must stay finite, and nothing
/// that a screen or a light meter shows is brighter.
pub const BRIGHTEST: f32 = 65_504.0;

/// Reads a picture. An EXR file may name a layer: `stereo.exr#left`.
pub fn read(part: &Part) -> Result<Picture, Error> {
    let mut held = HeldPicture::default();
    let has_alpha = decode(part, Room::ENDLESS, &mut held)?;
    Ok(held.picture(has_alpha))
}

/// Gives a picture to `to` piece by piece; true if the file states how much of each pixel is covered.
pub fn decode(part: &Part, room: Room, to: &mut dyn Receiver) -> Result<bool, Error> {
    let mut tamed = Tamed {
        to,
        row: Vec::new(),
    };
    if exr::is_exr(&first_bytes(&part.path, 8)?) {
        return exr::decode_colour(&part.path, part.name.as_deref(), room, &mut tamed);
    }
    if let Some(name) = &part.name {
        return Err(fault(
            &part.path,
            format!("only an EXR file has layers, leave out ':{name}'"),
        ));
    }
    raster::decode_colour(&part.path, room, &mut tamed)
}

/// Width and height of a picture, px, from its header alone.
///
/// # Errors
/// A file that cannot be read, or whose header claims more than the file can hold.
pub fn size(part: &Part) -> Result<[u32; 2], Error> {
    if exr::is_exr(&first_bytes(&part.path, 8)?) {
        exr::size(&part.path)
    } else {
        raster::size(&part.path)
    }
}

/// The vertical field of view of a photograph, degrees, from the 35 mm equivalent focal length of its EXIF data; `None` where it has none.
///
/// # Errors
/// As [`size`].
pub fn fov_y_deg(part: &Part) -> Result<Option<f64>, Error> {
    if exr::is_exr(&first_bytes(&part.path, 8)?) {
        return Ok(None);
    }
    raster::fov_y_deg(&part.path)
}

/// The memory that reading a picture takes, from its header alone.
///
/// # Errors
/// As [`size`].
pub fn storage(part: &Part) -> Result<Storage, Error> {
    if exr::is_exr(&first_bytes(&part.path, 8)?) {
        return Ok(Storage {
            size: exr::size(&part.path)?,
            channel_bytes: 4,
            // Files whose lines come in any order are held whole, in four channels.
            decoder_bytes: 16,
        });
    }
    raster::storage(&part.path)
}

/// A colour that is not a number is no colour: its pixel is not covered. Infinite light is the brightest.
struct Tamed<'a> {
    to: &'a mut dyn Receiver,
    row: Vec<f32>,
}

impl Receiver for Tamed<'_> {
    fn begin(&mut self, size: [usize; 2]) -> Result<(), Error> {
        self.to.begin(size)
    }

    fn put(&mut self, at: [usize; 2], values: &[f32]) -> Result<(), Error> {
        self.row.clear();
        for pixel in values.chunks_exact(4) {
            if pixel[..3].iter().any(|channel| channel.is_nan()) {
                self.row.extend([0.0; 4]);
            } else {
                self.row.extend(
                    pixel[..3]
                        .iter()
                        .map(|channel| channel.clamp(-BRIGHTEST, BRIGHTEST)),
                );
                self.row.push(pixel[3]);
            }
        }
        self.to.put(at, &self.row)
    }
}
