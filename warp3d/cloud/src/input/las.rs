//! LAS 1.0 to 1.4, plain or packed as LAZ.
//!
//! Takes a path, gives points with intensities, classes and, where the point format has them, colours. Places are whole numbers
//! times the header's scale plus its offset. Source: the LAS specification of the ASPRS, 1.4 R15; LAZ is unpacked by `laz`.
//! Limits: waveforms, times, returns and additional bytes are left out.

use resample_core::narrow;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use resample_io::files::open_regular;

use super::collect::{Collector, Colours, Has};
use super::file::{CloudLoadOptions, PointCloudFile};
use super::las_header::{Header, RED};
use super::laz::{self, Packed};

/// Bytes of points that are read at once: they stay in the processor's second cache.
const PIECE_BYTES: usize = 1 << 18;

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
