//! PNG, row by row.
//!
//! Takes a path whose header has been checked, gives its rows as `raster.rs` has them: palettes and fewer than eight bits
//! expanded, transparency of single colours as alpha. Limits: an interlaced file is left to the decoder of whole
//! pictures.

use std::io::BufReader;
use std::path::Path;

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Transformations};

use crate::files::{fault, first_bytes, open};
use crate::rows::{Row, Rows};
use resample_core::Error;

/// Returns true if the file is interlaced: the last byte of its header, which begins at byte 16 and has 13.
pub(crate) fn is_interlaced(path: &Path) -> Result<bool, Error> {
    Ok(first_bytes(path, 29)?
        .get(28)
        .is_some_and(|&byte| byte != 0))
}

/// Gives the rows from the top; false, without a row, if the file is interlaced.
pub(crate) fn decode(path: &Path, rows: &mut dyn Rows) -> Result<bool, Error> {
    let wrong = |error: DecodingError| fault(path, format!("not a usable picture: {error}"));
    let (file, _) = open(path)?;
    // The crate's own limit, 64 MiB, holds what it unpacks beside the pixels.
    let mut decoder = Decoder::new(BufReader::new(file));
    decoder.set_transformations(Transformations::EXPAND);
    // Neither is used, and a small one may unpack to gigabytes.
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(wrong)?;
    if reader.info().interlaced {
        return Ok(false);
    }
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let (colour, depth) = reader.output_color_type();
    let channels = match colour {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => {
            return Err(fault(
                path,
                "not a usable picture: a palette that was not expanded",
            ));
        }
    };
    rows.begin([width, height], channels)?;
    let mut words = Vec::new();
    for y in 0..height {
        let row = reader.next_row().map_err(wrong)?;
        let row = row.ok_or_else(|| {
            fault(
                path,
                format!("not a usable picture: row {y} of {height} is missing"),
            )
        })?;
        if depth == BitDepth::Sixteen {
            words.clear();
            words.extend(
                row.data()
                    .chunks_exact(2)
                    .map(|two| u16::from_be_bytes([two[0], two[1]])),
            );
            rows.row(y, &Row::Words(&words))?;
        } else {
            rows.row(y, &Row::Bytes(row.data()))?;
        }
    }
    Ok(true)
}
