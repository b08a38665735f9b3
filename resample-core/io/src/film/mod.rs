//! Films, by way of the programs `ffprobe` and `ffmpeg`.
//!
//! [`Facts`] are the size, rate, colours and sound of a film; [`Reader`] reads its pictures in order; [`Writer`] writes pictures into a new film. The two programs stay outside: they are started with pipes, their error output is shown when they fail, and
//! they are stopped when what holds them is dropped.
//! Source: the manuals of ffmpeg and ffprobe.
//! Limits: the first video stream of a file; a film of a varying frame rate is read at its nominal rate.

mod child;
mod facts;
mod read;
mod spatial;
mod write;

use std::path::Path;

pub use child::check_tool;
pub use facts::{ColourTags, Facts, FrameRate};
pub use read::{Kept, Reader, Want};
pub use spatial::{Directions, Pair, Spatial};
pub use write::{Coding, Container, Original, Part, Writer, join};

use crate::files;

/// Bytes at the start of a file that tell whether it is a film: of a transport stream, three packets begin in them.
const MAGIC_BYTES: u64 = 400;

/// Returns true if the file at `path` begins as films do; false if it does not, or cannot be read.
pub fn is_film(path: &Path) -> bool {
    let Ok(start) = files::first_bytes(path, MAGIC_BYTES) else {
        return false;
    };
    let at = |place: usize, bytes: &[u8]| start.get(place..).is_some_and(|s| s.starts_with(bytes));
    // Pictures share the container of MP4 files; their brands say so.
    let is_still = [&b"heic"[..], b"heix", b"mif1", b"avif"]
        .iter()
        .any(|brand| at(8, brand));
    let is_mp4 = [&b"ftyp"[..], b"moov", b"mdat", b"wide"]
        .iter()
        .any(|name| at(4, name));
    let is_transport = [0, 188, 376].iter().all(|&place| at(place, &[0x47]));
    (is_mp4 && !is_still)
        || is_transport
        || at(0, &[0x1a, 0x45, 0xdf, 0xa3])
        || (at(0, b"RIFF") && at(8, b"AVI "))
        || at(0, b"OggS")
        || at(0, b"FLV\x01")
        || at(0, &[0, 0, 1, 0xba])
        || at(0, b"YUV4MPEG2 ")
        || at(0, b"nut/multimedia container")
        || at(0, &[0x30, 0x26, 0xb2, 0x75, 0x8e, 0x66, 0xcf, 0x11])
}

#[cfg(test)]
mod tests;
