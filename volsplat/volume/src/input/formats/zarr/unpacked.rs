//! The bytes of chunks, unpacked within the size that they must have, and a whole array unpacked into a file.
//!
//! An array that is larger than memory is unpacked once, chunk by chunk, into a nameless temporary file with its scalars, x fastest, in
//! the byte order of the array. A
//! chunk rarely ends where a brick does, and bricks are read again and again: unpacking each chunk once costs less than
//! any cache that fits the memory, and needs no lock. The file lies in the folder that `TMPDIR` names, takes as much as
//! the plain voxels (parts that were never written take nothing where the file system knows holes), and goes with the process.
//! Limits: systems with positioned writes. A `TMPDIR` in memory (tmpfs) saves none. The names of the chunks are held as
//! well, some 200 bytes for each.

use std::fs::File;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::Error;
use crate::input::decode::Layout;
use crate::input::decode::stored::Stored;
use crate::input::formats::zarr::codecs;
use crate::input::formats::zarr::codecs::{PlaceIn, copy_box, len};
use crate::input::formats::zarr::opened::{Common, Opened, chunks_of};
use crate::input::invalid;
use crate::source::Watch;
use crate::volume::NanPolicy;

/// Times that a chunk is held: packed as read, once more while it is undone, and unpacked; or packed, unpacked, and cut to
/// what is wanted. While a stream of unknown length grows it takes up to twice more, which the other half of the memory
/// has room for.
const COPIES: u64 = 3;

/// Bytes of fill that are written at once.
const FILL_BYTES: usize = 1 << 20;

/// Chunks that each thread unpacks between two words of how far it is.
const GROUP: usize = 4;

impl Opened {
    /// The voxels in a temporary file; see `unpacked`.
    pub(crate) fn unpack(
        &self,
        max_memory: u64,
        watch: &mut Watch,
        nan: NanPolicy,
    ) -> Result<Stored, Error> {
        let file = unpack(self, max_memory, watch)?;
        let dims = self.lattice.dims;
        let layout = Layout {
            voxel_type: self.array.voxel_type,
            endian: self.array.codecs.endian,
            count: dims.iter().product(),
        };
        Ok(Stored::of_file(&self.folder, file, dims, &layout, nan))
    }
}

/// Unpacks an array while holding at most about half of `max_memory`.
fn unpack(opened: &Opened, max_memory: u64, watch: &mut Watch) -> Result<File, Error> {
    let folder = &opened.folder;
    let element = opened.array.voxel_type.bytes();
    let sizes: Vec<usize> = opened.spans.iter().map(|span| span.size).collect();
    let bytes = len(&sizes).and_then(|count| count.checked_mul(element));
    let bytes =
        bytes.ok_or_else(|| invalid(folder, "more voxels than this machine can count"))? as u64;
    let chunks = chunks_of(opened, &opened.spans)?;
    let chunk_bytes = chunk_bytes(opened, &chunks)?;
    if COPIES * chunk_bytes > max_memory / 2 {
        return Err(Error::Option(format!(
            "{max_memory} bytes of memory are too little for {}: its chunks take {chunk_bytes} bytes each, and six times \
             that is needed to unpack one",
            folder.display()
        )));
    }
    let failed = |source: std::io::Error| {
        Error::Option(format!(
            "{}: cannot be unpacked into {bytes} bytes of a temporary file: {source}; give TMPDIR a folder with room, or \
             allow more memory",
            folder.display()
        ))
    };
    let file = tempfile::tempfile().map_err(failed)?;
    fill(&file, &opened.array.fill, bytes).map_err(failed)?;
    let one = |(index, path): &Chunk| {
        let (part, rows) = unpacked(opened, index, path)?;
        rows.into_iter()
            .zip(part.bytes.chunks_exact(part.row_bytes))
            .try_for_each(|(place, row)| {
                write_all_at(&file, row, (place * element) as u64).map_err(failed)
            })
    };
    // Each thread holds a chunk.
    let threads = rayon::current_num_threads();
    let all_at_once = threads as u64 * COPIES * chunk_bytes <= max_memory / 2;
    let mut done = 0;
    for group in chunks.chunks(GROUP * threads) {
        if all_at_once {
            group.par_iter().try_for_each(one)?;
        } else {
            group.iter().try_for_each(one)?;
        }
        done += group.len();
        watch(done as f64 / chunks.len() as f64);
    }
    Ok(file)
}

/// Most bytes that a chunk takes, unpacked or in its file: nothing keeps a broken file from being the larger.
fn chunk_bytes(opened: &Opened, chunks: &[Chunk]) -> Result<u64, Error> {
    // The product has been checked when the array was read.
    let unpacked = opened.array.chunk.iter().product::<usize>() * opened.array.voxel_type.bytes();
    chunks.iter().try_fold(unpacked as u64, |most, (_, path)| {
        Ok(most.max(opened.store.bytes(path)?))
    })
}

/// The place of a chunk and its file.
type Chunk = (Vec<usize>, PathBuf);

/// The wanted part of a chunk: rows along x.
struct Part {
    bytes: Vec<u8>,
    row_bytes: usize,
}

/// The wanted part of a chunk, and where in the volume each of its rows begins, in voxels.
fn unpacked(opened: &Opened, index: &[usize], path: &Path) -> Result<(Part, Vec<usize>), Error> {
    let (array, spans) = (&opened.array, &opened.spans);
    let packed = opened.store.read(path)?;
    let chunk = codecs::unpack(&array.codecs, &array.chunk, &packed, &array.fill);
    let chunk = chunk.map_err(|fault| fault.at(path))?;
    let Common { size, from, to } = Common::new(array, spans, index);
    let element = array.voxel_type.bytes();
    let count: usize = size.iter().product();
    let mut bytes = vec![0; count * element];
    copy_box(
        &PlaceIn {
            bytes: chunk.as_slice(),
            shape: &array.chunk,
            at: &from,
        },
        &mut PlaceIn {
            bytes: bytes.as_mut_slice(),
            shape: &size,
            at: &vec![0; size.len()],
        },
        &size,
        element,
    );
    // Axes that are not of space have one place, so that the last axis of space is the fastest, wherever it stands.
    let x = opened.last_axis;
    let row = size[x];
    let place = |number: usize| {
        let mut rest = number * row;
        let mut at = to.clone();
        for axis in (0..size.len()).rev() {
            at[axis] += rest % size[axis];
            rest /= size[axis];
        }
        at.iter()
            .zip(spans)
            .fold(0, |place, (at, span)| place * span.size + at)
    };
    let rows = (0..count / row).map(place).collect();
    Ok((
        Part {
            bytes,
            row_bytes: row * element,
        },
        rows,
    ))
}

/// Makes a file of elements that were never written.
fn fill(file: &File, element: &[u8], bytes: u64) -> std::io::Result<()> {
    file.set_len(bytes)?;
    if element.iter().all(|byte| *byte == 0) {
        return Ok(());
    }
    let block = element.repeat(FILL_BYTES / element.len());
    let mut place = 0;
    while place < bytes {
        let part = (bytes - place).min(block.len() as u64) as usize;
        write_all_at(file, &block[..part], place)?;
        place += part as u64;
    }
    Ok(())
}

#[cfg(unix)]
fn write_all_at(file: &File, bytes: &[u8], place: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, place)
}

/// Elsewhere a nameless file has one position, which threads cannot share.
#[cfg(not(unix))]
fn write_all_at(_: &File, _: &[u8], _: u64) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}
