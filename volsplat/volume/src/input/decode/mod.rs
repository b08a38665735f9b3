//! From a stream of bytes or words to typed voxels: the one decoder that all formats share.
//!
//! Takes a reader that is already past every header and compression, and a [`Layout`] (how many scalars, of which type
//! and byte order). It reads in pieces and grows the result as the data arrives, so a forged count costs no more
//! memory than the stream can fill. The rest of the stream is counted, so that a surplus is an error. The axes of a lattice are checked
//! here too, for all formats.

pub(crate) mod component;
pub(crate) mod stored;
pub(crate) mod rescale;
pub(crate) mod zip;

use std::io::{BufRead, Read};
use std::mem::size_of;

use glam::{DAffine3, DMat3, DVec3};
use resample_io::Gate;

use crate::volume::{Endian, VoxelType, Voxels};

/// How the scalars lie in the stream.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub(crate) voxel_type: VoxelType,
    pub(crate) endian: Endian,
    /// Number of scalars.
    pub(crate) count: usize,
}

/// Bytes per piece: large enough that the call per piece does not count, small enough for the cache. A guess.
const PIECE_BYTES: usize = 1 << 16;

/// A surplus is counted up to here and then called "more than"; a compressed bomb must not keep us busy. A guess.
const SURPLUS_LIMIT: u64 = 1 << 26;

/// Longest word of a text encoding. The longest sensible one, a double in full, has 24 characters; others are a forgery.
const MAX_WORD_BYTES: usize = 400;

/// Deflate expands at most 1032 times: its shortest code, one bit for length and one for distance, gives 258 bytes.
pub(crate) const DEFLATE_EXPANSION: u64 = 1032;

impl Layout {
    /// Bytes that the scalars take in a binary encoding; an error where that overflows.
    pub(crate) fn bytes(&self) -> Result<u64, String> {
        let bytes = self
            .count
            .checked_mul(self.voxel_type.bytes())
            .and_then(|bytes| u64::try_from(bytes).ok());
        bytes.ok_or_else(|| {
            format!(
                "{} voxels of {} are more than can be addressed",
                self.count,
                self.voxel_type.name()
            )
        })
    }
}

/// Reads `layout.count` binary scalars and checks that the stream ends there. Errors say what was expected and found.
pub(crate) fn binary(stream: &mut dyn Read, layout: &Layout) -> Result<Voxels, String> {
    let voxels = match layout.voxel_type {
        VoxelType::U8 => Voxels::U8(scalars(stream, layout, u8::from_le_bytes)?),
        VoxelType::I8 => Voxels::I8(scalars(stream, layout, i8::from_le_bytes)?),
        VoxelType::U16 => Voxels::U16(scalars(stream, layout, u16::from_le_bytes)?),
        VoxelType::I16 => Voxels::I16(scalars(stream, layout, i16::from_le_bytes)?),
        VoxelType::U32 => Voxels::U32(scalars(stream, layout, u32::from_le_bytes)?),
        VoxelType::I32 => Voxels::I32(scalars(stream, layout, i32::from_le_bytes)?),
        VoxelType::U64 => Voxels::F64(scalars(stream, layout, |b| u64::from_le_bytes(b) as f64)?),
        VoxelType::I64 => Voxels::F64(scalars(stream, layout, |b| i64::from_le_bytes(b) as f64)?),
        VoxelType::F32 => Voxels::F32(scalars(stream, layout, f32::from_le_bytes)?),
        VoxelType::F64 => Voxels::F64(scalars(stream, layout, f64::from_le_bytes)?),
    };
    refuse_surplus(stream, layout)?;
    Ok(voxels)
}

/// Reads `layout.count` scalars written as words, separated by white space or commas, and checks that no more follow.
pub(crate) fn text(stream: &mut dyn BufRead, layout: &Layout) -> Result<Voxels, String> {
    Ok(match layout.voxel_type {
        VoxelType::U8 => Voxels::U8(words(stream, layout, |w| w.parse().ok())?),
        VoxelType::I8 => Voxels::I8(words(stream, layout, |w| w.parse().ok())?),
        VoxelType::U16 => Voxels::U16(words(stream, layout, |w| w.parse().ok())?),
        VoxelType::I16 => Voxels::I16(words(stream, layout, |w| w.parse().ok())?),
        VoxelType::U32 => Voxels::U32(words(stream, layout, |w| w.parse().ok())?),
        VoxelType::I32 => Voxels::I32(words(stream, layout, |w| w.parse().ok())?),
        VoxelType::U64 => Voxels::F64(words(stream, layout, |w| {
            w.parse::<u64>().ok().map(|v| v as f64)
        })?),
        VoxelType::I64 => Voxels::F64(words(stream, layout, |w| {
            w.parse::<i64>().ok().map(|v| v as f64)
        })?),
        VoxelType::F32 => Voxels::F32(words(stream, layout, |w| w.parse().ok())?),
        VoxelType::F64 => Voxels::F64(words(stream, layout, |w| w.parse().ok())?),
    })
}

