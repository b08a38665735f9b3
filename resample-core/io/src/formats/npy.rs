//! NumPy's `.npy` files: the header (type, order and shape of one array of numbers), and depth that is stored in one.
//!
//! The header is a Python literal of three entries, read here by hand: a general reader of literals can be led into deep
//! recursion by a forged one. Source: NumPy's description of the format, versions 1 to 3.
//! Limits: plain numbers; no records and no complex numbers.

use std::io::{BufReader, Read};
use std::path::Path;

use ::exr::prelude::f16;
use resample_core::Error;

use crate::files::{cannot_read, check_claim, fault, open};
use crate::picture::Stored;
use crate::receiver::{Receiver, Room};
use crate::refused::{Refused, excerpt};

/// The first bytes of every file; two bytes of version follow.
pub const MAGIC: &[u8] = b"\x93NUMPY";

/// Longest header that is read: NumPy itself refuses more than 10 000 characters.
const MAX_HEADER_BYTES: usize = 10_000;

/// The facts of the header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// How one number is stored.
    pub element: Element,
    /// Order of the array in the file.
    pub order: Order,
    /// Size of each axis.
    pub shape: Vec<usize>,
    /// Bytes before the array.
    pub bytes: u64,
}

/// How one number of an array is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Element {
    /// The meaning of its bits.
    pub kind: Kind,
    /// Bytes of a number: 1, 2, 4 or 8.
    pub bytes: usize,
    /// The order of its bytes.
    pub endian: Endian,
}

/// The meaning of a number's bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number from 0 up; a boolean is 0 or 1.
    Unsigned,
    /// A whole number with a sign.
    Signed,
    /// Floating point.
    Float,
}

/// The order of a number's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Endian {
    /// The lowest.
    Little,
    /// The highest.
    Big,
}

/// Order of the array in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The last axis is fastest.
    C,
    /// The first axis is fastest.
    Fortran,
}

impl Header {
    /// Reads the header and leaves the file where the array begins.
    ///
    /// # Errors
    /// A header that is cut off or contradicts the format, and an array that does not hold plain numbers.
    pub fn read(file: &mut dyn Read) -> Result<Self, Refused> {
        let version = take(file, MAGIC.len() + 2)?[MAGIC.len()];
        let length_bytes = match version {
            1 => 2,
            2 | 3 => 4,
            other => {
                return Err(Refused::Unsupported(format!(
                    "version {other} of the format: 1 to 3 are read"
                )));
            }
        };
        let length = take(file, length_bytes)?
            .iter()
            .rev()
            .fold(0, |length, &byte| (length << 8) | usize::from(byte));
        if length > MAX_HEADER_BYTES {
            return Err(Refused::Invalid(format!(
                "a header of {length} bytes: expected at most {MAX_HEADER_BYTES}"
            )));
        }
        let text = String::from_utf8_lossy(&take(file, length)?).into_owned();
        Ok(Self {
            element: element(entry(&text, "descr")?)?,
            order: order(entry(&text, "fortran_order")?)?,
            shape: shape(entry(&text, "shape")?)?,
            bytes: (MAGIC.len() + 2 + length_bytes + length) as u64,
        })
    }
}

fn take(file: &mut dyn Read, count: usize) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let got = file
        .take(count as u64)
        .read_to_end(&mut bytes)
        .map_err(|error| format!("cannot be read to its end: {error}"))?;
    if got == count {
        Ok(bytes)
    } else {
        Err("the header of the array is cut off".to_owned())
    }
}

/// The text behind the colon of a key, up to the end of the header.
fn entry<'a>(text: &'a str, key: &str) -> Result<&'a str, String> {
    let behind = text
        .split_once(&format!("'{key}'"))
        .and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
    behind
        .map(str::trim_start)
        .ok_or_else(|| format!("the header '{}' has no entry '{key}'", excerpt(text)))
}

