//! PNG, JPEG, TIFF, PNM and the other formats that hold a plain picture.
//!
//! Takes a path, gives a linear picture, or the numbers of a grey one. The size in the header is held against the
//! length of the file before the pixels are decoded. The decoding itself is the crate `image`'s.

use std::io::{BufReader, Seek};
use std::path::Path;

use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use resample_core::image::linear_from_srgb;

use super::{MAX_PIXELS, Picture, Plane, Stored, cannot_read, check_claim, fault, open};
use crate::Error;

pub(super) fn read_colour(path: &Path) -> Result<Picture, Error> {
    let image = decoded(path)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let is_float = matches!(image.color(), ColorType::Rgb32F | ColorType::Rgba32F);
    let is_wide =
        matches!(image.color(), ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16);
    let has_alpha = image.color().has_alpha();
    let mut coverage = Vec::with_capacity(if has_alpha { width * height } else { 0 });
    let mut rgb = Vec::with_capacity(width * height);
    let mut add = |[r, g, b, alpha]: [f32; 4]| {
        rgb.push([r, g, b]);
        if has_alpha {
            coverage.push(alpha);
        }
    };
    if is_float {
        image.into_rgba32f().pixels().for_each(|pixel| add(pixel.0));
    } else if is_wide {
        let table: Vec<f32> =
            (0..=u16::MAX).map(|code| linear_from_srgb(f32::from(code) / 65_535.0)).collect();
        let linear = |code: u16| table[usize::from(code)];
        let pixels = image.into_rgba16();
        pixels
            .pixels()
            .for_each(|p| add([linear(p[0]), linear(p[1]), linear(p[2]), f32::from(p[3]) / 65_535.0]));
    } else {
        let table: Vec<f32> = (0..=u8::MAX).map(|code| linear_from_srgb(f32::from(code) / 255.0)).collect();
        let linear = |code: u8| table[usize::from(code)];
        let pixels = image.into_rgba8();
        pixels
            .pixels()
            .for_each(|p| add([linear(p[0]), linear(p[1]), linear(p[2]), f32::from(p[3]) / 255.0]));
    }
    Ok(Picture { width, height, rgb, coverage: has_alpha.then_some(coverage) })
}

/// The stored numbers of a grey picture. Three equal channels count as grey: some tools know no other PNG.
pub(super) fn read_depth(path: &Path) -> Result<Plane, Error> {
    let image = decoded(path)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let (values, largest) = match &image {
        DynamicImage::ImageLuma8(grey) => (grey.iter().map(|&code| f32::from(code)).collect(), 255),
        DynamicImage::ImageLuma16(grey) => (grey.iter().map(|&code| f32::from(code)).collect(), 65_535),
        DynamicImage::ImageRgb8(rgb) if rgb.pixels().all(|p| p[0] == p[1] && p[1] == p[2]) => {
            (rgb.pixels().map(|p| f32::from(p[0])).collect(), 255)
        }
        DynamicImage::ImageRgba8(rgb) if rgb.pixels().all(|p| p[0] == p[1] && p[1] == p[2]) => {
            (rgb.pixels().map(|p| f32::from(p[0])).collect(), 255)
        }
        other => {
            let found = format!("{:?}", other.color());
            return Err(fault(
                path,
                format!("depth has one number per pixel, this is a picture of type {found}"),
            ));
        }
    };
    Ok(Plane { width, height, values, stored: Stored::Code(largest) })
}

/// Width and height, from the header alone.
pub(super) fn size(path: &Path) -> Result<[u32; 2], Error> {
    let decoder = checked_decoder(path)?;
    Ok(decoder.dimensions().into())
}

fn decoded(path: &Path) -> Result<DynamicImage, Error> {
    let decoder = checked_decoder(path)?;
    DynamicImage::from_decoder(decoder).map_err(|error| not_usable(path, &error))
}

fn not_usable(path: &Path, error: &image::ImageError) -> Error {
    fault(path, format!("not a usable picture: {error}"))
}

/// A decoder whose claims have been held against the length of the file.
fn checked_decoder(path: &Path) -> Result<impl ImageDecoder, Error> {
    let (file, length) = open(path)?;
    let mut file = BufReader::new(file);
    let guessed =
        ImageReader::new(&mut file).with_guessed_format().map_err(|source| cannot_read(path, &source))?;
    let Some(format) = guessed.format() else {
        return Err(fault(
            path,
            "no known picture format (formats are told by the content): expected PNG, JPEG, EXR, TIFF, PFM or .npy",
        ));
    };
    file.rewind().map_err(|source| cannot_read(path, &source))?;
    let mut reader = ImageReader::with_format(file, format);
    let mut limits = Limits::default();
    // Four channels of four bytes, the widest type, and as much again for the decoder's own buffers.
    limits.max_alloc = Some(MAX_PIXELS * 32);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|error| not_usable(path, &error))?;
    let (width, height) = decoder.dimensions();
    check_claim(width.into(), height.into(), length, most_pixels_per_byte(format))
        .map_err(|what| fault(path, what))?;
    Ok(decoder)
}

/// The largest number of pixels that one byte of a format can stand for.
fn most_pixels_per_byte(format: ImageFormat) -> u64 {
    match format {
        // Deflate unpacks a byte to at most 1032, each of up to eight pixels of one bit.
        ImageFormat::Png => 1032 * 8,
        // At least one bit for each block of 8 x 8 pixels.
        ImageFormat::Jpeg => 64 * 8,
        ImageFormat::Pnm | ImageFormat::Tga => 128 * 8,
        // As TIFF's LZW: 2559 bytes for one, each of up to eight pixels of one bit.
        _ => 2560 * 8,
    }
}