/// The scalars of all parts, one behind the other, component by component; nothing without a part. All parts hold the same
/// type, and as many components.
pub(crate) fn joined<E>(
    parts: impl Iterator<Item = Result<Vec<Voxels>, E>>,
) -> Result<Vec<Voxels>, E> {
    let mut all: Vec<Voxels> = Vec::new();
    for part in parts {
        let part = part?;
        if all.is_empty() {
            all = part;
        } else {
            all.iter_mut()
                .zip(part)
                .for_each(|(all, part)| append(all, part));
        }
    }
    Ok(all)
}

/// Puts the scalars of one file behind those of the files before. Both parts come from the same layout, so they hold the same type.
pub(crate) fn append(voxels: &mut Voxels, part: Voxels) {
    match (voxels, part) {
        (Voxels::U8(all), Voxels::U8(part)) => all.extend(part),
        (Voxels::I8(all), Voxels::I8(part)) => all.extend(part),
        (Voxels::U16(all), Voxels::U16(part)) => all.extend(part),
        (Voxels::I16(all), Voxels::I16(part)) => all.extend(part),
        (Voxels::U32(all), Voxels::U32(part)) => all.extend(part),
        (Voxels::I32(all), Voxels::I32(part)) => all.extend(part),
        (Voxels::F32(all), Voxels::F32(part)) => all.extend(part),
        (Voxels::F64(all), Voxels::F64(part)) => all.extend(part),
        _ => unreachable!("the parts of one volume are decoded by one layout"),
    }
}

/// Returns true if two parts hold the same type, so that [`append`] can join them.
pub(crate) fn same_type(voxels: &Voxels, part: &Voxels) -> bool {
    std::mem::discriminant(voxels) == std::mem::discriminant(part)
}

/// Refuses a claim that deflated data of `held` bytes cannot fulfil, or that takes too much memory.
pub(crate) fn check_deflated(needed: u64, held: u64, gate: &Gate) -> Result<(), String> {
    check_expansion(needed, held)?;
    gate.ask_unpacked(needed, held, "the voxels")
}

/// Refuses a claim that deflated data of `held` bytes cannot fulfil.
pub(crate) fn check_expansion(needed: u64, held: u64) -> Result<(), String> {
    let possible = held.saturating_mul(DEFLATE_EXPANSION);
    if needed <= possible {
        return Ok(());
    }
    Err(format!(
        "the header promises {needed} bytes of unpacked data, but the {held} packed bytes there give at most {possible}: \
         the file is cut off or its size is wrong"
    ))
}

/// The fault of a stream that the system or a decompressor gave up on.
pub(crate) fn broken(error: &std::io::Error) -> String {
    format!("the data cannot be read to its end: {error}")
}

/// Reads scalars whose bytes, least significant first, `from_bytes` takes.
fn scalars<T, const N: usize>(
    stream: &mut dyn Read,
    layout: &Layout,
    from_bytes: impl Fn([u8; N]) -> T,
) -> Result<Vec<T>, String> {
    let mut values = Vec::new();
    let mut piece = vec![0; PIECE_BYTES];
    while values.len() < layout.count {
        let wanted = ((layout.count - values.len()) * N).min(PIECE_BYTES);
        let got = fill(stream, &mut piece[..wanted]).map_err(|error| broken(&error))?;
        reserve(&mut values, got / N, layout.count)?;
        let scalars = piece[..got].as_chunks_mut::<N>().0;
        if layout.endian == Endian::Big {
            scalars.iter_mut().for_each(|bytes| bytes.reverse());
        }
        values.extend(scalars.iter().map(|&bytes| from_bytes(bytes)));
        if got < wanted {
            let (needed, held) = (layout.bytes()?, values.len() * N + got % N);
            return Err(format!(
                "the data ends early: {needed} bytes are needed, {held} are there"
            ));
        }
    }
    Ok(values)
}

/// Makes room for `more` values: doubling, never beyond the count, and an error instead of an abort when memory ends.
fn reserve<T>(values: &mut Vec<T>, more: usize, count: usize) -> Result<(), String> {
    if values.capacity() - values.len() >= more {
        return Ok(());
    }
    let room = (values.len() * 2).max(more).min(count) - values.len();
    values.try_reserve_exact(room.max(more)).map_err(|_| {
        let bytes = count.saturating_mul(size_of::<T>());
        format!("{count} voxels need {bytes} bytes of memory, which this machine does not give")
    })
}

