//! From the bytes of a chunk's file to its elements: compression undone, shards taken apart, axes put in order.
//!
//! Blosc, version 1, is read here. A header of 16 bytes says how long the blocks are, the compression,
//! and how they were shuffled: bytes by their place in the element, or bits. A block may be split into one
//! stream for each byte of an element. Source: the description of the chunk format in the C-Blosc repository.
//! Limits: LZ4, zlib and Zstandard inside; not BloscLZ and Snappy.

use std::io::Read;

use crate::input::decode::check_expansion;
use crate::input::file::{Fault, unsupported};
use crate::volume::{Endian, VoxelType};

/// How the elements of a chunk become bytes.
#[derive(Debug, Default)]
pub(crate) struct Codecs {
    pub(crate) endian: Endian,
    /// The axes as they are stored, the slowest first.
    pub(crate) order: Vec<usize>,
    /// The type of elements that are stored as differences from the one before.
    pub(crate) delta: Option<VoxelType>,
    /// Where a chunk is a shard: how it is cut.
    pub(crate) shard: Option<Box<Shard>>,
    /// Packings of the bytes, in order.
    pub(crate) packings: Vec<Packing>,
}

/// A chunk that is cut into chunks of its own.
#[derive(Debug)]
pub(crate) struct Shard {
    /// The shape of an inner chunk.
    pub(crate) chunk: Vec<usize>,
    pub(crate) codecs: Codecs,
    pub(crate) index_is_first: bool,
    pub(crate) index_packings: Vec<Packing>,
}

/// A compression, or a checksum behind the bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    Blosc,
    Zlib,
    Gzip,
    Zstd,
    Lz4,
    Bzip2,
    Crc32c,
    /// The first bytes of all elements of this size, then the second ones, and so on.
    Shuffle(usize),
}

/// The mark of an inner chunk that was never written.
const ABSENT: u64 = u64::MAX;

impl Codecs {
    /// The codecs that the elements themselves go through.
    pub(crate) fn innermost(&self) -> &Self {
        self.shard
            .as_ref()
            .map_or(self, |shard| shard.codecs.innermost())
    }
}

/// The bytes of `count` elements that were never written.
pub(crate) fn filled(fill: &[u8], count: usize) -> Result<Vec<u8>, String> {
    let bytes = count
        .checked_mul(fill.len())
        .ok_or_else(|| "more bytes than can be counted".to_owned())?;
    if fill.iter().all(|&byte| byte == 0) {
        // The system hands out zeros without touching them.
        return Ok(vec![0; bytes]);
    }
    Ok(fill.iter().copied().cycle().take(bytes).collect())
}

/// The elements of a chunk of this shape, in the usual order of its axes.
pub(crate) fn unpack(
    codecs: &Codecs,
    shape: &[usize],
    packed: &[u8],
    fill: &[u8],
) -> Result<Vec<u8>, Fault> {
    let too_large = || Fault::Invalid("the chunk is larger than can be counted".to_owned());
    let needed = len(shape)
        .and_then(|count| count.checked_mul(fill.len()))
        .ok_or_else(too_large)?;
    if let Some(shard) = &codecs.shard {
        return unshard(
            shard,
            shape,
            &undone(&codecs.packings, packed, shard.size(shape, needed))?,
            fill,
        );
    }
    let mut bytes = undone(&codecs.packings, packed, Size::Exactly(needed))?;
    if bytes.len() != needed {
        return Err(Fault::Invalid(format!(
            "the chunk has {} bytes, and its shape needs {needed}",
            bytes.len()
        )));
    }
    if let Some(of) = codecs.delta {
        sum_up(&mut bytes, of, codecs.endian);
    }
    if codecs.order.iter().copied().eq(0..shape.len()) {
        return Ok(bytes);
    }
    Ok(reordered(&bytes, shape, &codecs.order, fill.len()))
}

impl Shard {
    /// The size of a shard of this shape that holds so many bytes unpacked: each of its chunks packed, and the index.
    fn size(&self, shape: &[usize], needed: usize) -> Size {
        let chunks: usize = shape
            .iter()
            .zip(&self.chunk)
            .map(|(outer, inner)| outer / inner)
            .product();
        let most = Size::Exactly(needed).packed().most();
        // 16 bytes of the index, and the surplus, for each chunk; the checksum is part of the first surplus.
        Size::AtMost(most.saturating_add(chunks.saturating_mul(16 + SURPLUS_BYTES)))
    }
}

