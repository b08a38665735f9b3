//! JPEG: sRGB, 8 bits, lossy and opaque: what is transparent is black.

use std::io::Write;

use anyhow::Result;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use resample_core::Image;

use super::png::opaque_bytes;

/// Quality, 1 to 100: at 92, errors are below what most people see. A guess.
const QUALITY: u8 = 92;

/// Writes `image` to `file`.
pub(super) fn write(file: impl Write, image: &Image) -> Result<()> {
    let mut opaque = image.clone();
    opaque.rgba.iter_mut().for_each(|pixel| pixel[3] = 1.0);
    let (width, height) = (u32::try_from(image.width)?, u32::try_from(image.height)?);
    let bytes = opaque_bytes(&opaque);
    JpegEncoder::new_with_quality(file, QUALITY).encode(
        &bytes,
        width,
        height,
        ExtendedColorType::Rgb8,
    )?;
    Ok(())
}
