//! The pixels of an EXR file, block by block.
//!
//! Takes some channels, gives pieces of rows of them, side by side, on the display window. A block is some scan lines or
//! a tile, and only one is held at a time. Channels of different parts never share a block: those are held whole. The headers' claims,
//! and the sizes at the head of a block of DWAA and DWAB, are held against the length of the file and the size of the pixels first: the
//! decoder takes memory by them, and memory that is not there ends the process.

use std::io::{BufRead, BufReader, Seek};
use std::panic::catch_unwind;
use std::path::Path;

use ::exr::block;
use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::block::lines::LineRef;
use ::exr::block::reader::ChunksReader;
use ::exr::math::Vec2;
use ::exr::meta::MetaData;
use ::exr::meta::attribute::SampleType;
use ::exr::meta::header::Header;
use ::exr::prelude::{Compression, f16};
use resample_core::Error;

use crate::files::{MAX_PIXELS, fault, open};
use crate::receiver::Room;

/// Takes a piece of a row: column and row of its first pixel, and the numbers of each channel.
pub(crate) type Emit<'a> = dyn FnMut([usize; 2], &[Vec<f32>]) -> Result<(), Error> + 'a;

/// Width and height of the display window, px.
pub(crate) fn display_size(headers: &[Header]) -> [usize; 2] {
    headers.first().map_or([0; 2], |header| {
        let size = header.shared_attributes.display_window.size;
        [size.width(), size.height()]
    })
}

/// Gives the `wanted` channels to `emit`, in the order of the file's blocks.
pub(crate) fn pieces(
    path: &Path,
    wanted: &[At],
    room: Room,
    emit: &mut Emit<'_>,
) -> Result<(), Error> {
    let Some(&At { layer, .. }) = wanted.first() else {
        return Ok(());
    };
    if wanted.iter().all(|at| at.layer == layer) {
        return pieces_of_layer(path, wanted, room, emit);
    }
    // One after the other into memory, then row by row.
    let mut planes: Vec<Vec<f32>> = Vec::new();
    let mut size = [0; 2];
    for at in wanted {
        size = display_size(&headers(path)?);
        let bytes = (size[0] * size[1] * 4 * wanted.len()) as u64;
        room.check(
            path,
            bytes,
            "an EXR file whose colours lie in several parts",
        )?;
        let mut plane = vec![f32::NAN; size[0] * size[1]];
        pieces_of_layer(path, &[*at], room, &mut |[x, y], values| {
            let first = y * size[0] + x;
            plane[first..first + values[0].len()].copy_from_slice(&values[0]);
            Ok(())
        })?;
        planes.push(plane);
    }
    for y in 0..size[1] {
        let row = |plane: &Vec<f32>| plane[y * size[0]..(y + 1) * size[0]].to_vec();
        emit([0, y], &planes.iter().map(row).collect::<Vec<_>>())?;
    }
    Ok(())
}

fn pieces_of_layer(
    path: &Path,
    wanted: &[At],
    room: Room,
    emit: &mut Emit<'_>,
) -> Result<(), Error> {
    let wrong = |error: ::exr::error::Error| fault(path, format!("not a usable EXR file: {error}"));
    let layer = wanted[0].layer;
    let (file, _) = open(path)?;
    let reader = block::read(BufReader::new(file), false).map_err(wrong)?;
    let header = reader.headers().get(layer).cloned();
    let header = header.ok_or_else(|| fault(path, "the file has changed while it was read"))?;
    if header.deep {
        return Err(fault(
            path,
            "deep data is not read: flatten it to one sample a pixel",
        ));
    }
    if header
        .channels
        .list
        .iter()
        .any(|channel| channel.sampling != Vec2(1, 1))
    {
        return Err(fault(
            path,
            "sub-sampled channels are not read: save all channels at full resolution",
        ));
    }
    // A block packed and unpacked, and once more between two steps of unpacking.
    room.check(
        path,
        3 * header.max_block_byte_size() as u64,
        "a block of this EXR file",
    )?;
    let on_display = OnDisplay::new(&header, wanted);
    let largest = |level: Vec2<usize>| level == Vec2(0, 0);
    let chunks = reader
        .filter_chunks(false, |_, tile, block| {
            block.layer == layer && largest(tile.level_index)
        })
        .map_err(wrong)?;
    let meta = chunks.meta_data().clone();
    for chunk in chunks {
        let chunk = chunk.map_err(wrong)?;
        check(&chunk, &meta.headers).map_err(|what| fault(path, what))?;
        let block = UncompressedBlock::decompress_chunk(chunk, &meta, false).map_err(wrong)?;
        on_display.emit(path, &block, emit)?;
    }
    Ok(())
}

/// Where the data window lies on the display window, and which of its channels are wanted there.
struct OnDisplay<'a> {
    header: &'a Header,
    wanted: &'a [At],
    /// Place of the first pixel of the data on the display.
    shift: [i64; 2],
    size: [usize; 2],
}

impl<'a> OnDisplay<'a> {
    fn new(header: &'a Header, wanted: &'a [At]) -> Self {
        let (display, data) = (
            header.shared_attributes.display_window,
            header.own_attributes.layer_position,
        );
        let shift = |data: i32, display: i32| i64::from(data) - i64::from(display);
        Self {
            header,
            wanted,
            shift: [
                shift(data.x(), display.position.x()),
                shift(data.y(), display.position.y()),
            ],
            size: [display.size.width(), display.size.height()],
        }
    }

