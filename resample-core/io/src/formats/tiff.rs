//! TIFF: the mark of a file and the most that a file of some length can unpack to, for all readers; and depth that is stored as TIFF.

use std::io::BufReader;
use std::path::Path;

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};
use resample_core::Error;

use crate::files::{check_claim, fault, open};
use crate::picture::Stored;
use crate::receiver::{Receiver, Room};

/// Returns true if a file that begins with `head` is a TIFF or BigTIFF file.
///
/// ```
/// assert!(resample_io::tiff::begins(b"II*\0"));
/// assert!(!resample_io::tiff::begins(b"RIFF"));
/// ```
pub fn begins(head: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"]
        .iter()
        .any(|mark| head.starts_with(*mark))
}

/// The most bytes that one byte of any packing here expands to: a code of LZW has at most 12 bits and stands for at most
/// 3838 bytes, which is 2559 times as many; deflate and PackBits stay below. JPEG needs at least 2 bits for 64 pixels.
pub const GREATEST_EXPANSION: u64 = 2560;

/// Most pixels for one byte of any packing here: a byte holds at most eight pixels.
const MOST_PIXELS_PER_BYTE: u64 = GREATEST_EXPANSION * 8;

pub(crate) fn decode(path: &Path, room: Room, to: &mut dyn Receiver) -> Result<Stored, Error> {
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
    // Strips and tiles are decoded one at a time, in at most eight bytes a pixel, the widest type.
    for tag in [Tag::TileWidth, Tag::TileLength] {
        // Beyond 32 bits the decoder has no answer for it.
        decoder.find_tag_unsigned::<u32>(tag).map_err(wrong)?;
    }
    let chunk = decoder.chunk_dimensions();
    if chunk.0 == 0 || chunk.1 == 0 {
        return Err(fault(
            path,
            "not a usable TIFF file: its strips or tiles are empty",
        ));
    }
    let chunk_bytes = u64::from(chunk.0.min(width)) * u64::from(chunk.1.min(height)) * 8;
    room.check(path, 2 * chunk_bytes, "a strip or tile of this TIFF file")?;
    let mut limits = Limits::unlimited();
    limits.decoding_buffer_size = chunk_bytes as usize;
    limits.intermediate_buffer_size = chunk_bytes as usize + (1 << 20);
    let mut decoder = decoder.with_limits(limits);
    to.begin([width as usize, height as usize])?;
    let mut kind = Stored::Float;
    let across = width.div_ceil(chunk.0);
    let count = across.saturating_mul(height.div_ceil(chunk.1));
    for index in 0..count {
        let (columns, rows) = decoder.chunk_data_dimensions(index);
        let (values, stored) = numbers(decoder.read_chunk(index).map_err(wrong)?);
        kind = stored;
        if values.len() != columns as usize * rows as usize {
            let held = values.len();
            return Err(fault(
                path,
                format!("{columns}x{rows} pixels were promised, {held} numbers were found"),
            ));
        }
        let (left, top) = (
            (index % across * chunk.0) as usize,
            (index / across * chunk.1) as usize,
        );
        for (row, values) in values.chunks_exact(columns.max(1) as usize).enumerate() {
            to.put([left, top + row], values)?;
        }
    }
    Ok(kind)
}

fn numbers(decoded: DecodingResult) -> (Vec<f32>, Stored) {
    use Stored::{Code, Float};
    match decoded {
        DecodingResult::U8(values) => (values.into_iter().map(f32::from).collect(), Code(255)),
        DecodingResult::U16(values) => (values.into_iter().map(f32::from).collect(), Code(65_535)),
        DecodingResult::U32(values) => (
            values.into_iter().map(|value| value as f32).collect(),
            Code(u32::MAX),
        ),
        DecodingResult::U64(values) => (
            values.into_iter().map(|value| value as f32).collect(),
            Code(u32::MAX),
        ),
        DecodingResult::I8(values) => (values.into_iter().map(f32::from).collect(), Code(127)),
        DecodingResult::I16(values) => (values.into_iter().map(f32::from).collect(), Code(32_767)),
        DecodingResult::I32(values) => (
            values.into_iter().map(|value| value as f32).collect(),
            Code(i32::MAX as u32),
        ),
        DecodingResult::I64(values) => (
            values.into_iter().map(|value| value as f32).collect(),
            Code(i32::MAX as u32),
        ),
        DecodingResult::F16(values) => (values.into_iter().map(f32::from).collect(), Float),
        DecodingResult::F32(values) => (values, Float),
        DecodingResult::F64(values) => (
            values.into_iter().map(|value| value as f32).collect(),
            Float,
        ),
    }
}
