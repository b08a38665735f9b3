//! LAS 1.0 to 1.4, plain or packed as LAZ.
//!
//! Takes a path, gives points with intensities, classes and, where the point format has them, colours. Places are whole numbers
//! times the header's scale plus its offset. Source: the LAS specification of the ASPRS, 1.4 R15; LAZ is unpacked by `laz`.
//! Limits: waveforms, times, returns and additional bytes are left out.

use resample_core::narrow;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use glam::DVec3;
use resample_io::files::open_regular;

use super::collect::{Collector, Colours, Has, Point};
use super::laz::{self, Packed};
use super::{CloudLoadOptions, PointCloudFile};

/// The first bytes of a file.
pub(super) const MAGIC: &[u8] = b"LASF";

/// Bytes of the header of version 1.2 and of 1.4.
const HEADER_BYTES: usize = 227;
const LONG_HEADER_BYTES: usize = 375;

/// Bytes before the content of a record between header and points.
const RECORD_HEAD_BYTES: u64 = 54;

/// Bytes of a point of each format from 0 to 10, without additional ones.
const POINT_BYTES: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Where red is in a point of each format; 0 where it has no colour.
const RED: [usize; 11] = [0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30];

/// Bytes of points that are read at once: they stay in the processor's second cache.
const PIECE_BYTES: usize = 1 << 18;

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
    fn packing(&self, file: &mut (impl Read + Seek)) -> Result<Vec<u8>, String> {
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
            if head[2..].starts_with(laz::USER) && number == laz::RECORD {
                let mut content = vec![0; usize::from(length)];
                file.read_exact(&mut content).map_err(broken)?;
                return Ok(content);
            }
            place += RECORD_HEAD_BYTES + u64::from(length);
        }
        Err("its points are packed, but no record says how: the file is damaged".to_owned())
    }

    fn point(&self, bytes: &[u8]) -> Point {
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

/// Reads a file.
pub(super) fn load(path: &Path, options: &CloudLoadOptions) -> Result<PointCloudFile, String> {
    let (file, held) = open_regular(path).map_err(|error| format!("cannot be read: {error}"))?;
    let mut file = BufReader::with_capacity(PIECE_BYTES, file);
    let header = Header::read(&mut file)?;
    let bytes = header.count.saturating_mul(header.point_bytes as u64);
    let left = held.saturating_sub(header.begin);
    let packed = match header.is_packed {
        true => {
            // The points are thinned on their way, so that only a claim far beyond the file is refused here.
            let claimed = bytes.min(options.gate.max_memory());
            options.gate.ask_unpacked(claimed, held, "the points")?;
            Some(Packed::new(&header.packing(&mut file)?, &header)?)
        }
        false if bytes > left => {
            return Err(format!(
                "its header says {} points of {} bytes, but {left} bytes are left: the file is cut off or its header is wrong",
                header.count, header.point_bytes
            ));
        }
        false => None,
    };
    let has = Has {
        colours: if RED[header.format] > 0 {
            Colours::Bits16
        } else {
            Colours::None
        },
        intensities: true,
        classes: true,
        ..Has::default()
    };
    let beside = packed.as_ref().map_or(0, |_| laz::BATCH_BYTES);
    let mut collector = Collector::new(header.count, has, beside, options)?;
    let mut take = |bytes: &[u8]| {
        for point in bytes.chunks_exact(header.point_bytes) {
            if collector.wants_next() {
                collector.take(&header.point(point));
            }
        }
    };
    match packed {
        Some(packed) => packed.each(&mut file, held, &header, &mut take)?,
        None => plain(&mut file, &header, &mut take)?,
    }
    collector.finish()
}

fn plain(
    file: &mut BufReader<File>,
    header: &Header,
    take: &mut dyn FnMut(&[u8]),
) -> Result<(), String> {
    let broken = |error| format!("the points cannot be read: {error}");
    file.seek(SeekFrom::Start(header.begin)).map_err(broken)?;
    let at_once = (PIECE_BYTES / header.point_bytes).max(1) as u64;
    let mut piece = Vec::new();
    let mut left = header.count;
    while left > 0 {
        let count = left.min(at_once);
        piece.resize(narrow::count(count) * header.point_bytes, 0);
        file.read_exact(&mut piece).map_err(broken)?;
        take(&piece);
        left -= count;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
