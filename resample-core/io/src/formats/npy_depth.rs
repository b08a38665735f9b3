//! NumPy's `.npy` files as depth: an array of height x width numbers.
//!
//! Takes a path, gives its numbers. Axes of length 1 are ignored, so that (1, h, w) and (h, w, 1) are read too.
//! Limits: whole numbers up to 32 bits, half, single and double precision.

use std::io::{BufReader, Read};
use std::path::Path;

use ::exr::prelude::f16;

use super::npy::{Element, Endian, Header, Kind, Order};
use crate::files::{cannot_read, check_claim, fault, open};
use crate::plane::Stored;
use crate::receiver::{Receiver, Room};
use resample_core::Error;

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