    /// Gives the rows of a block that lie on the display.
    fn emit(
        &self,
        path: &Path,
        block: &UncompressedBlock,
        emit: &mut Emit<'_>,
    ) -> Result<(), Error> {
        let (header, wanted) = (self.header, self.wanted);
        let mut values: Vec<Vec<f32>> = vec![Vec::new(); wanted.len()];
        let last = header.channels.list.len() - 1;
        for line in block.lines(&header.channels) {
            let location = line.location;
            let Some((at, columns)) = self.clipped(location.position, location.sample_count) else {
                continue;
            };
            for (value, _) in values
                .iter_mut()
                .zip(wanted)
                .filter(|(_, at)| at.channel == location.channel)
            {
                let sample_type = header.channels.list[location.channel].sample_type;
                *value = numbers(&line, sample_type)
                    .map_err(|error| fault(path, format!("not a usable EXR file: {error}")))?;
                value.truncate(columns.end);
                value.drain(..columns.start);
            }
            // The lines of all channels of a row follow one another.
            if location.channel == last {
                emit(at, &values)?;
            }
        }
        Ok(())
    }

    /// Where on the display a line begins, and which of its pixels lie there.
    fn clipped(
        &self,
        position: Vec2<usize>,
        count: usize,
    ) -> Option<([usize; 2], std::ops::Range<usize>)> {
        let left = position.x() as i64 + self.shift[0];
        let y = usize::try_from(position.y() as i64 + self.shift[1])
            .ok()
            .filter(|&y| y < self.size[1])?;
        let first = (-left).clamp(0, count as i64) as usize;
        let end = (self.size[0] as i64 - left).clamp(0, count as i64) as usize;
        (first < end).then(|| ([(left + first as i64) as usize, y], first..end))
    }
}

fn numbers(line: &LineRef<'_>, sample_type: SampleType) -> ::exr::error::Result<Vec<f32>> {
    match sample_type {
        SampleType::F16 => line
            .read_samples::<f16>()
            .map(|v| v.map(f16::to_f32))
            .collect(),
        SampleType::F32 => line.read_samples::<f32>().collect(),
        SampleType::U32 => line
            .read_samples::<u32>()
            .map(|v| v.map(|v| v as f32))
            .collect(),
    }
}

/// Largest display window that a file may ask for whatever its data window has, px: 4096 x 4096.
const FREE_DISPLAY_PIXELS: u64 = 1 << 24;

/// Beyond that, a display window may have this many times the pixels of the data. A guess, far above what cropped
/// renderings have.
const MOST_DISPLAY_PER_DATA: u64 = 64;

/// A channel and the layer it lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct At {
    pub(crate) layer: usize,
    pub(crate) channel: usize,
}

/// The headers of all parts, their claims held against the length of the file.
pub(crate) fn headers(path: &Path) -> Result<Vec<Header>, Error> {
    let (_, length) = open(path)?;
    let meta = catch_unwind(|| MetaData::read_from_file(path, false))
        .map_err(|_| fault(path, "not a usable EXR file: its header makes no sense"))?
        .map_err(|error| fault(path, format!("not a usable EXR file: {error}")))?;
    check_sizes(&meta.headers, length).map_err(|what| fault(path, what))?;
    Ok(meta.headers.into_vec())
}

/// Holds the claims of all parts against the length of the file.
fn check_sizes(headers: &[Header], file_bytes: u64) -> Result<(), String> {
    let (mut all_bytes, mut all_pixels) = (0u64, 0u64);
    for header in headers {
        let [width, height] = [
            header.layer_size.width() as u64,
            header.layer_size.height() as u64,
        ];
        let pixels = width.saturating_mul(height);
        let per_pixel = header.channels.bytes_per_pixel as u64;
        if pixels > MAX_PIXELS {
            return Err(format!(
                "{width}x{height} pixels, more than the {MAX_PIXELS} that are read"
            ));
        }
        // Deflate unpacks a byte to at most 1032, the other codecs to less; DWA packs runs of 128 before deflate.
        let expansion = match header.compression {
            Compression::Uncompressed => 1,
            Compression::DWAA(_) | Compression::DWAB(_) => 1032 * 128,
            _ => 1032,
        };
        let needed = pixels.saturating_mul(per_pixel);
        if needed > file_bytes.saturating_mul(expansion) {
            return Err(format!(
                "the header says {width}x{height} pixels, more than a file of {file_bytes} bytes can hold"
            ));
        }
        all_bytes = all_bytes.saturating_add(needed);
        all_pixels = all_pixels.max(pixels);
    }
    let most = MAX_PIXELS * 16;
    if all_bytes > most {
        return Err(format!(
            "its parts unpack to {all_bytes} bytes, more than the {most} that are read"
        ));
    }
    let window = headers
        .first()
        .map(|header| header.shared_attributes.display_window.size);
    let (width, height) = window.map_or((0, 0), |size| (size.width() as u64, size.height() as u64));
    let display = width.saturating_mul(height);
    let allowed = FREE_DISPLAY_PIXELS
        .max(all_pixels.saturating_mul(MOST_DISPLAY_PER_DATA))
        .min(MAX_PIXELS);
    if display == 0 || display > allowed {
        return Err(format!(
            "the display window has {width}x{height} pixels, which the data cannot fill"
        ));
    }
    Ok(())
}

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
