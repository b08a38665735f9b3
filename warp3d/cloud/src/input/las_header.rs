//! The header of LAS 1.0 to 1.4, and a point of each format.
//!
//! Takes the first bytes of a file, gives the facts that the readers of plain and of packed points need.

use std::io::{Read, Seek, SeekFrom};

use glam::DVec3;

use super::collect::Point;

/// The first bytes of a file.
pub(super) const MAGIC: &[u8] = b"LASF";

/// Bytes of the header of version 1.2 and of 1.4.
pub(super) const HEADER_BYTES: usize = 227;
pub(super) const LONG_HEADER_BYTES: usize = 375;

/// Bytes before the content of a record between header and points.
const RECORD_HEAD_BYTES: u64 = 54;

/// Bytes of a point of each format from 0 to 10, without additional ones.
pub(super) const POINT_BYTES: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Where red is in a point of each format; 0 where it has no colour.
pub(super) const RED: [usize; 11] = [0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30];

/// The user and the number of the record.
pub(super) const USER: &[u8] = b"laszip encoded\0\0";

pub(super) const RECORD: u16 = 22_204;

/// The facts of the header.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    /// Number of the point format.
    pub(super) format: usize,
    pub(super) is_packed: bool,
    /// Bytes of a point.
    pub(super) point_bytes: usize,
    pub(super) count: u64,
    /// The place of the first point in the file.
    pub(super) begin: u64,
    header_bytes: u64,
    records: u32,
    scale: DVec3,
    offset: DVec3,
}

/// Little-endian numbers at places of some bytes.
pub(super) fn bytes_at<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    std::array::from_fn(|byte| bytes[at + byte])
}

impl Header {
    pub(super) fn read(file: &mut impl Read) -> Result<Self, String> {
        let mut head = Vec::new();
        let read = file.take(LONG_HEADER_BYTES as u64).read_to_end(&mut head);
        read.map_err(|error| format!("cannot be read: {error}"))?;
        if head.len() < HEADER_BYTES || !head.starts_with(MAGIC) {
            return Err(format!(
                "its header has {} bytes: expected LAS with at least {HEADER_BYTES}",
                head.len()
            ));
        }
        let word = |at: usize| u32::from_le_bytes(bytes_at(&head, at));
        let short = |at: usize| u16::from_le_bytes(bytes_at(&head, at));
        let vector = |at: usize| {
            let number = |axis: usize| f64::from_le_bytes(bytes_at(&head, at + 8 * axis));
            DVec3::new(number(0), number(1), number(2))
        };
        let [major, minor] = [head[24], head[25]];
        if major != 1 || minor > 4 {
            return Err(format!(
                "version {major}.{minor} of LAS: 1.0 to 1.4 are read"
            ));
        }
        let is_long = minor == 4 && head.len() == LONG_HEADER_BYTES;
        let long_count = if is_long {
            u64::from_le_bytes(bytes_at(&head, 247))
        } else {
            0
        };
        let header = Self {
            format: usize::from(head[104] & 0x3f),
            is_packed: head[104] & 0x80 != 0,
            point_bytes: usize::from(short(105)),
            count: if long_count > 0 {
                long_count
            } else {
                u64::from(word(107))
            },
            begin: u64::from(word(96)),
            header_bytes: u64::from(short(94)),
            records: word(100),
            scale: vector(131),
            offset: vector(155),
        };
        header.check()?;
        Ok(header)
    }

    fn check(&self) -> Result<(), String> {
        let Some(least) = POINT_BYTES.get(self.format) else {
            return Err(format!("point format {}: 0 to 10 are read", self.format));
        };
        if self.point_bytes < *least {
            return Err(format!(
                "its header says {} bytes a point: format {} has at least {least}",
                self.point_bytes, self.format
            ));
        }
        if !(self.scale.is_finite() && self.offset.is_finite()) {
            return Err(format!(
                "its scale is {} and its offset {}: expected finite numbers",
                self.scale, self.offset
            ));
        }
        Ok(())
    }

    /// The content of the record of LAZ.
    pub(super) fn packing(&self, file: &mut (impl Read + Seek)) -> Result<Vec<u8>, String> {
        let broken =
            |error: std::io::Error| format!("a record before the points cannot be read: {error}");
        let mut place = self.header_bytes;
        for _ in 0..self.records {
            if place + RECORD_HEAD_BYTES > self.begin {
                break;
            }
            file.seek(SeekFrom::Start(place)).map_err(broken)?;
            let mut head = [0; RECORD_HEAD_BYTES as usize];
            file.read_exact(&mut head).map_err(broken)?;
            let [number, length] = [18, 20].map(|at| u16::from_le_bytes(bytes_at(&head, at)));
            if head[2..].starts_with(USER) && number == RECORD {
                let mut content = vec![0; usize::from(length)];
                file.read_exact(&mut content).map_err(broken)?;
                return Ok(content);
            }
            place += RECORD_HEAD_BYTES + u64::from(length);
        }
        Err("its points are packed, but no record says how: the file is damaged".to_owned())
    }

    pub(super) fn point(&self, bytes: &[u8]) -> Point {
        let number = |axis: usize| f64::from(i32::from_le_bytes(bytes_at(bytes, 4 * axis)));
        let short = |at: usize| u16::from_le_bytes(bytes_at(bytes, at));
        let class = match self.format {
            0..=5 => bytes[15] & 0x1f,
            _ => bytes[16],
        };
        let colour = match RED[self.format] {
            0 => [0; 3],
            red => [short(red), short(red + 2), short(red + 4)],
        };
        Point {
            place: DVec3::new(number(0), number(1), number(2)) * self.scale + self.offset,
            colour,
            intensity: f32::from(short(12)),
            class,
            ..Point::default()
        }
    }
}