/// Undoes compression, the last one first; `size` is that of the bytes in the end.
fn undone(packings: &[Packing], packed: &[u8], size: Size) -> Result<Vec<u8>, Fault> {
    let mut bytes = packed.to_vec();
    for (place, packing) in packings.iter().enumerate().rev() {
        // Between two compressions the size is not known; each of them adds a bounded number of bytes.
        let needed = if place == 0 { size } else { size.packed() };
        bytes = match packing {
            Packing::Crc32c => {
                let end = bytes
                    .len()
                    .checked_sub(4)
                    .ok_or_else(|| "the chunk has no checksum".to_owned())?;
                bytes.truncate(end);
                bytes
            }
            Packing::Blosc => unpack_blosc(&bytes, needed)?,
            Packing::Lz4 => lz4(&bytes, needed)?,
            Packing::Zlib => {
                deflated(&bytes, needed)?;
                all_of(flate2::read::ZlibDecoder::new(bytes.as_slice()), needed)?
            }
            Packing::Gzip => {
                deflated(&bytes, needed)?;
                all_of(flate2::read::MultiGzDecoder::new(bytes.as_slice()), needed)?
            }
            Packing::Bzip2 => all_of(bzip2::read::MultiBzDecoder::new(bytes.as_slice()), needed)?,
            Packing::Zstd => zstd(&bytes, needed)?,
            Packing::Shuffle(size) => bytes_unshuffled(&bytes, *size),
        };
    }
    Ok(bytes)
}

/// From differences to elements: each is the sum of all up to it.
fn sum_up(bytes: &mut [u8], of: VoxelType, endian: Endian) {
    macro_rules! sums {
        ($kind:ty, $add:expr) => {{
            let mut sum = <$kind>::default();
            for element in bytes.chunks_exact_mut(size_of::<$kind>()) {
                let mut own = [0; size_of::<$kind>()];
                own.copy_from_slice(element);
                sum = match endian {
                    Endian::Little => $add(sum, <$kind>::from_le_bytes(own)),
                    Endian::Big => $add(sum, <$kind>::from_be_bytes(own)),
                };
                element.copy_from_slice(&match endian {
                    Endian::Little => sum.to_le_bytes(),
                    Endian::Big => sum.to_be_bytes(),
                });
            }
        }};
    }
    match of {
        VoxelType::U8 | VoxelType::I8 => sums!(u8, u8::wrapping_add),
        VoxelType::U16 | VoxelType::I16 => sums!(u16, u16::wrapping_add),
        VoxelType::U32 | VoxelType::I32 => sums!(u32, u32::wrapping_add),
        VoxelType::U64 | VoxelType::I64 => sums!(u64, u64::wrapping_add),
        VoxelType::F32 => sums!(f32, |sum: f32, own: f32| sum + own),
        VoxelType::F64 => sums!(f64, |sum: f64, own: f64| sum + own),
    }
}

/// The bytes of a chunk of another format that is packed in one of these ways, at most so many.
pub(crate) fn unpacked_chunk(
    packing: Packing,
    packed: &[u8],
    most_bytes: usize,
) -> Result<Vec<u8>, String> {
    undone(&[packing], packed, Size::AtMost(most_bytes)).map_err(|fault| match fault {
        Fault::Invalid(what) | Fault::Unsupported(what) | Fault::Option(what) => what,
    })
}

fn deflated(packed: &[u8], size: Size) -> Result<(), String> {
    match size {
        Size::Exactly(needed) => check_expansion(needed as u64, packed.len() as u64),
        Size::AtMost(_) => Ok(()),
    }
}

/// Unpacks what numcodecs calls LZ4: the size of the data in four bytes, then a block.
fn lz4(packed: &[u8], needed: Size) -> Result<Vec<u8>, String> {
    let (size, block) = packed
        .split_first_chunk::<4>()
        .ok_or_else(|| "the chunk ends early".to_owned())?;
    let size = u32::from_le_bytes(*size) as usize;
    needed.check(size)?;
    let mut bytes = vec![0; size];
    lz4_block(block, &mut bytes)?;
    Ok(bytes)
}

