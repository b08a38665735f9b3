//! Pictures decoded whole: PNG, JPEG, WebP, TGA, BMP, TIFF, GIF, HDR and what else the crate `image` reads.
//!
//! Takes the bytes of a file, gives pixels with straight alpha. The format follows from the content; where it has no mark (TGA),
//! the caller does. 8-bit pictures stay as they are; 16-bit ones are decoded from sRGB, and
//! floating-point ones are linear already.
//! Limits: colour profiles, gamma chunks and EXIF orientation are not applied; of an animation the first picture is taken.

use std::io::Cursor;

pub use image::ImageFormat;
use image::{DynamicImage, ImageDecoder, ImageReader};
use rayon::prelude::*;
use resample_core::image::linear_from_srgb;

use crate::formats::{exr, raster};
use crate::gate::Gate;

/// Most bytes of a decoded picture: 16384 x 16384 texels of 8 bits, which is as large as graphics cards take them.
const MAX_BYTES: u64 = 1 << 30;

/// Pictures up to this size are decoded whatever the file claims: 64 MiB hurt nobody.
const FREE_BYTES: u64 = 64 << 20;

/// Bytes that one byte of a file can stand for. Deflate reaches 1032, and a progressive JPEG without detail about
/// 2000; beyond, a header is forged or the picture is one colour.
const MAX_RATIO: u64 = 2048;

/// A picture in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct WholePicture {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// The pixels, rows from the top.
    pub pixels: Pixels,
}

/// Pixels as a file has them.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// 8 bits, sRGB colour, straight linear alpha.
    Srgb8(Vec<[u8; 4]>),
    /// Linear light, straight alpha: 16-bit and floating-point pictures.
    LinearF32(Vec<[f32; 4]>),
}

/// Decodes the bytes of a picture file; `format` counts where the content has no mark, and the gate says how much memory
/// the pixels may take.
///
/// # Errors
/// The fault of the content: no known format, a size that cannot be, or data that cannot be decoded.
///
/// ```
/// use resample_io::Gate;
/// use resample_io::whole_picture::decode;
///
/// assert!(decode(b"no picture", None, &Gate::default()).is_err());
/// ```
pub fn decode(
    bytes: &[u8],
    format: Option<ImageFormat>,
    gate: &Gate,
) -> Result<WholePicture, String> {
    let (decoder, unpacked) = opened(bytes, format)?;
    gate.ask_unpacked(unpacked, bytes.len() as u64, "the pixels")?;
    let picture = DynamicImage::from_decoder(decoder).map_err(unreadable)?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    Ok(WholePicture {
        width,
        height,
        pixels: pixels(picture),
    })
}

/// The memory that the pixels of [`decode`] take, bytes, from the head of the file.
///
/// # Errors
/// Those of [`decode`], as far as the head shows them.
pub fn decoded_bytes(bytes: &[u8], format: Option<ImageFormat>) -> Result<u64, String> {
    opened(bytes, format).map(|(_, unpacked)| unpacked)
}

/// A decoder behind the head of the file, and the memory of its pixels, bytes.
fn opened(bytes: &[u8], format: Option<ImageFormat>) -> Result<(impl ImageDecoder, u64), String> {
    let told = image::guess_format(bytes).ok().or(format);
    let format =
        told.ok_or("not a picture of a known format: expected PNG, JPEG, WebP, TGA or BMP")?;
    if format == ImageFormat::OpenExr {
        exr::check_all(Cursor::new(bytes))?;
    }
    if format == ImageFormat::Jpeg {
        raster::check_whole_jpeg(bytes)?;
    }
    let reader = ImageReader::with_format(Cursor::new(bytes), format);
    let decoder = reader.into_decoder().map_err(unreadable)?;
    let unpacked = check_size(
        decoder.dimensions(),
        decoder.color_type().bytes_per_pixel(),
        bytes.len() as u64,
    )?;
    Ok((decoder, unpacked))
}

fn unreadable(error: image::ImageError) -> String {
    format!("cannot be decoded as a picture: {error}")
}

/// The bytes that are kept. Refuses a size that is 0, too large to hold, or more than the file can stand for.
fn check_size(
    (width, height): (u32, u32),
    texel_bytes: u8,
    file_bytes: u64,
) -> Result<u64, String> {
    // What is kept: 4 bytes where a channel has 8 bits, else 16.
    let kept = if texel_bytes <= 4 { 4 } else { 16 };
    let bytes = u64::from(width) * u64::from(height) * kept;
    if bytes == 0 {
        return Err(format!("a picture of {width}x{height} shows nothing"));
    }
    if bytes > MAX_BYTES {
        return Err(format!(
            "a picture of {width}x{height} is too large: scale it down to {MAX_BYTES} bytes"
        ));
    }
    if bytes > FREE_BYTES.max(file_bytes.saturating_mul(MAX_RATIO)) {
        return Err(format!(
            "claims {width}x{height} texels in {file_bytes} bytes: the file is cut or forged"
        ));
    }
    Ok(bytes)
}

