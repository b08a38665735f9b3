//! Checks the sizes at the head of a block of the compressions DWAA and DWAB against the size of its pixels.
//!
//! The decoder takes memory by these claims before it looks at the data, and memory that is not there ends the process.

use std::io::{BufRead, Seek};

use ::exr::block;
use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::meta::header::Header;
use ::exr::prelude::Compression;

/// Numbers at the head of a block, 8 bytes each.
const NUMBERS: usize = 11;

/// Which of them are sizes or counts of what is unpacked: other channels, run lengths packed and plain, and the
/// coefficients of the cosine transform (OpenEXR, `internal_dwa_compressor.h`).
const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];

/// Room for the heads of streams in blocks of a few pixels, bytes. A guess.
const SPARE_BYTES: u64 = 1 << 16;

/// Refuses a block that claims more than its pixels can need.
pub(super) fn check(chunk: &Chunk, headers: &[Header]) -> Result<(), String> {
    let Some(header) = headers.get(chunk.layer_index) else {
        return Err("a block of a part that is not there".to_owned());
    };
    let packed = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        CompressedBlock::DeepScanLine(_) | CompressedBlock::DeepTile(_) => return Ok(()),
    };
    if !matches!(
        header.compression,
        Compression::DWAA(_) | Compression::DWAB(_)
    ) {
        return Ok(());
    }
    // The transform works on squares of 8x8, which a row or a column of pixels fills to an eighth; run lengths of data
    // without runs take twice its size.
    let most = (header.max_block_byte_size() as u64).saturating_mul(16) + SPARE_BYTES;
    let numbers = packed.as_chunks::<8>().0.iter().take(NUMBERS);
    let numbers: Vec<u64> = numbers.map(|bytes| u64::from_le_bytes(*bytes)).collect();
    let claimed = UNPACKED
        .iter()
        .filter_map(|&place| numbers.get(place))
        .max();
    match claimed {
        Some(&claimed) if claimed > most => Err(format!(
            "a block claims {claimed} bytes or numbers where its pixels need at most {most}"
        )),
        _ => Ok(()),
    }
}

/// Checks all blocks of a file, for decoders that cannot be asked in between.
pub fn check_all(file: impl BufRead + Seek) -> Result<(), String> {
    let broken = |error: ::exr::error::Error| format!("not a usable EXR file: {error}");
    let reader = block::read(file, false).map_err(broken)?;
    let headers = reader.headers().to_vec();
    let is_packed = |header: &Header| {
        matches!(
            header.compression,
            Compression::DWAA(_) | Compression::DWAB(_)
        )
    };
    if !headers.iter().any(is_packed) {
        return Ok(());
    }
    for chunk in reader.all_chunks(false).map_err(broken)? {
        check(&chunk.map_err(broken)?, &headers)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use ::exr::prelude::*;

    use super::*;

    /// A picture whose first block claims a number of coefficients.
    fn picture(claimed: Option<u64>) -> Vec<u8> {
        let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
            let ramp = f16::from_f32(at.x() as f32 / 21.0);
            (ramp, ramp, ramp)
        });
        let encoding = Encoding {
            compression: Compression::DWAA(None),
            ..Encoding::SMALL_LOSSLESS
        };
        let layer = Layer::new((21, 18), LayerAttributes::default(), encoding, channels);
        let mut file = Cursor::new(Vec::new());
        let image = Image::from_layer(layer);
        image.write().to_buffered(&mut file).expect("memory");
        let mut bytes = file.into_inner();
        if let Some(claimed) = claimed {
            // The version, a small number that nothing else in these bytes looks like, begins the block.
            let tail = [0u64, 0].map(u64::to_le_bytes).concat();
            let version = [2u64.to_le_bytes().to_vec(), tail].concat();
            let block = bytes.windows(24).position(|window| window == version);
            let at = block.expect("a block of DWAA without other channels") + 8 * 9;
            bytes[at..at + 8].copy_from_slice(&claimed.to_le_bytes());
        }
        bytes
    }

    #[test]
    fn honest_blocks_pass_and_forged_ones_are_refused() {
        let checked = |claimed| check_all(Cursor::new(picture(claimed)));
        assert_eq!(checked(None), Ok(()), "as it was written");
        assert!(checked(Some(1 << 42)).is_err_and(|what| what.contains("claims")));
    }
}