fn element(text: &str) -> Result<Element, Refused> {
    let Some((code, _)) = text
        .strip_prefix('\'')
        .and_then(|rest| rest.split_once('\''))
    else {
        return Err(Refused::Unsupported(
            "an array of records: save one field of it".to_owned(),
        ));
    };
    let (kind, bytes) = match code.trim_start_matches(['<', '>', '|', '=']) {
        "b1" | "u1" => (Kind::Unsigned, 1),
        "u2" => (Kind::Unsigned, 2),
        "u4" => (Kind::Unsigned, 4),
        "u8" => (Kind::Unsigned, 8),
        "i1" => (Kind::Signed, 1),
        "i2" => (Kind::Signed, 2),
        "i4" => (Kind::Signed, 4),
        "i8" => (Kind::Signed, 8),
        "f2" => (Kind::Float, 2),
        "f4" => (Kind::Float, 4),
        "f8" => (Kind::Float, 8),
        _ => return Err(Refused::Unsupported(other_type(code))),
    };
    let endian = if code.starts_with('>') {
        Endian::Big
    } else {
        Endian::Little
    };
    Ok(Element {
        kind,
        bytes,
        endian,
    })
}

impl std::fmt::Display for Element {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match self.kind {
            Kind::Unsigned => 'u',
            Kind::Signed => 'i',
            Kind::Float => 'f',
        };
        write!(f, "{kind}{}", self.bytes)
    }
}

/// Refuses elements of another type.
pub fn other_type(code: &str) -> String {
    let code = excerpt(code);
    format!(
        "elements of type '{code}': save the array as integers, float32 or float64 (array.astype)"
    )
}

fn order(text: &str) -> Result<Order, String> {
    match text {
        _ if text.starts_with("False") => Ok(Order::C),
        _ if text.starts_with("True") => Ok(Order::Fortran),
        _ => Err(format!(
            "'fortran_order' is '{}': expected True or False",
            excerpt(text)
        )),
    }
}

fn shape(text: &str) -> Result<Vec<usize>, String> {
    let fault = || {
        format!(
            "'shape' is '{}': expected whole numbers such as (3, 4, 5)",
            excerpt(text)
        )
    };
    let (inside, _) = text
        .strip_prefix('(')
        .and_then(|rest| rest.split_once(')'))
        .ok_or_else(fault)?;
    let words = inside
        .split(',')
        .map(str::trim)
        .filter(|word| !word.is_empty());
    // Python 2 wrote long integers with an L.
    words
        .map(|word| word.trim_end_matches('L').parse().map_err(|_| fault()))
        .collect()
}

/// Columns of an array in Fortran order that are held together, so that pieces of rows are not single numbers.
const COLUMNS: usize = 64;

pub(crate) fn decode(path: &Path, room: Room, to: &mut dyn Receiver) -> Result<Stored, Error> {
    let (file, length) = open(path)?;
    let mut file = BufReader::new(file);
    let header = Header::read(&mut file).map_err(|what| fault(path, what))?;
    let element = header.element;
    let stored = stored(&element).map_err(|what| fault(path, what))?;
    let [height, width] = size(&header.shape).map_err(|what| fault(path, what))?;
    check_claim(width as u64, height as u64, length, 1).map_err(|what| fault(path, what))?;
    let failed = |source: std::io::Error| cannot_read(path, &source);
    let held = length.saturating_sub(header.bytes);
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
    if header.order == Order::Fortran {
        room.check(
            path,
            (COLUMNS.min(width) * height * element.bytes) as u64,
            "an array in Fortran order",
        )?;
        by_columns(path, &mut file, &element, [width, height], to)?;
        return Ok(stored);
    }
    let mut bytes = vec![0; width * element.bytes];
    for y in 0..height {
        file.read_exact(&mut bytes).map_err(failed)?;
        let row: Vec<f32> = bytes
            .chunks_exact(element.bytes)
            .map(|bytes| number(&element, bytes))
            .collect();
        to.put([0, y], &row)?;
    }
    Ok(stored)
}

/// An array whose columns lie one after another.
fn by_columns(
    path: &Path,
    file: &mut impl Read,
    element: &Element,
    [width, height]: [usize; 2],
    to: &mut dyn Receiver,
) -> Result<(), Error> {
    let column_bytes = height * element.bytes;
    for first in (0..width).step_by(COLUMNS) {
        let count = COLUMNS.min(width - first);
        let mut bytes = vec![0; count * column_bytes];
        file.read_exact(&mut bytes)
            .map_err(|source| cannot_read(path, &source))?;
        for y in 0..height {
            let at = |column: usize| column * column_bytes + y * element.bytes;
            let one =
                |column: usize| number(element, &bytes[at(column)..at(column) + element.bytes]);
            let piece: Vec<f32> = (0..count).map(one).collect();
            to.put([first, y], &piece)?;
        }
    }
    Ok(())
}

