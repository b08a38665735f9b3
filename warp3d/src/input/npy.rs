//! NumPy's `.npy` files: an array of height x width numbers.
//!
//! Takes a path, gives its numbers. The header is a Python literal of three entries, read here by hand: a general
//! reader of literals can be led into deep recursion by a forged one. Axes of length 1 are ignored, so that
//! (1, h, w) and (h, w, 1) are read too. Source: NumPy's description of the format, versions 1 to 3.
//! Limits: whole numbers up to 32 bits, half, single and double precision.

use std::io::{BufReader, Read, Seek};
use std::path::Path;

use ::exr::prelude::f16;

use super::files::{cannot_read, check_claim, fault, open};
use super::plane::Stored;
use super::receiver::{Receiver, Room};
use crate::Error;

/// Longest header that is read: NumPy itself refuses more than 10 000 characters.
const MAX_HEADER_BYTES: usize = 10_000;

/// Bytes of the mark and the version before the header's length.
const MARK_BYTES: usize = 8;

/// Columns of an array in Fortran order that are held together, so that pieces of rows are not single numbers.
const COLUMNS: usize = 64;

pub(super) fn decode(path: &Path, room: Room, to: &mut dyn Receiver) -> Result<Stored, Error> {
    let (file, length) = open(path)?;
    let mut file = BufReader::new(file);
    let header = header(&mut file).map_err(|what| fault(path, what))?;
    let element = element(&header).map_err(|what| fault(path, what))?;
    let [height, width] = size(&header).map_err(|what| fault(path, what))?;
    check_claim(width as u64, height as u64, length, 1).map_err(|what| fault(path, what))?;
    let failed = |source: std::io::Error| cannot_read(path, &source);
    let held = length - file.stream_position().map_err(failed)?;
    let needed = (width * height * element.bytes) as u64;
    if held != needed {
        return Err(fault(
            path,
            format!(
                "{height} x {width} numbers take {needed} bytes behind the header, there are {held}"
            ),
        ));
    }
    to.begin([width, height])?;
    if entry(&header, "fortran_order").is_ok_and(|text| text.starts_with("True")) {
        by_columns(path, &mut file, (&element, [width, height]), (room, to))?;
        return Ok(element.stored);
    }
    let mut bytes = vec![0; width * element.bytes];
    for y in 0..height {
        file.read_exact(&mut bytes).map_err(failed)?;
        let row: Vec<f32> = bytes
            .chunks_exact(element.bytes)
            .map(|bytes| element.number(bytes))
            .collect();
        to.put([0, y], &row)?;
    }
    Ok(element.stored)
}

/// An array whose columns lie one after another.
fn by_columns(
    path: &Path,
    file: &mut impl Read,
    (element, [width, height]): (&Element, [usize; 2]),
    (room, to): (Room, &mut dyn Receiver),
) -> Result<(), Error> {
    let column_bytes = height * element.bytes;
    room.check(
        path,
        (COLUMNS.min(width) * column_bytes) as u64,
        "an array in Fortran order",
    )?;
    for first in (0..width).step_by(COLUMNS) {
        let count = COLUMNS.min(width - first);
        let mut bytes = vec![0; count * column_bytes];
        file.read_exact(&mut bytes)
            .map_err(|source| cannot_read(path, &source))?;
        for y in 0..height {
            let at = |column: usize| column * column_bytes + y * element.bytes;
            let number =
                |column: usize| element.number(&bytes[at(column)..at(column) + element.bytes]);
            let piece: Vec<f32> = (0..count).map(number).collect();
            to.put([first, y], &piece)?;
        }
    }
    Ok(())
}

/// How one number is stored.
struct Element {
    bytes: usize,
    big_endian: bool,
    kind: char,
    stored: Stored,
}