fn unshard(shard: &Shard, shape: &[usize], bytes: &[u8], fill: &[u8]) -> Result<Vec<u8>, Fault> {
    let cut: Vec<usize> = shape
        .iter()
        .zip(&shard.chunk)
        .map(|(outer, inner)| outer / inner)
        .collect();
    let count: usize = cut.iter().product();
    let index = index_of(shard, bytes, count)?;
    let mut whole = filled(fill, shape.iter().product())?;
    let zeros = vec![0; shape.len()];
    for (number, entry) in index.chunks_exact(16).take(count).enumerate() {
        let (offset, size) = entry.split_at(8);
        let word = |bytes: &[u8]| {
            bytes
                .iter()
                .rev()
                .fold(0u64, |word, &byte| word << 8 | u64::from(byte))
        };
        let (offset, size) = (word(offset), word(size));
        if offset == ABSENT && size == ABSENT {
            continue;
        }
        let end = offset
            .checked_add(size)
            .and_then(|end| usize::try_from(end).ok());
        let part = end.and_then(|end| bytes.get(offset as usize..end));
        let part = part.ok_or_else(|| format!("chunk {number} of the shard lies outside of it"))?;
        let inner = unpack(&shard.codecs, &shard.chunk, part, fill)?;
        let mut rest = number;
        let mut to = vec![0; cut.len()];
        for axis in (0..cut.len()).rev() {
            to[axis] = rest % cut[axis] * shard.chunk[axis];
            rest /= cut[axis];
        }
        copy_box(
            &PlaceIn {
                bytes: inner.as_slice(),
                shape: &shard.chunk,
                at: &zeros,
            },
            &mut PlaceIn {
                bytes: whole.as_mut_slice(),
                shape,
                at: &to,
            },
            &shard.chunk,
            fill.len(),
        );
    }
    Ok(whole)
}

/// The index of a shard: offset and size of each inner chunk, eight bytes each.
fn index_of(shard: &Shard, bytes: &[u8], count: usize) -> Result<Vec<u8>, Fault> {
    let checksums = shard
        .index_packings
        .iter()
        .filter(|&&packing| packing == Packing::Crc32c)
        .count();
    if checksums != shard.index_packings.len() {
        return Err(Fault::Unsupported(
            "a shard whose index is compressed".to_owned(),
        ));
    }
    let size = count
        .checked_mul(16)
        .and_then(|size| size.checked_add(4 * checksums));
    let start = size.and_then(|size| bytes.len().checked_sub(size));
    let (Some(size), Some(start)) = (size, start) else {
        return Err(Fault::Invalid(
            "the shard ends before its index does".to_owned(),
        ));
    };
    let index = if shard.index_is_first {
        &bytes[..size]
    } else {
        &bytes[start..]
    };
    undone(&shard.index_packings, index, Size::AtMost(index.len()))
}

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
fn unpack_blosc(packed: &[u8], size: Size) -> Result<Vec<u8>, Fault> {
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
    bytes_unshuffled(&block, element)
}

/// Puts the bytes of each element together again.
fn bytes_unshuffled(block: &[u8], element: usize) -> Vec<u8> {
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

/// How many bytes something must have when it is unpacked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Size {
    Exactly(usize),
    /// Where that depends on how well something inside was packed.
    AtMost(usize),
}

/// Most that a compression adds to what it cannot make smaller: an eighth, and room for headers. The formats that are read
/// here stay far below.
pub(crate) const SURPLUS_BYTES: usize = 1024;

impl Size {
    /// The most bytes.
    pub(crate) fn most(self) -> usize {
        match self {
            Self::Exactly(size) | Self::AtMost(size) => size,
        }
    }

    /// The size of these bytes while they are packed once more.
    pub(crate) fn packed(self) -> Self {
        let most = self.most();
        Self::AtMost(most.saturating_add(most / 8).saturating_add(SURPLUS_BYTES))
    }

    /// Refuses a size in a header that cannot be right.
    pub(crate) fn check(self, stated: usize) -> Result<(), String> {
        match self {
            Self::Exactly(needed) if stated != needed => Err(format!(
                "the chunk says that it has {stated} bytes, which its shape does not need"
            )),
            Self::AtMost(most) if stated > most => Err(format!(
                "the chunk says that it has {stated} bytes, and its shape needs at most {most}"
            )),
            _ => Ok(()),
        }
    }
}

