//! PFM: one number per pixel in single precision.
//!
//! Takes a path, gives its numbers. The header is three lines: `Pf`, width and height, and a scale whose sign gives
//! the byte order (negative is little-endian); rows run from the bottom. Source: the description of the format that
//! goes with the Middlebury stereo sets. The magnitude of the scale is not applied: those sets store units there
//! that readers ignore. Limits: a colour PFM (`PF`) is refused.

use std::io::{BufRead, BufReader, Read, Seek};
use std::path::Path;

use crate::files::{cannot_read, check_claim, fault, open};
use crate::picture::Stored;
use crate::receiver::Receiver;
use resample_core::Error;

/// Longest line of the header, bytes; honest ones have less than twenty.
const MAX_LINE_BYTES: u64 = 100;

pub(crate) fn decode(path: &Path, to: &mut dyn Receiver) -> Result<Stored, Error> {
    let (file, length) = open(path)?;
    let mut file = BufReader::new(file);
    let header = header(&mut file).map_err(|what| fault(path, what))?;
    let [width, height] = header.size;
    // One pixel takes four bytes.
    check_claim(width as u64, height as u64, length / 4, 1).map_err(|what| fault(path, what))?;
    let failed = |source: std::io::Error| cannot_read(path, &source);
    let held = length - file.stream_position().map_err(failed)?;
    let needed = (width * height * 4) as u64;
    if held != needed {
        return Err(fault(
            path,
            format!("{width}x{height} numbers take {needed} bytes, there are {held}"),
        ));
    }
    let number = |bytes: &[u8]| {
        let four = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if header.big_endian {
            f32::from_be_bytes(four)
        } else {
            f32::from_le_bytes(four)
        }
    };
    to.begin([width, height])?;
    let mut bytes = vec![0; width * 4];
    for y in (0..height).rev() {
        file.read_exact(&mut bytes).map_err(failed)?;
        let row: Vec<f32> = bytes.chunks_exact(4).map(number).collect();
        to.put([0, y], &row)?;
    }
    Ok(Stored::Float)
}

struct Header {
    size: [usize; 2],
    big_endian: bool,
}

fn header(file: &mut impl BufRead) -> Result<Header, String> {
    let mut words = Vec::new();
    // The four words may stand on three lines or on four; behind the last one stands one byte of white space.
    while words.len() < 4 {
        let mut line = Vec::new();
        let read = (&mut *file)
            .take(MAX_LINE_BYTES)
            .read_until(b'\n', &mut line);
        if read.map_err(|source| format!("cannot read: {source}"))? == 0 || !line.ends_with(b"\n") {
            return Err("the header of a PFM file is cut off".into());
        }
        let line = String::from_utf8_lossy(&line).into_owned();
        words.extend(line.split_whitespace().map(str::to_owned));
    }
    let expected = || {
        format!(
            "the header says '{}': expected 'Pf', width, height and scale",
            words.join(" ")
        )
    };
    match words.as_slice() {
        [kind, width, height, scale] if kind == "Pf" => {
            let scale: f64 = scale.parse().map_err(|_| expected())?;
            let side = |word: &str| word.parse().map_err(|_| expected());
            Ok(Header {
                size: [side(width)?, side(height)?],
                big_endian: scale > 0.0,
            })
        }
        [kind, ..] if kind == "PF" => {
            Err("a PFM file of colours: depth has one number per pixel ('Pf')".into())
        }
        _ => Err(expected()),
    }
}