impl Element {
    /// One number; `bytes` holds as many as [`Element::bytes`].
    fn number(&self, bytes: &[u8]) -> f32 {
        let mut little = [0u8; 8];
        for (i, &byte) in bytes.iter().enumerate() {
            little[if self.big_endian {
                bytes.len() - 1 - i
            } else {
                i
            }] = byte;
        }
        let bits = u64::from_le_bytes(little);
        // The value has `bytes` bytes, so the casts keep all of it.
        match (self.kind, self.bytes) {
            ('f', 2) => f16::from_bits(bits as u16).to_f32(),
            ('f', 4) => f32::from_bits(bits as u32),
            ('f', _) => f64::from_bits(bits) as f32,
            ('i', 1) => f32::from(bits as u8 as i8),
            ('i', 2) => f32::from(bits as u16 as i16),
            ('i', _) => bits as u32 as i32 as f32,
            _ => bits as f32,
        }
    }
}

fn header(file: &mut impl Read) -> Result<String, String> {
    let cut = |_| "the header of the array is cut off".to_owned();
    let mut mark = [0u8; MARK_BYTES];
    file.read_exact(&mut mark).map_err(cut)?;
    let mut length = [0u8; 4];
    let length_bytes = if mark[6] == 1 { 2 } else { 4 };
    file.read_exact(&mut length[..length_bytes]).map_err(cut)?;
    let length = u32::from_le_bytes(length) as usize;
    if length > MAX_HEADER_BYTES {
        return Err(format!(
            "a header of {length} bytes: expected at most {MAX_HEADER_BYTES}"
        ));
    }
    let mut text = vec![0u8; length];
    file.read_exact(&mut text).map_err(cut)?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

/// What stands behind the colon of a key, up to the end of the header.
fn entry<'a>(header: &'a str, key: &str) -> Result<&'a str, String> {
    let behind = header
        .split_once(&format!("'{key}'"))
        .and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
    behind
        .map(str::trim_start)
        .ok_or_else(|| format!("the header of the array has no entry '{key}'"))
}

fn element(header: &str) -> Result<Element, String> {
    let text = entry(header, "descr")?;
    let code = text
        .strip_prefix('\'')
        .and_then(|rest| rest.split_once('\''))
        .map_or("", |(code, _)| code);
    let big_endian = code.starts_with('>');
    let plain = code.trim_start_matches(['<', '>', '|', '=']);
    let (kind, stored) = match plain {
        "f2" | "f4" | "f8" => ('f', Stored::Float),
        "u1" | "b1" => ('u', Stored::Code(255)),
        "u2" => ('u', Stored::Code(65_535)),
        "u4" => ('u', Stored::Code(u32::MAX)),
        "i1" => ('i', Stored::Code(127)),
        "i2" => ('i', Stored::Code(32_767)),
        "i4" => ('i', Stored::Code(i32::MAX as u32)),
        _ => {
            let code: String = code.chars().take(20).collect();
            return Err(format!(
                "an array of type '{code}': save it as float32 or uint16 (array.astype)"
            ));
        }
    };
    let bytes = plain
        .chars()
        .nth(1)
        .and_then(|digit| digit.to_digit(10))
        .unwrap_or(1) as usize;
    Ok(Element {
        bytes,
        big_endian,
        kind,
        stored,
    })
}

/// Height and width.
fn size(header: &str) -> Result<[usize; 2], String> {
    let text = entry(header, "shape")?;
    let inside = text
        .strip_prefix('(')
        .and_then(|rest| rest.split_once(')'))
        .map_or("", |(inside, _)| inside);
    let expected =
        || format!("an array of shape ({inside}): expected height and width, one number per pixel");
    let axes: Option<Vec<usize>> = inside
        .split(',')
        .map(str::trim)
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok())
        .collect();
    let axes = axes.ok_or_else(expected)?;
    match axes.as_slice() {
        &[height, width] | &[1, height, width] | &[height, width, 1] => Ok([height, width]),
        _ => Err(expected()),
    }
}
