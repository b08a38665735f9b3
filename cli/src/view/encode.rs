//! Pictures for the page: JPEG while something moves, PNG at rest.
//!
//! The page lays a PNG over its background in display colours, as browsers do; a JPEG is laid over it here in the same
//! way, so that nothing changes its colour when the motion ends.

use anyhow::Result;
use image::codecs::jpeg::JpegEncoder;
use resample_core::Image;

use crate::output;

/// Quality of moving pictures, 1 to 100: edges are clean, and a second of them takes about a megabyte.
const QUALITY: u8 = 85;

/// Display colour behind what is transparent, each channel.
pub(crate) const BACKDROP: u8 = 0x1b;

/// A JPEG over the page's background.
pub(crate) fn jpeg(image: &Image) -> Result<Vec<u8>> {
    let straight = output::png_codes(image);
    let over = |code: u8, alpha: u8| {
        let (code, alpha) = (u32::from(code), u32::from(alpha));
        ((code * alpha + u32::from(BACKDROP) * (255 - alpha) + 127) / 255) as u8
    };
    let mut codes = Vec::with_capacity(straight.len() / 4 * 3);
    for &[r, g, b, alpha] in straight.as_chunks::<4>().0 {
        codes.extend([over(r, alpha), over(g, alpha), over(b, alpha)]);
    }
    let mut bytes = Vec::new();
    let (width, height) = (u32::try_from(image.width)?, u32::try_from(image.height)?);
    JpegEncoder::new_with_quality(&mut bytes, QUALITY).encode(
        &codes,
        width,
        height,
        image::ExtendedColorType::Rgb8,
    )?;
    Ok(bytes)
}

/// The bytes of a PNG file.
pub(crate) fn png(image: &Image) -> Result<Vec<u8>> {
    Ok(output::png_file(image)?)
}
