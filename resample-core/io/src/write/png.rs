//! PNG: sRGB with straight alpha, 8 or 16 bits.
//!
//! Takes a picture in linear light with premultiplied alpha, divides the colour by alpha, applies the sRGB curve
//! and rounds. There is no dithering: the same picture always gives the same file. Depth and extra planes do not
//! fit into the format and are left out.

use std::fs::File;
use std::io::{self, BufReader, Write};
use std::path::Path;

use png::{BitDepth, ColorType, Compression, Decoder, Encoder, SrgbRenderingIntent};
use rayon::prelude::*;
use resample_core::Image;
use resample_core::image::{srgb_from_linear, srgb8_from_linear};
use serde::{Deserialize, Serialize};

/// Bits per channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Depth {
    /// 8 bits.
    Eight,
    /// 16 bits.
    Sixteen,
}

/// The keyword of the text chunk that holds a mark.
const MARK: &str = "resample";

/// The mark in a PNG; none in a file that has none or cannot be read.
pub fn mark(path: &Path) -> Option<String> {
    let file = BufReader::new(File::open(path).ok()?);
    let reader = Decoder::new(file).read_info().ok()?;
    let mut texts = reader.info().uncompressed_latin1_text.iter();
    let text = texts.find(|text| text.keyword == MARK)?;
    Some(text.text.clone())
}

/// Writes `image` to `file`, and a mark if there is one.
pub fn write(file: impl Write, image: &Image, depth: Depth, mark: Option<&str>) -> io::Result<()> {
    let size = side_lengths([image.width, image.height])?;
    let mut encoder = encoder(file, size, depth);
    if let Some(mark) = mark {
        encoder.add_text_chunk(MARK.to_owned(), mark.to_owned())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes(image, depth))?;
    Ok(writer.finish()?)
}

/// Writes a plane of numbers from 0 to 1 as 8-bit grey codes.
pub fn write_grey(file: impl Write, size: [usize; 2], values: &[f32]) -> io::Result<()> {
    let [width, height] = side_lengths(size)?;
    let mut encoder = Encoder::new(file, width, height);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    // A cast to an integer saturates, and NaN becomes 0.
    let codes: Vec<u8> = values
        .iter()
        .map(|value| (value * 255.0).round() as u8)
        .collect();
    writer.write_image_data(&codes)?;
    Ok(writer.finish()?)
}

fn side_lengths([width, height]: [usize; 2]) -> io::Result<[u32; 2]> {
    let side = |length| u32::try_from(length).map_err(io::Error::other);
    Ok([side(width)?, side(height)?])
}

/// An encoder for pictures of `size` pixels, width and height.
pub fn encoder<W: Write>(file: W, size: [u32; 2], depth: Depth) -> Encoder<'static, W> {
    let mut encoder = Encoder::new(file, size[0], size[1]);
    encoder.set_color(ColorType::Rgba);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    // The stronger levels take forty times as long for a third of the size.
    encoder.set_compression(Compression::Fast);
    encoder.set_depth(match depth {
        Depth::Eight => BitDepth::Eight,
        Depth::Sixteen => BitDepth::Sixteen,
    });
    encoder
}

/// The pixels of a picture as a PNG has them: red, green, blue and alpha, sixteen bits with the high byte first.
pub fn bytes(image: &Image, depth: Depth) -> Vec<u8> {
    match depth {
        Depth::Eight => laid_out(image, eight_bits),
        Depth::Sixteen => laid_out(image, sixteen_bits),
    }
}

/// Red, green and blue of an opaque picture in sRGB; sixteen bits with the low byte first.
pub fn opaque_bytes(image: &Image, depth: Depth) -> Vec<u8> {
    match depth {
        Depth::Eight => laid_out(image, |pixel| {
            let [r, g, b, _] = eight_bits(pixel);
            [r, g, b]
        }),
        Depth::Sixteen => laid_out(image, |pixel| {
            let [r1, r0, g1, g0, b1, b0, ..] = sixteen_bits(pixel);
            [r0, r1, g0, g1, b0, b1]
        }),
    }
}

/// The bytes of all pixels, `N` of each.
fn laid_out<const N: usize>(image: &Image, of: impl Fn([f32; 4]) -> [u8; N] + Sync) -> Vec<u8> {
    let mut bytes = vec![0; N * image.rgba.len()];
    let pixels = bytes.as_chunks_mut::<N>().0;
    let rows = image.width.max(1);
    let pairs = pixels.par_chunks_mut(rows).zip(image.rgba.par_chunks(rows));
    pairs.for_each(|(bytes, pixels)| {
        for (bytes, &pixel) in bytes.iter_mut().zip(pixels) {
            *bytes = of(pixel);
        }
    });
    bytes
}

fn eight_bits([r, g, b, alpha]: [f32; 4]) -> [u8; 4] {
    let (scale, alpha) = straight(alpha);
    let [r, g, b] = [r, g, b].map(|channel| srgb8_from_linear(channel * scale));
    // A cast to an integer saturates.
    [r, g, b, (alpha * 255.0).round() as u8]
}

fn sixteen_bits([r, g, b, alpha]: [f32; 4]) -> [u8; 8] {
    let (scale, alpha) = straight(alpha);
    let encode = |channel: f32| srgb_from_linear(channel * scale);
    let words = [encode(r), encode(g), encode(b), alpha];
    let [r, g, b, a] = words.map(|encoded| ((encoded * 65535.0).round() as u16).to_be_bytes());
    [r[0], r[1], g[0], g[1], b[0], b[1], a[0], a[1]]
}

/// The factor from premultiplied to straight colour, and alpha in 0..=1.
fn straight(alpha: f32) -> (f32, f32) {
    // Where alpha is 0 (or NaN) there is no colour to recover.
    match alpha > 0.0 {
        true => (1.0 / alpha, alpha.min(1.0)),
        false => (0.0, 0.0),
    }
}