fn pixels(picture: DynamicImage) -> Pixels {
    match picture {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => Pixels::LinearF32(
            picture
                .into_rgba32f()
                .pixels()
                .map(|p| p.0.map(finite))
                .collect(),
        ),
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let picture = picture.into_rgba16();
            Pixels::LinearF32(
                picture
                    .as_raw()
                    .par_chunks_exact(4)
                    .map(linear_from_16_bits)
                    .collect(),
            )
        }
        // Most pictures; without a second copy of a large one.
        DynamicImage::ImageRgb8(picture) => Pixels::Srgb8(
            picture
                .as_raw()
                .par_chunks_exact(3)
                .map(|texel| [texel[0], texel[1], texel[2], 255])
                .collect(),
        ),
        other => Pixels::Srgb8(other.into_rgba8().pixels().map(|p| p.0).collect()),
    }
}

fn linear_from_16_bits(texel: &[u16]) -> [f32; 4] {
    let channel = |at: usize| f32::from(texel[at]) / 65535.0;
    let colour = |at: usize| linear_from_srgb(channel(at));
    [colour(0), colour(1), colour(2), channel(3)]
}

/// A floating-point picture may hold NaN and infinity; no later stage has to know.
fn finite(channel: f32) -> f32 {
    if channel.is_finite() { channel } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_held_against_the_memory_and_the_file() {
        let side = 1 << 14;
        assert_eq!(check_size((side, side), 3, 1 << 30), Ok(MAX_BYTES));
        assert!(
            check_size((side, side + 1), 3, 1 << 30).is_err(),
            "a row more"
        );
        assert_eq!(
            check_size((side / 2, side / 2), 6, 1 << 30),
            Ok(MAX_BYTES),
            "16 bits take four times as much"
        );
        assert!(check_size((side, side / 2), 6, 1 << 30).is_err());
        assert!(check_size((0, 5), 3, 100).is_err() && check_size((5, 0), 3, 100).is_err());
        // 4096 x 4096 pixels of 4 bytes are what any file may claim.
        assert_eq!(check_size((4096, 4096), 4, 0), Ok(FREE_BYTES));
        assert!(check_size((4096, 4097), 4, 0).is_err());
        let held = FREE_BYTES / MAX_RATIO;
        assert!(check_size((4096, 4097), 4, held).is_err());
        assert!(check_size((4096, 4097), 4, held + 8).is_ok());
    }

    #[test]
    fn numbers_that_are_none_become_black() {
        let given = [0.25, -3.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        assert_eq!(given.map(finite), [0.25, -3.0, 0.0, 0.0, 0.0]);
    }

    fn png(picture: &DynamicImage) -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        picture
            .write_to(&mut file, ImageFormat::Png)
            .expect("memory");
        file.into_inner()
    }

    #[test]
    fn eight_bits_stay_and_sixteen_become_linear() {
        let small =
            DynamicImage::ImageRgb8(image::RgbImage::from_pixel(2, 1, image::Rgb([10, 20, 30])));
        let Ok(WholePicture {
            width: 2,
            height: 1,
            pixels: Pixels::Srgb8(texels),
            ..
        }) = decode(&png(&small), None, &Gate::default())
        else {
            panic!("a picture of 2x1 with 8 bits")
        };
        assert_eq!(
            texels,
            [[10, 20, 30, 255]; 2],
            "the file's own bytes, opaque"
        );
        let deep = image::ImageBuffer::from_pixel(1, 1, image::Rgba([65535u16, 0, 32768, 16384]));
        let Ok(WholePicture {
            pixels: Pixels::LinearF32(texels),
            ..
        }) = decode(
            &png(&DynamicImage::ImageRgba16(deep)),
            None,
            &Gate::default(),
        )
        else {
            panic!("16 bits become linear")
        };
        let expected = [
            1.0,
            0.0,
            linear_from_srgb(32768.0 / 65535.0),
            16384.0 / 65535.0,
        ];
        assert_eq!(texels, [expected], "colour decoded, alpha as it is");
    }

    #[test]
    fn forged_and_foreign_files_are_refused_before_anything_is_allocated() {
        let mut forged = png(&DynamicImage::new_rgb8(1, 1));
        // Width and height of a PNG lie at byte 16; either the checksum of the header or the size is refused.
        forged[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
        assert!(
            decode(&forged, None, &Gate::default()).is_err(),
            "16384 x 16384 texels do not fit into 70 bytes"
        );
        assert!(
            check_size((16384, 16384), 4, 70).is_err_and(|e| e.contains("forged")),
            "by the ratio"
        );
        assert!(
            check_size((40_000, 40_000), 4, u64::MAX).is_err_and(|e| e.contains("too large")),
            "by the bound"
        );
        assert!(check_size((0, 5), 4, 70).is_err(), "nothing to see");
        assert!(
            decode(b"no picture", None, &Gate::default())
                .is_err_and(|e| e.contains("known format")),
            "no mark"
        );
    }
}