/// Like `read_exact`, but reports the length read when the stream ends early.
fn fill(stream: &mut dyn Read, piece: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while filled < piece.len() {
        match stream.read(&mut piece[filled..]) {
            Ok(0) => break,
            Ok(got) => filled += got,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

fn refuse_surplus(stream: &mut dyn Read, layout: &Layout) -> Result<(), String> {
    let surplus = std::io::copy(&mut stream.take(SURPLUS_LIMIT), &mut std::io::sink());
    let needed = layout.bytes()?;
    match surplus {
        Ok(0) => Ok(()),
        Ok(more) if more < SURPLUS_LIMIT => Err(format!(
            "the data goes on: {needed} bytes are needed, {} are there",
            needed + more
        )),
        Ok(more) => Err(format!(
            "the data goes on: {needed} bytes are needed, at least {} are there",
            needed + more
        )),
        Err(error) => Err(format!(
            "after the {needed} bytes needed the data goes on and is broken: {error}"
        )),
    }
}

fn words<T>(
    stream: &mut dyn BufRead,
    layout: &Layout,
    parse: impl Fn(&str) -> Option<T>,
) -> Result<Vec<T>, String> {
    let mut values = Vec::new();
    let mut surplus = 0u64;
    let mut word = Vec::new();
    while next_word(stream, &mut word)? {
        if values.len() == layout.count {
            surplus += 1;
            continue;
        }
        let text = String::from_utf8_lossy(&word);
        let Some(value) = parse(&text) else {
            let (place, name) = (values.len(), layout.voxel_type.name());
            return Err(format!(
                "value {place} of the data is '{text}': expected a number that fits {name}"
            ));
        };
        reserve(&mut values, 1, layout.count)?;
        values.push(value);
    }
    let (needed, held) = (layout.count as u64, values.len() as u64 + surplus);
    match held.cmp(&needed) {
        std::cmp::Ordering::Equal => Ok(values),
        std::cmp::Ordering::Less => Err(format!(
            "the data ends early: {needed} values are needed, {held} are there"
        )),
        std::cmp::Ordering::Greater => Err(format!(
            "the data goes on: {needed} values are needed, {held} are there"
        )),
    }
}

/// The next word into `word`; false at the end of the stream.
pub(crate) fn next_word(stream: &mut dyn BufRead, word: &mut Vec<u8>) -> Result<bool, String> {
    word.clear();
    loop {
        let buffer = stream.fill_buf().map_err(|error| broken(&error))?;
        if buffer.is_empty() {
            return Ok(!word.is_empty());
        }
        let separates = |byte: &u8| byte.is_ascii_whitespace() || *byte == b',';
        let skipped = if word.is_empty() {
            buffer.iter().take_while(|byte| separates(byte)).count()
        } else {
            0
        };
        let taken = buffer[skipped..]
            .iter()
            .take_while(|byte| !separates(byte))
            .count();
        word.extend_from_slice(&buffer[skipped..skipped + taken]);
        let ended = skipped + taken < buffer.len();
        stream.consume(skipped + taken);
        if word.len() > MAX_WORD_BYTES {
            return Err(format!(
                "the data holds a word of more than {MAX_WORD_BYTES} characters"
            ));
        }
        if ended && !word.is_empty() {
            return Ok(true);
        }
    }
}

/// Axes of size 1 are added until there are three: at right angles to the others, as long as the shortest of them.
pub(crate) fn complete(mut columns: Vec<DVec3>) -> DMat3 {
    let shortest = columns
        .iter()
        .map(|column| column.length())
        .fold(f64::INFINITY, f64::min);
    let length = if shortest > 0.0 && shortest.is_finite() {
        shortest
    } else {
        1.0
    };
    if columns.is_empty() {
        columns.push(DVec3::X * length);
    }
    if columns.len() == 1 {
        let across = columns[0]
            .try_normalize()
            .map_or(DVec3::Y, DVec3::any_orthonormal_vector);
        columns.push(across * length);
    }
    if columns.len() == 2 {
        let normal = columns[0]
            .cross(columns[1])
            .try_normalize()
            .unwrap_or(DVec3::Z);
        columns.push(normal * length);
    }
    DMat3::from_cols(columns[0], columns[1], columns[2])
}

/// A lattice along the world's axes.
pub(crate) fn upright(spacing: [f64; 3], origin: [f64; 3]) -> DAffine3 {
    let axes = DMat3::from_diagonal(DVec3::from_array(spacing));
    DAffine3::from_mat3_translation(axes, DVec3::from_array(origin))
}
