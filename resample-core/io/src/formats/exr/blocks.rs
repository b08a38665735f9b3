//! The pixels of an EXR file, block by block.
//!
//! Takes some channels, gives pieces of rows of them, side by side, on the display window. A block is some scan lines or
//! a tile, and only one is held at a time. Channels of different parts never share a block: those are held whole.

use std::io::BufReader;
use std::path::Path;

use ::exr::block::lines::LineRef;
use ::exr::block::reader::ChunksReader;
use ::exr::block::{self, UncompressedBlock};
use ::exr::math::Vec2;
use ::exr::meta::attribute::SampleType;
use ::exr::meta::header::Header;
use ::exr::prelude::f16;

use super::dwa;
use super::header::{At, headers};
use crate::files::{fault, open};
use crate::receiver::Room;
use resample_core::Error;

/// Takes a piece of a row: column and row of its first pixel, and the numbers of each channel.
pub(crate) type Emit<'a> = dyn FnMut([usize; 2], &[Vec<f32>]) -> Result<(), Error> + 'a;

/// Width and height of the display window, px.
pub(crate) fn display_size(headers: &[Header]) -> [usize; 2] {
    headers.first().map_or([0; 2], |header| {
        let size = header.shared_attributes.display_window.size;
        [size.width(), size.height()]
    })
}

/// Gives the `wanted` channels to `emit`, in the order of the file's blocks.
pub(crate) fn pieces(
    path: &Path,
    wanted: &[At],
    room: Room,
    emit: &mut Emit<'_>,
) -> Result<(), Error> {
    let Some(&At { layer, .. }) = wanted.first() else {
        return Ok(());
    };
    if wanted.iter().all(|at| at.layer == layer) {
        return pieces_of_layer(path, wanted, room, emit);
    }
    // One after the other into memory, then row by row.
    let mut planes: Vec<Vec<f32>> = Vec::new();
    let mut size = [0; 2];
    for at in wanted {
        size = display_size(&headers(path)?);
        let bytes = (size[0] * size[1] * 4 * wanted.len()) as u64;
        room.check(
            path,
            bytes,
            "an EXR file whose colours lie in several parts",
        )?;
        let mut plane = vec![f32::NAN; size[0] * size[1]];
        pieces_of_layer(path, &[*at], room, &mut |[x, y], values| {
            let first = y * size[0] + x;
            plane[first..first + values[0].len()].copy_from_slice(&values[0]);
            Ok(())
        })?;
        planes.push(plane);
    }
    for y in 0..size[1] {
        let row = |plane: &Vec<f32>| plane[y * size[0]..(y + 1) * size[0]].to_vec();
        emit([0, y], &planes.iter().map(row).collect::<Vec<_>>())?;
    }
    Ok(())
}

fn pieces_of_layer(
    path: &Path,
    wanted: &[At],
    room: Room,
    emit: &mut Emit<'_>,
) -> Result<(), Error> {
    let wrong = |error: ::exr::error::Error| fault(path, format!("not a usable EXR file: {error}"));
    let layer = wanted[0].layer;
    let (file, _) = open(path)?;
    let reader = block::read(BufReader::new(file), false).map_err(wrong)?;
    let header = reader.headers().get(layer).cloned();
    let header = header.ok_or_else(|| fault(path, "the file has changed while it was read"))?;
    if header.deep {
        return Err(fault(
            path,
            "deep data is not read: flatten it to one sample a pixel",
        ));
    }
    if header
        .channels
        .list
        .iter()
        .any(|channel| channel.sampling != Vec2(1, 1))
    {
        return Err(fault(
            path,
            "sub-sampled channels are not read: save all channels at full resolution",
        ));
    }
    // A block packed and unpacked, and once more between two steps of unpacking.
    room.check(
        path,
        3 * header.max_block_byte_size() as u64,
        "a block of this EXR file",
    )?;
    let on_display = OnDisplay::new(&header, wanted);
    let largest = |level: Vec2<usize>| level == Vec2(0, 0);
    let chunks = reader
        .filter_chunks(false, |_, tile, block| {
            block.layer == layer && largest(tile.level_index)
        })
        .map_err(wrong)?;
    let meta = chunks.meta_data().clone();
    for chunk in chunks {
        let chunk = chunk.map_err(wrong)?;
        dwa::check(&chunk, &meta.headers).map_err(|what| fault(path, what))?;
        let block = UncompressedBlock::decompress_chunk(chunk, &meta, false).map_err(wrong)?;
        on_display.emit(path, &block, emit)?;
    }
    Ok(())
}

/// Where the data window lies on the display window, and which of its channels are wanted there.
struct OnDisplay<'a> {
    header: &'a Header,
    wanted: &'a [At],
    /// Place of the first pixel of the data on the display.
    shift: [i64; 2],
    size: [usize; 2],
}

impl<'a> OnDisplay<'a> {
    fn new(header: &'a Header, wanted: &'a [At]) -> Self {
        let (display, data) = (
            header.shared_attributes.display_window,
            header.own_attributes.layer_position,
        );
        let shift = |data: i32, display: i32| i64::from(data) - i64::from(display);
        Self {
            header,
            wanted,
            shift: [
                shift(data.x(), display.position.x()),
                shift(data.y(), display.position.y()),
            ],
            size: [display.size.width(), display.size.height()],
        }
    }

    /// Gives the rows of a block that lie on the display.
    fn emit(
        &self,
        path: &Path,
        block: &UncompressedBlock,
        emit: &mut Emit<'_>,
    ) -> Result<(), Error> {
        let (header, wanted) = (self.header, self.wanted);
        let mut values: Vec<Vec<f32>> = vec![Vec::new(); wanted.len()];
        let last = header.channels.list.len() - 1;
        for line in block.lines(&header.channels) {
            let location = line.location;
            let Some((at, columns)) = self.clipped(location.position, location.sample_count) else {
                continue;
            };
            for (value, _) in values
                .iter_mut()
                .zip(wanted)
                .filter(|(_, at)| at.channel == location.channel)
            {
                let sample_type = header.channels.list[location.channel].sample_type;
                *value = numbers(&line, sample_type)
                    .map_err(|error| fault(path, format!("not a usable EXR file: {error}")))?;
                value.truncate(columns.end);
                value.drain(..columns.start);
            }
            // The lines of all channels of a row follow one another.
            if location.channel == last {
                emit(at, &values)?;
            }
        }
        Ok(())
    }

    /// Where on the display a line begins, and which of its pixels lie there.
    fn clipped(
        &self,
        position: Vec2<usize>,
        count: usize,
    ) -> Option<([usize; 2], std::ops::Range<usize>)> {
        let left = position.x() as i64 + self.shift[0];
        let y = usize::try_from(position.y() as i64 + self.shift[1])
            .ok()
            .filter(|&y| y < self.size[1])?;
        let first = (-left).clamp(0, count as i64) as usize;
        let end = (self.size[0] as i64 - left).clamp(0, count as i64) as usize;
        (first < end).then(|| ([(left + first as i64) as usize, y], first..end))
    }
}

fn numbers(line: &LineRef<'_>, sample_type: SampleType) -> ::exr::error::Result<Vec<f32>> {
    match sample_type {
        SampleType::F16 => line
            .read_samples::<f16>()
            .map(|v| v.map(f16::to_f32))
            .collect(),
        SampleType::F32 => line.read_samples::<f32>().collect(),
        SampleType::U32 => line
            .read_samples::<u32>()
            .map(|v| v.map(|v| v as f32))
            .collect(),
    }
}
