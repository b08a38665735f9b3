//! SPZ, the packed Gaussians of Niantic, versions 1 to 4.
//!
//! Takes a path, gives Gaussians. Versions 1 to 3 are one gzip stream: a header of 16 bytes, then all positions, opacities, colours,
//! scales, rotations and coefficients. Version 4 has a header of 32 bytes, a table with the packed and the unpacked size of each
//! of these streams, and the streams, packed by Zstandard. Source: the description of the format in Niantic's repository `spz`.
//! The format has x to the right, y up and z backward; the coordinates stay as they are.
//! Limits: harmonics of degree 4 are left out, with a note; extensions are passed over.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use glam::{Quat, Vec3};
use resample_io::Gate;

use super::sink::{self, C0, MOST_DEGREE, Sink, Stored};
use crate::Error;
use crate::gaussians::Gaussians;
use crate::input::{Fault, open_sized, unsupported};

/// The first bytes of a header.
const MAGIC: &[u8; 4] = b"NGSP";

/// The first bytes of the gzip file that versions 1 to 3 are.
const GZIP_MAGIC: &[u8] = &[0x1f, 0x8b];

/// Bytes of the header of versions 1 to 3.
const HEADER_BYTES: usize = 16;

/// Bytes of the header of version 4.
const LONG_HEADER_BYTES: usize = 32;

/// Attributes of a Gaussian, each stored for all: positions, opacities, colours, scales, rotations, coefficients.
const ATTRIBUTES: usize = 6;

/// Colours are stored as 0.5 plus this times the coefficient of degree 0.
const COLOUR_SCALE: f32 = 0.15;

/// Flag of Gaussians that were trained with the filter of "Mip-Splatting".
const ANTIALIASED: u8 = 1;

/// Returns true if a file that begins with these bytes is SPZ.
pub(crate) fn begins(head: &[u8]) -> bool {
    if !head.starts_with(GZIP_MAGIC) {
        return head.starts_with(MAGIC);
    }
    let mut first = [0; MAGIC.len()];
    let read = flate2::bufread::GzDecoder::new(head).read_exact(&mut first);
    read.is_ok() && first == *MAGIC
}

#[derive(Clone, Copy, Debug)]
struct Header {
    version: u32,
    count: u64,
    degree: usize,
    fractional_bits: u8,
    flags: u8,
    /// Streams of version 4.
    streams: u8,
    /// Where their table begins, from the start of the file; version 4.
    table: u64,
}

