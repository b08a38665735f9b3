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

/// The attributes that are sizes or counts of unpacked data: other channels, run lengths packed and plain, and the
/// coefficients of the cosine transform (OpenEXR, `internal_dwa_compressor.h`).
const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];

/// Room for the heads of streams in blocks of a few pixels, bytes. A guess.
const SPARE_BYTES: u64 = 1 << 16;

/// Refuses a block that claims more than its pixels can need.
pub(crate) fn check(chunk: &Chunk, headers: &[Header]) -> Result<(), String> {
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
    // A block that would not become smaller is stored as it is, and begins with pixels.
    if packed.len() == plain_bytes(chunk, header) {
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

/// Bytes of a block's pixels; the largest number where it lies nowhere in the picture, which the decoder refuses.
fn plain_bytes(chunk: &Chunk, header: &Header) -> usize {
    let place = header.get_block_data_indices(&chunk.compressed_block);
    let place = place.and_then(|tile| header.get_absolute_block_pixel_coordinates(tile));
    place.map_or(usize::MAX, |place| {
        let pixels = place.size.area();
        pixels.saturating_mul(header.channels.bytes_per_pixel)
    })
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

    /// A picture of noise whose blocks are stored as they are, in a file that says `compression`.
    fn stored(size: (usize, usize), compression: u8) -> Vec<u8> {
        let mut state = 7u32;
        let noise = std::iter::repeat_with(|| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f16::from_bits((state >> 17) as u16)
        });
        let samples: Vec<f16> = noise.take(size.0 * size.1).collect();
        let channel = AnyChannel::new("Z", FlatSamples::F16(samples));
        let encoding = Encoding {
            blocks: Blocks::Tiles(Vec2(16, 16)),
            ..Encoding::UNCOMPRESSED
        };
        let channels = AnyChannels::sort([channel].into_iter().collect());
        let layer = Layer::new(size, LayerAttributes::default(), encoding, channels);
        let mut file = Cursor::new(Vec::new());
        let image = Image::from_layer(layer);
        image.write().to_buffered(&mut file).expect("memory");
        let mut bytes = file.into_inner();
        let name = b"compression\0compression\0";
        let at = bytes.windows(name.len()).position(|window| window == name);
        bytes[at.expect("an attribute") + name.len() + 4] = compression;
        bytes
    }

    #[test]
    fn blocks_that_are_stored_as_they_are_claim_nothing() {
        // DWAA and DWAB; tiles that the border cuts among them.
        for (size, compression) in [((64, 32), 8), ((37, 19), 8), ((40, 3), 9)] {
            let bytes = stored(size, compression);
            assert_eq!(check_all(Cursor::new(bytes.clone())), Ok(()), "{size:?}");
            let file = tempfile::NamedTempFile::new().expect("a file");
            std::fs::write(file.path(), bytes).expect("written");
            let part = crate::Part::from_text(&file.path().display().to_string());
            let plane = crate::depth::read(&part).expect("readable");
            assert_eq!((plane.width, plane.height), size);
        }
    }

    #[test]
    fn honest_blocks_pass_and_forged_ones_are_refused() {
        let checked = |claimed| check_all(Cursor::new(picture(claimed)));
        assert_eq!(checked(None), Ok(()), "as it was written");
        assert!(checked(Some(1 << 42)).is_err_and(|what| what.contains("claims")));
    }
}
