//! TIFF as depth: one grey picture, whole numbers or floating point.
//!
//! Takes a path, gives its numbers. The directory is read first, and the size that it claims is held against the
//! length of the file before anything is allocated. Limits: the first page; one number per pixel.

use std::io::BufReader;
use std::path::Path;

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::{ColorType, TiffError};

use super::{Plane, Stored, check_claim, fault, open};
use crate::Error;

/// Most pixels for one byte of any packing here: a code of LZW has at most 12 bits and stands for at most 3838 bytes,
/// which is 2559 bytes for one; a byte holds at most eight pixels.
const MOST_PIXELS_PER_BYTE: u64 = 2560 * 8;

pub(super) fn read(path: &Path) -> Result<Plane, Error> {
    let (file, length) = open(path)?;
    let wrong = |error: TiffError| fault(path, format!("not a usable TIFF file: {error}"));
    let mut decoder = Decoder::new(BufReader::new(file)).map_err(wrong)?;
    let (width, height) = decoder.dimensions().map_err(wrong)?;
    check_claim(width.into(), height.into(), length, MOST_PIXELS_PER_BYTE)
        .map_err(|what| fault(path, what))?;
    let colour_type = decoder.colortype().map_err(wrong)?;
    if !matches!(colour_type, ColorType::Gray(_)) {
        let found = format!("{colour_type:?}");
        return Err(fault(
            path,
            format!("depth has one number per pixel, this is a picture of type {found}"),
        ));
    }
    let (width, height) = (width as usize, height as usize);
    let mut limits = Limits::unlimited();
    // Eight bytes for each pixel, the widest type; the claim is checked.
    limits.decoding_buffer_size = width * height * 8;
    limits.intermediate_buffer_size = width * height * 8 + (1 << 20);
    let mut decoder = decoder.with_limits(limits);
    let (values, stored) = numbers(decoder.read_image().map_err(wrong)?);
    if values.len() != width * height {
        let held = values.len();
        return Err(fault(path, format!("{width}x{height} pixels were promised, {held} numbers were found")));
    }
    Ok(Plane { width, height, values, stored })
}

fn numbers(decoded: DecodingResult) -> (Vec<f32>, Stored) {
    use Stored::{Code, Float};
    match decoded {
        DecodingResult::U8(values) => (values.into_iter().map(f32::from).collect(), Code(255)),
        DecodingResult::U16(values) => (values.into_iter().map(f32::from).collect(), Code(65_535)),
        DecodingResult::U32(values) => {
            (values.into_iter().map(|value| value as f32).collect(), Code(u32::MAX))
        }
        DecodingResult::U64(values) => {
            (values.into_iter().map(|value| value as f32).collect(), Code(u32::MAX))
        }
        DecodingResult::I8(values) => (values.into_iter().map(f32::from).collect(), Code(127)),
        DecodingResult::I16(values) => (values.into_iter().map(f32::from).collect(), Code(32_767)),
        DecodingResult::I32(values) => {
            (values.into_iter().map(|value| value as f32).collect(), Code(i32::MAX as u32))
        }
        DecodingResult::I64(values) => {
            (values.into_iter().map(|value| value as f32).collect(), Code(i32::MAX as u32))
        }
        DecodingResult::F16(values) => (values.into_iter().map(f32::from).collect(), Float),
        DecodingResult::F32(values) => (values, Float),
        DecodingResult::F64(values) => (values.into_iter().map(|value| value as f32).collect(), Float),
    }
}
