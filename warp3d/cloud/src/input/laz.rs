//! The points of LAZ, unpacked chunk by chunk on all processors.
//!
//! Takes the content of the record that says how the points are packed, gives the bytes of points as LAS has them. The crate `laz`
//! unpacks a chunk; the sizes that it would allocate by are held against the chunk first, and a panic of it is an error.
//! Source: the description of LAZ by M. Isenburg (LASzip, 2013).

use resample_core::narrow;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};

use ::laz::laszip::ChunkTable;
use ::laz::record::{
    LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor,
};
use ::laz::{LazItem, LazItemType, LazVlr};
use rayon::prelude::*;

use super::las_header::{Header, bytes_at};

/// Chunks that are unpacked at the same time, bytes of points at most.
pub(super) const BATCH_BYTES: u64 = 64 << 20;

/// Points of a larger chunk are unpacked in pieces, bytes.
const PIECE_BYTES: usize = 1 << 20;

/// How the chunks are packed; the numbers are the format's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// All points in one chunk, and no table of chunks.
    Whole,
    /// Point after point.
    Pointwise,
    /// A layer for each part of a point.
    Layered,
}

/// How the points are packed.
pub(super) struct Packed {
    kind: Kind,
    vlr: LazVlr,
    point_bytes: usize,
}

/// A chunk of the file.
struct Chunk {
    bytes: Vec<u8>,
    points: u64,
}

impl Packed {
    pub(super) fn new(record: &[u8], header: &Header) -> Result<Self, String> {
        let number = record
            .get(..2)
            .map(|bytes| u16::from_le_bytes(bytes_at(bytes, 0)));
        let kind = match number {
            Some(1) => Kind::Whole,
            Some(2) => Kind::Pointwise,
            Some(3) => Kind::Layered,
            other => {
                return Err(format!(
                    "its points are packed by kind {other:?}: expected 1 to 3"
                ));
            }
        };
        let vlr = LazVlr::from_buffer(record);
        let vlr =
            vlr.map_err(|error| format!("the record of the packing cannot be read: {error}"))?;
        let bytes: u64 = vlr.items().iter().map(|item| u64::from(item.size())).sum();
        if vlr.items().is_empty() || bytes != header.point_bytes as u64 {
            return Err(format!(
                "the record of the packing has points of {bytes} bytes, the header of {}: the file is damaged",
                header.point_bytes
            ));
        }
        let is_layered = |item: &LazItem| item.version() >= 3;
        if vlr
            .items()
            .iter()
            .any(|item| is_layered(item) != (kind == Kind::Layered))
        {
            return Err(
                "the record of the packing contradicts itself: the file is damaged".to_owned(),
            );
        }
        Ok(Self {
            kind,
            vlr,
            point_bytes: header.point_bytes,
        })
    }

    /// Hands over the bytes of all points, in order.
    pub(super) fn each(
        &self,
        file: &mut BufReader<File>,
        held: u64,
        header: &Header,
        take: &mut dyn FnMut(&[u8]),
    ) -> Result<(), String> {
        let sizes = self.chunks(file, held, header)?;
        let at_once = rayon::current_num_threads().max(1);
        let mut rest = sizes.as_slice();
        while !rest.is_empty() {
            let mut room = BATCH_BYTES;
            let fits = |(_, points): &&(u64, u64)| {
                let bytes = points.saturating_mul(self.point_bytes as u64);
                let fits = bytes <= room;
                room = room.saturating_sub(bytes);
                fits
            };
            let count = rest.iter().take(at_once).take_while(fits).count();
            let (batch, later) = rest.split_at(count.max(1));
            rest = later;
            let batch: Result<Vec<Chunk>, String> = batch
                .iter()
                .map(|(bytes, points)| chunk(file, *bytes, *points))
                .collect();
            let batch = batch?;
            if count == 0 {
                batch
                    .iter()
                    .try_for_each(|chunk| self.unpack(chunk, take))?;
                continue;
            }
            let unpacked = batch.par_iter().map(|chunk| {
                let mut all = Vec::new();
                self.unpack(chunk, &mut |bytes| all.extend_from_slice(bytes))?;
                Ok(all)
            });
            let unpacked: Result<Vec<Vec<u8>>, String> = unpacked.collect();
            unpacked?.iter().for_each(|bytes| take(bytes));
        }
        Ok(())
    }