/// One number; `bytes` holds as many as the element has.
fn number(element: &Element, bytes: &[u8]) -> f32 {
    let mut little = [0u8; 8];
    for (i, &byte) in bytes.iter().enumerate() {
        let place = match element.endian {
            Endian::Little => i,
            Endian::Big => bytes.len() - 1 - i,
        };
        little[place] = byte;
    }
    let bits = u64::from_le_bytes(little);
    // The value has `bytes` bytes, so the casts keep all of it.
    match (element.kind, element.bytes) {
        (Kind::Float, 2) => f16::from_bits(bits as u16).to_f32(),
        (Kind::Float, 4) => f32::from_bits(bits as u32),
        (Kind::Float, _) => f64::from_bits(bits) as f32,
        (Kind::Signed, 1) => f32::from(bits as u8 as i8),
        (Kind::Signed, 2) => f32::from(bits as u16 as i16),
        (Kind::Signed, _) => bits as u32 as i32 as f32,
        (Kind::Unsigned, _) => bits as f32,
    }
}

/// The kind of a depth's numbers.
fn stored(element: &Element) -> Result<Stored, String> {
    Ok(match (element.kind, element.bytes) {
        (Kind::Float, _) => Stored::Float,
        (Kind::Unsigned, 1) => Stored::Code(255),
        (Kind::Unsigned, 2) => Stored::Code(65_535),
        (Kind::Unsigned, 4) => Stored::Code(u32::MAX),
        (Kind::Signed, 1) => Stored::Code(127),
        (Kind::Signed, 2) => Stored::Code(32_767),
        (Kind::Signed, 4) => Stored::Code(i32::MAX as u32),
        _ => {
            return Err(format!(
                "an array of type '{element}': save it as float32 or uint16 (array.astype)"
            ));
        }
    })
}

/// Height and width.
fn size(shape: &[usize]) -> Result<[usize; 2], String> {
    match *shape {
        [height, width] | [1, height, width] | [height, width, 1] => Ok([height, width]),
        _ => Err(format!(
            "an array of shape {shape:?}: expected height and width, one number per pixel"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes
    }

    #[test]
    fn every_type_of_number_has_its_size_and_order_of_bytes() {
        let names = [
            "u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8",
        ];
        for name in names {
            let read = element(&format!("'>{name}', ")).expect("a number");
            assert_eq!(
                (read.to_string().as_str(), read.endian),
                (name, Endian::Big)
            );
            let bytes: usize = name[1..].parse().expect("a size");
            assert_eq!(read.bytes as usize, bytes, "{name}");
        }
        assert_eq!(element("'|b1'").expect("truth values").to_string(), "u1");
        assert_eq!(element("'<f4'").expect("a number").endian, Endian::Little);
        for other in ["'<c8'", "'|O'", "[('a', '<f4')]"] {
            assert!(element(other).is_err(), "{other}");
        }
    }

    #[test]
    fn a_header_tells_its_length_order_and_shape() {
        let text = "{'descr': '<f4', 'fortran_order': True, 'shape': (3, 4L, 5), }";
        let bytes = header(text);
        let read = Header::read(&mut bytes.as_slice()).expect("a header");
        assert_eq!((read.order, read.shape), (Order::Fortran, vec![3, 4, 5]));
        assert_eq!(read.bytes, bytes.len() as u64);
        assert!(
            Header::read(&mut &bytes[..bytes.len() - 1]).is_err(),
            "cut off"
        );
        let odd = header(&text.replace("True", "Maybe"));
        assert!(Header::read(&mut odd.as_slice()).is_err(), "neither order");
        // Longer than 255 bytes: both bytes of the length count.
        let padded = header(&format!("{text:<300}"));
        let read = Header::read(&mut padded.as_slice()).expect("a header");
        assert_eq!(read.bytes, 310);
        let mut forged = b"\x93NUMPY\x02\x00".to_vec();
        forged.extend((MAX_HEADER_BYTES as u32 + 1).to_le_bytes());
        forged.extend(vec![b' '; MAX_HEADER_BYTES + 1]);
        let error = Header::read(&mut forged.as_slice()).expect_err("too long");
        assert!(format!("{error:?}").contains("at most"), "{error:?}");
    }
}
