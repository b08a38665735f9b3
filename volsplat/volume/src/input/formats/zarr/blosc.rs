//! Blosc, version 1: blocks that were shuffled and then compressed, each by itself.
//!
//! Takes the bytes of a container, gives the bytes that were packed. A header of 16 bytes says how long the blocks are, what
//! compressed them, and how they were shuffled: bytes by their place in the element, or bits. A block may be split into one
//! stream for each byte of an element. Source: the description of the chunk format in the C-Blosc repository.
//! Limits: LZ4, zlib and Zstandard inside; not BloscLZ and Snappy.

use std::io::Read;

use crate::input::fault::{Fault, unsupported};
use crate::input::formats::zarr::packed::{Size, lz4_block, zstd};

const HEADER_BYTES: usize = 16;

/// The facts of the header.
struct Header {
    flags: u8,
    element_bytes: usize,
    bytes: usize,
    block_bytes: usize,
}

/// Elements of more bytes than this are not split, and neither are blocks of fewer elements than the second number.
const MAX_SPLITS: usize = 16;
const MIN_SPLIT_ELEMENTS: usize = 128;

const BYTES_SHUFFLED: u8 = 1;
const NOT_PACKED: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const NOT_SPLIT: u8 = 16;

/// Unpacks a container, which must hold so many bytes.
pub(crate) fn unpack(packed: &[u8], size: Size) -> Result<Vec<u8>, Fault> {
    let header = header(packed)?;
    size.check(header.bytes)?;
    if header.flags & NOT_PACKED != 0 {
        let plain = packed.get(HEADER_BYTES..HEADER_BYTES + header.bytes);
        return Ok(plain.ok_or_else(ends_early)?.to_vec());
    }
    if header.bytes == 0 {
        return Ok(Vec::new());
    }
    let blocks = header.bytes.div_ceil(header.block_bytes);
    // Each block has an offset; a forged length stops here.
    let offsets = packed
        .get(HEADER_BYTES..)
        .filter(|rest| rest.len() / 4 >= blocks)
        .ok_or_else(ends_early)?;
    let mut bytes = Vec::new();
    for block in 0..blocks {
        let offset = word(offsets, 4 * block)?;
        let size = header
            .block_bytes
            .min(header.bytes - block * header.block_bytes);
        let unpacked = unpack_block(&header, packed.get(offset..).ok_or_else(ends_early)?, size)?;
        bytes.extend(unshuffled(&header, unpacked));
    }
    Ok(bytes)
}

fn header(packed: &[u8]) -> Result<Header, Fault> {
    let [version, _, flags, element_bytes, ..] = *packed else {
        return Err(ends_early().into());
    };
    if !(1..=2).contains(&version) {
        return Err(unsupported(format!(
            "unsupported Blosc format {version} (supported: 1 and 2, that is, C-Blosc 1.x)"
        )));
    }
    let header = Header {
        flags,
        element_bytes: usize::from(element_bytes),
        bytes: word(packed, 4)?,
        block_bytes: word(packed, 8)?,
    };
    if header.element_bytes == 0
        || (header.block_bytes == 0 && header.bytes > 0)
        || header.block_bytes > header.bytes
    {
        return Err(Fault::Invalid(
            "the Blosc header contradicts itself".to_owned(),
        ));
    }
    Ok(header)
}

fn unpack_block(header: &Header, mut stream: &[u8], size: usize) -> Result<Vec<u8>, Fault> {
    let whole = size == header.block_bytes;
    let splits = header.flags & NOT_SPLIT == 0
        && header.element_bytes <= MAX_SPLITS
        && size / header.element_bytes >= MIN_SPLIT_ELEMENTS
        && whole;
    let parts = if splits { header.element_bytes } else { 1 };
    let part_bytes = size / parts;
    let mut bytes = vec![0; size];
    for part in bytes.chunks_mut(part_bytes.max(1)) {
        let packed_bytes = word(stream, 0)?;
        let packed = stream.get(4..4 + packed_bytes).ok_or_else(ends_early)?;
        stream = &stream[4 + packed_bytes..];
        if packed.len() == part.len() {
            part.copy_from_slice(packed);
            continue;
        }
        match header.flags >> 5 {
            1 => lz4_block(packed, part)?,
            3 => {
                let read = flate2::read::ZlibDecoder::new(packed).read_exact(part);
                read.map_err(|error| format!("the chunk cannot be unpacked: {error}"))?;
            }
            4 => {
                let unpacked = zstd(packed, Size::Exactly(part.len()))?;
                let fits = unpacked.len() == part.len();
                fits.then(|| part.copy_from_slice(&unpacked))
                    .ok_or_else(ends_early)?;
            }
            other => {
                let name = ["BloscLZ", "", "Snappy"]
                    .get(usize::from(other))
                    .unwrap_or(&"an unknown method");
                return Err(unsupported(format!(
                    "Blosc with {name}: write the array with lz4, zlib or zstd inside"
                )));
            }
        }
    }
    Ok(bytes)
}

fn unshuffled(header: &Header, block: Vec<u8>) -> Vec<u8> {
    let element = header.element_bytes;
    if header.flags & BITS_SHUFFLED != 0 {
        return bits_unshuffled(&block, element);
    }
    if header.flags & BYTES_SHUFFLED == 0 || element == 1 {
        return block;
    }
    let count = block.len() / element;
    let mut bytes = Vec::with_capacity(block.len());
    for i in 0..count {
        bytes.extend((0..element).map(|byte| block[byte * count + i]));
    }
    // What does not fill an element was left alone.
    bytes.extend_from_slice(&block[count * element..]);
    bytes
}

/// Bits were sorted by their place in the element, for as many elements as make whole bytes.
fn bits_unshuffled(block: &[u8], element: usize) -> Vec<u8> {
    let count = block.len() / element / 8 * 8;
    let mut bytes = vec![0; block.len()];
    for i in 0..count {
        for bit in 0..8 * element {
            let stored = block[bit * (count / 8) + i / 8] >> (i % 8) & 1;
            bytes[i * element + bit / 8] |= stored << (bit % 8);
        }
    }
    bytes[count * element..].copy_from_slice(&block[count * element..]);
    bytes
}

/// A number of four bytes, the least first; those with the highest bit are negative and a forgery.
fn word(bytes: &[u8], at: usize) -> Result<usize, String> {
    let bytes = bytes
        .get(at..at + 4)
        .and_then(|bytes| bytes.first_chunk::<4>())
        .ok_or_else(ends_early)?;
    usize::try_from(i32::from_le_bytes(*bytes))
        .map_err(|_| "the Blosc container holds a negative length".to_owned())
}

fn ends_early() -> String {
    "the chunk ends early".to_owned()
}