    /// The bytes and points of each chunk; leaves the file at the first one.
    fn chunks(
        &self,
        file: &mut BufReader<File>,
        held: u64,
        header: &Header,
    ) -> Result<Vec<(u64, u64)>, String> {
        let broken = |error: std::io::Error| format!("the table of chunks cannot be read: {error}");
        file.seek(SeekFrom::Start(header.begin)).map_err(broken)?;
        let left = held.saturating_sub(header.begin);
        if self.kind == Kind::Whole {
            return Ok(vec![(left, header.count)]);
        }
        let mut place = word_of(file).map_err(broken)?;
        if place == u64::MAX {
            // A program that could not go back wrote it at the end.
            file.seek(SeekFrom::End(-8)).map_err(broken)?;
            place = word_of(file).map_err(broken)?;
        }
        file.seek(SeekFrom::Start(place)).map_err(broken)?;
        let count = word_of(file).map_err(broken)? >> 32;
        // Each chunk begins with a point as it is.
        if count.saturating_mul(self.point_bytes as u64) > left {
            return Err(format!(
                "the table says {count} chunks, more than {left} bytes can hold: the file is damaged"
            ));
        }
        file.seek(SeekFrom::Start(place)).map_err(broken)?;
        let is_variable = self.vlr.uses_variable_size_chunks();
        let table = guarded(|| ChunkTable::read(file, is_variable).map_err(broken))?;
        file.seek(SeekFrom::Start(header.begin + 8))
            .map_err(broken)?;
        let (mut bytes_left, mut points_left) = (left, header.count);
        let mut chunks = Vec::with_capacity(table.len());
        for entry in &table {
            let said = if is_variable {
                entry.point_count
            } else {
                u64::from(self.vlr.chunk_size())
            };
            let points = said.min(points_left);
            if entry.byte_count > bytes_left {
                return Err(format!(
                    "a chunk has {} bytes, {bytes_left} are left: the file is damaged",
                    entry.byte_count
                ));
            }
            bytes_left -= entry.byte_count;
            points_left -= points;
            chunks.push((entry.byte_count, points));
        }
        if points_left > 0 {
            return Err(format!(
                "its chunks lack {points_left} of the {} points: the file is cut off",
                header.count
            ));
        }
        Ok(chunks)
    }

    fn unpack(&self, chunk: &Chunk, take: &mut dyn FnMut(&[u8])) -> Result<(), String> {
        if chunk.points == 0 {
            return Ok(());
        }
        self.check_layers(chunk)?;
        let input = Cursor::new(chunk.bytes.as_slice());
        guarded(|| match self.kind {
            Kind::Layered => self.points(LayeredPointRecordDecompressor::new(input), chunk, take),
            _ => self.points(SequentialPointRecordDecompressor::new(input), chunk, take),
        })
    }

    fn points<'a>(
        &self,
        mut unpacker: impl RecordDecompressor<Cursor<&'a [u8]>>,
        chunk: &Chunk,
        take: &mut dyn FnMut(&[u8]),
    ) -> Result<(), String> {
        let known = unpacker.set_fields_from(self.vlr.items());
        known.map_err(|error| format!("its points cannot be unpacked: {error}"))?;
        let at_once = (PIECE_BYTES / self.point_bytes).max(1) as u64;
        let mut piece = Vec::new();
        let mut left = chunk.points;
        while left > 0 {
            let count = left.min(at_once);
            piece.resize(narrow::count(count) * self.point_bytes, 0);
            let read = unpacker.decompress_many(&mut piece);
            read.map_err(|error| format!("a chunk of points cannot be unpacked: {error}"))?;
            take(&piece);
            left -= count;
        }
        Ok(())
    }

    /// Holds the sizes of layers against their chunk: a point, the number of points, and the sizes come first.
    fn check_layers(&self, chunk: &Chunk) -> Result<(), String> {
        if self.kind != Kind::Layered {
            return Ok(());
        }
        let layers = |item: &LazItem| match item.item_type() {
            LazItemType::Point14 => 9,
            LazItemType::RGBNIR14 => 2,
            LazItemType::Byte14(bytes) => usize::from(bytes),
            _ => 1,
        };
        let count: usize = self.vlr.items().iter().map(layers).sum();
        let first = self.point_bytes + 4;
        let sizes = chunk.bytes.get(first..first + 4 * count);
        let sizes =
            sizes.ok_or("a chunk ends before the sizes of its layers: the file is damaged")?;
        let sizes = sizes
            .chunks_exact(4)
            .map(|word| u64::from(u32::from_le_bytes(bytes_at(word, 0))));
        let (sum, held) = (
            sizes.sum::<u64>(),
            (chunk.bytes.len() - first - 4 * count) as u64,
        );
        match sum <= held {
            true => Ok(()),
            false => Err(format!(
                "the layers of a chunk have {sum} bytes, {held} are there: the file is damaged"
            )),
        }
    }
}

fn word_of(file: &mut impl Read) -> std::io::Result<u64> {
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}

fn chunk(file: &mut BufReader<File>, bytes: u64, points: u64) -> Result<Chunk, String> {
    let mut content = Vec::new();
    let got = file.take(bytes).read_to_end(&mut content);
    let got = got.map_err(|error| format!("a chunk of points cannot be read: {error}"))?;
    match got as u64 == bytes {
        true => Ok(Chunk {
            bytes: content,
            points,
        }),
        false => Err("a chunk of points ends early: the file is cut off".to_owned()),
    }
}

/// A panic of the crate `laz` means data that it did not expect.
fn guarded<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let read = catch_unwind(AssertUnwindSafe(read));
    read.unwrap_or_else(|_| Err("its packed points are damaged".to_owned()))
}