/// Reads a stream to its end, but no further than one byte beyond what is needed: a surplus is an error later.
pub(crate) fn all_of(stream: impl Read, size: Size) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let read = stream
        .take((size.most() as u64).saturating_add(1))
        .read_to_end(&mut bytes);
    read.map_err(|error| format!("the chunk cannot be unpacked: {error}"))?;
    match size {
        Size::AtMost(most) if bytes.len() > most => Err(format!(
            "the chunk unpacks to more than the {most} bytes that its shape needs at most"
        )),
        _ => Ok(bytes),
    }
}

/// Unpacks Zstandard.
pub(crate) fn zstd(packed: &[u8], needed: Size) -> Result<Vec<u8>, String> {
    let stream = ruzstd::decoding::StreamingDecoder::new(packed);
    all_of(
        stream.map_err(|error| format!("the chunk cannot be unpacked: {error}"))?,
        needed,
    )
}

/// Unpacks an LZ4 block, which must fill `bytes`.
pub(crate) fn lz4_block(block: &[u8], bytes: &mut [u8]) -> Result<(), String> {
    match lz4_flex::block::decompress_into(block, bytes) {
        Ok(count) if count == bytes.len() => Ok(()),
        Ok(count) => Err(format!(
            "a block has {count} bytes where {} belong",
            bytes.len()
        )),
        Err(error) => Err(format!("the chunk cannot be unpacked: {error}")),
    }
}

/// A part of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) first: usize,
    pub(crate) size: usize,
}

/// Number of elements of an array; `None` where it overflows.
pub(crate) fn len(shape: &[usize]) -> Option<usize> {
    shape
        .iter()
        .try_fold(1usize, |count, &size| count.checked_mul(size))
}

/// An array, as its bytes and its shape, and a place in it.
pub(crate) struct PlaceIn<'a, B> {
    pub(crate) bytes: B,
    pub(crate) shape: &'a [usize],
    pub(crate) at: &'a [usize],
}

/// Copies a box of `size` elements from a place in one array to a place in another. The box lies in both.
pub(crate) fn copy_box(
    from: &PlaceIn<&[u8]>,
    to: &mut PlaceIn<&mut [u8]>,
    size: &[usize],
    element_bytes: usize,
) {
    let Some((&row, outer)) = size.split_last() else {
        return;
    };
    let rows: usize = outer.iter().product();
    let row_bytes = row * element_bytes;
    let mut at = vec![0; size.len()];
    for number in 0..rows {
        let mut rest = number;
        for axis in (0..outer.len()).rev() {
            at[axis] = rest % outer[axis];
            rest /= outer[axis];
        }
        let source_at = element_bytes * place(from.shape, from.at, &at);
        let target_at = element_bytes * place(to.shape, to.at, &at);
        to.bytes[target_at..target_at + row_bytes]
            .copy_from_slice(&from.bytes[source_at..source_at + row_bytes]);
    }
}

/// Puts the elements of an array, stored with its axes in this order (the slowest first), into the usual order.
pub(crate) fn reordered(
    stored: &[u8],
    shape: &[usize],
    order: &[usize],
    element_bytes: usize,
) -> Vec<u8> {
    let mut strides = vec![0; shape.len()];
    let mut stride = element_bytes;
    for &axis in order.iter().rev() {
        strides[axis] = stride;
        stride *= shape[axis];
    }
    let mut bytes = Vec::with_capacity(stored.len());
    let mut at = vec![0; shape.len()];
    for _ in 0..stored.len() / element_bytes {
        let place: usize = at.iter().zip(&strides).map(|(i, stride)| i * stride).sum();
        bytes.extend_from_slice(&stored[place..place + element_bytes]);
        for axis in (0..shape.len()).rev() {
            at[axis] += 1;
            if at[axis] < shape[axis] {
                break;
            }
            at[axis] = 0;
        }
    }
    bytes
}

fn place(shape: &[usize], first: &[usize], at: &[usize]) -> usize {
    shape
        .iter()
        .zip(first)
        .zip(at)
        .fold(0, |place, ((size, first), at)| place * size + first + at)
}