impl Header {
    fn new(bytes: &[u8]) -> Result<Self, Fault> {
        let word = |at: usize| {
            u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        if !bytes.starts_with(MAGIC) {
            return Err(Fault::Invalid(
                "its first bytes are not 'NGSP': it is no SPZ file".to_owned(),
            ));
        }
        let header = Self {
            version: word(4),
            count: u64::from(word(8)),
            degree: usize::from(bytes[12]),
            fractional_bits: bytes[13],
            flags: bytes[14],
            streams: bytes[15],
            table: bytes.get(16..20).map_or(0, |_| u64::from(word(16))),
        };
        if !(1..=4).contains(&header.version) {
            return Err(unsupported(format!(
                "version {} of SPZ: 1 to 4 are read; write it with another version",
                header.version
            )));
        }
        if header.degree > 4 || header.fractional_bits > 24 {
            return Err(Fault::Invalid(format!(
                "its header says harmonics of degree {} and {} fractional bits: expected at most 4 and 24",
                header.degree, header.fractional_bits
            )));
        }
        Ok(header)
    }

    /// Bytes of each attribute of all Gaussians.
    fn sizes(&self) -> [u64; ATTRIBUTES] {
        let positions = if self.version == 1 { 6 } else { 9 };
        let rotations = if self.version < 3 { 3 } else { 4 };
        let rest = sink::coefficients_of(self.degree) as u64;
        [positions, 1, 3, 3, rotations, rest].map(|bytes| self.count * bytes)
    }

    /// Asks for the memory of the unpacked attributes and the Gaussians.
    fn ask(&self, packed: u64, gate: &Gate) -> Result<(), Fault> {
        let unpacked = self.sizes().iter().sum();
        let asked = gate.ask_unpacked(unpacked, packed, "the Gaussians");
        asked.map_err(Fault::Invalid)?;
        sink::ask(gate, self.degree.min(MOST_DEGREE), self.count, unpacked)
    }
}

/// Reads a file.
pub(crate) fn load(path: &Path, gate: &Gate, notes: &mut Vec<String>) -> Result<Gaussians, Error> {
    let (file, held) = open_sized(path)?;
    let mut file = BufReader::new(file);
    let read =
        attributes(&mut file, held, gate).and_then(|(header, all)| gaussians(&header, &all, notes));
    read.map_err(|fault| fault.at(path))
}

type Attributes = [Vec<u8>; ATTRIBUTES];

fn attributes(
    file: &mut BufReader<File>,
    held: u64,
    gate: &Gate,
) -> Result<(Header, Attributes), Fault> {
    let mut head = Vec::new();
    let read = file
        .by_ref()
        .take(LONG_HEADER_BYTES as u64)
        .read_to_end(&mut head);
    read.map_err(broken)?;
    if head.starts_with(GZIP_MAGIC) {
        file.seek(SeekFrom::Start(0)).map_err(broken)?;
        return gzipped(file, held, gate);
    }
    if head.len() < LONG_HEADER_BYTES {
        return Err(Fault::Invalid(format!(
            "its header has {} bytes, expected {LONG_HEADER_BYTES}: it is cut off",
            head.len()
        )));
    }
    let header = Header::new(&head)?;
    if header.version < 4 {
        return Err(Fault::Invalid(format!(
            "version {} is not packed by gzip: the file is damaged",
            header.version
        )));
    }
    header.ask(held, gate)?;
    let all = streams(file, &header, held)?;
    Ok((header, all))
}

fn broken(error: std::io::Error) -> Fault {
    Fault::Invalid(format!("the data cannot be read to its end: {error}"))
}

/// The attributes of versions 1 to 3.
fn gzipped(
    file: impl std::io::BufRead,
    held: u64,
    gate: &Gate,
) -> Result<(Header, Attributes), Fault> {
    let mut stream = flate2::bufread::MultiGzDecoder::new(file);
    let mut head = [0; HEADER_BYTES];
    stream.read_exact(&mut head).map_err(broken)?;
    let header = Header::new(&head)?;
    if header.version > 3 {
        return Err(Fault::Invalid(
            "version 4 within gzip: expected versions 1 to 3".to_owned(),
        ));
    }
    header.ask(held, gate)?;
    let mut all = Attributes::default();
    for (attribute, size) in all.iter_mut().zip(header.sizes()) {
        *attribute = exactly(&mut stream, size, &header)?;
    }
    Ok((header, all))
}

/// The attributes of version 4.
fn streams(file: &mut BufReader<File>, header: &Header, held: u64) -> Result<Attributes, Fault> {
    let sizes = header.sizes();
    let expected = sizes.iter().filter(|size| **size > 0).count();
    if usize::from(header.streams) != expected {
        return Err(Fault::Invalid(format!(
            "its header says {} streams, expected {expected}",
            header.streams
        )));
    }
    file.seek(SeekFrom::Start(header.table)).map_err(broken)?;
    let mut table = vec![0; 16 * expected];
    file.read_exact(&mut table).map_err(broken)?;
    let word = |at: usize| {
        let bytes: [u8; 8] = std::array::from_fn(|byte| table[8 * at + byte]);
        u64::from_le_bytes(bytes)
    };
    let mut all = Attributes::default();
    let stored = all.iter_mut().zip(sizes).filter(|(_, size)| *size > 0);
    for (number, (attribute, size)) in stored.enumerate() {
        let (packed, unpacked) = (word(2 * number), word(2 * number + 1));
        if unpacked != size || packed > held {
            return Err(Fault::Invalid(format!(
                "stream {number} is {unpacked} bytes packed into {packed}, expected {size} out of a file of {held}"
            )));
        }
        let mut stream = file.by_ref().take(packed);
        let unknown = |error| Fault::Invalid(format!("stream {number} is no Zstandard: {error}"));
        let decoder = ruzstd::decoding::StreamingDecoder::new(&mut stream).map_err(unknown)?;
        *attribute = exactly(decoder, size, header)?;
        std::io::copy(&mut stream, &mut std::io::sink()).map_err(broken)?;
    }
    Ok(all)
}

/// So many bytes; they are allocated as they come.
fn exactly(stream: impl Read, size: u64, header: &Header) -> Result<Vec<u8>, Fault> {
    let mut bytes = Vec::new();
    let read = stream.take(size).read_to_end(&mut bytes);
    read.map_err(broken)?;
    if (bytes.len() as u64) < size {
        return Err(Fault::Invalid(format!(
            "the data ends early: {} Gaussians of degree {} need {size} bytes of an attribute, {} are there",
            header.count,
            header.degree,
            bytes.len()
        )));
    }
    Ok(bytes)
}

fn gaussians(
    header: &Header,
    all: &Attributes,
    notes: &mut Vec<String>,
) -> Result<Gaussians, Fault> {
    let degree = header.degree.min(MOST_DEGREE);
    if degree < header.degree {
        notes.push(
            "its spherical harmonics have degree 4; those beyond degree 3 are left out".to_owned(),
        );
    }
    if header.flags & ANTIALIASED != 0 {
        notes.push("its Gaussians were trained with an anti-aliasing filter".to_owned());
    }
    let [_, _, _, _, _, rest] = all;
    let (stored, kept) = (
        sink::coefficients_of(header.degree),
        sink::coefficients_of(degree),
    );
    let mut coefficients = vec![0.0; kept];
    let mut sink = Sink::with_capacity(degree, header.count);
    for index in 0..header.count as usize {
        let codes = &rest[stored * index..][..kept];
        for (value, code) in coefficients.iter_mut().zip(codes) {
            *value = (f32::from(*code) - 128.0) / 128.0;
        }
        sink.push(&gaussian(header, all, index), &coefficients);
    }
    sink.finish(notes)
}

fn gaussian(header: &Header, all: &Attributes, index: usize) -> Stored {
    let [positions, opacities, colours, scales, rotations, _] = all;
    let three = |bytes: &[u8]| {
        Vec3::from_array(std::array::from_fn(|axis| {
            f32::from(bytes[3 * index + axis])
        }))
    };
    let position = std::array::from_fn(|axis| match header.version {
        1 => half(&positions[6 * index + 2 * axis..]),
        _ => fixed(&positions[9 * index + 3 * axis..], header.fractional_bits),
    });
    let rotation = match header.version {
        1 | 2 => {
            let xyz = three(rotations) / 127.5 - 1.0;
            let w = (1.0 - xyz.length_squared()).max(0.0).sqrt();
            Quat::from_xyzw(xyz.x, xyz.y, xyz.z, w)
        }
        _ => packed_rotation(&rotations[4 * index..]),
    };
    let logs = three(scales) / 16.0 - 10.0;
    let constant = (three(colours) / 255.0 - 0.5) / COLOUR_SCALE;
    Stored {
        centre: Vec3::from_array(position).as_dvec3(),
        rotation,
        scales: Vec3::new(logs.x.exp(), logs.y.exp(), logs.z.exp()),
        opacity: f32::from(opacities[index]) / 255.0,
        colour: 0.5 + C0 * constant,
    }
}

/// A whole number of 24 bits with a sign, in steps of 2^-bits.
fn fixed(bytes: &[u8], fractional_bits: u8) -> f32 {
    let shifted = i32::from_le_bytes([0, bytes[0], bytes[1], bytes[2]]);
    (shifted >> 8) as f32 / (1u32 << fractional_bits) as f32
}

/// A floating-point number of 16 bits: a sign, 5 bits of exponent, 10 of fraction.
fn half(bytes: &[u8]) -> f32 {
    let bits = u16::from_le_bytes([bytes[0], bytes[1]]);
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f32::from(bits & 0x3ff));
    sign * match exponent {
        0 => fraction * 2f32.powi(-24),
        0x1f if fraction == 0.0 => f32::INFINITY,
        0x1f => f32::NAN,
        _ => (1024.0 + fraction) * 2f32.powi(exponent - 25),
    }
}

/// The place of the largest of x y z w in the upper 2 bits; each of the others, the last in the lowest bits, has a sign and 9 bits
/// of its size as a part of sqrt(1/2).
fn packed_rotation(bytes: &[u8]) -> Quat {
    let word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let three = [20, 10, 0].map(|shift| {
        let bits = word >> shift;
        let size = (bits & 0x1ff) as f32 / 511.0 * std::f32::consts::FRAC_1_SQRT_2;
        if bits & 0x200 == 0 { size } else { -size }
    });
    let [x, y, z, w] = sink::smallest_three(three, (word >> 30) as usize);
    Quat::from_xyzw(x, y, z, w)
}

#[cfg(test)]
mod tests;
