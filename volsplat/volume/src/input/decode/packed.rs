//! A file that may be packed by gzip as a whole: its bytes, unpacked while they are read.

use std::fs::File;
use std::io;
use std::io::{BufReader, Read};
use std::path::Path;

use resample_io::Gate;

use crate::Error;
use crate::input::{cannot_read, decode, open, open_sized};

/// The first two bytes of a gzip file.
pub(crate) const GZIP_MAGIC: &[u8] = &[0x1f, 0x8b];

/// A file, unpacked if it is packed.
pub(crate) struct Stream {
    pub(crate) bytes: Box<dyn Read>,
    pub(crate) is_packed: bool,
    /// Bytes of the file that are not read yet; of a packed one, its whole length.
    pub(crate) held: u64,
}

impl Stream {
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let (file, held) = open_sized(path)?;
        let is_packed = is_gzip(path)?;
        let file = BufReader::new(file);
        let bytes: Box<dyn Read> = if is_packed {
            Box::new(flate2::bufread::MultiGzDecoder::new(file))
        } else {
            Box::new(file)
        };
        Ok(Self {
            bytes,
            is_packed,
            held,
        })
    }

    /// Passes over the bytes from `begin`, where the stream stands, to `end`, where the image begins.
    pub(crate) fn skip(&mut self, begin: u64, end: u64, gate: &Gate) -> Result<(), String> {
        let bytes = end - begin;
        if self.is_packed {
            gate.ask_unpacked(bytes, self.held, "the bytes before the voxels")?;
        }
        let skipped = self.copied(bytes)?;
        if skipped < bytes {
            return Err("vox_offset lies behind the end of the file".to_owned());
        }
        if !self.is_packed {
            self.held = self.held.saturating_sub(end);
        }
        Ok(())
    }

    /// Passes over the volumes before the one that is read.
    pub(crate) fn pass(&mut self, bytes: u64) -> Result<(), String> {
        let passed = self.copied(bytes)?;
        if passed < bytes {
            return Err(format!(
                "the data ends early: the volume begins behind {bytes} bytes, {passed} are there"
            ));
        }
        Ok(())
    }

    /// Reads bytes and keeps none of them; how many there were.
    fn copied(&mut self, bytes: u64) -> Result<u64, String> {
        let copied = io::copy(&mut (&mut self.bytes).take(bytes), &mut io::sink());
        copied.map_err(|error| decode::broken(&error))
    }
}

fn is_gzip(path: &Path) -> Result<bool, Error> {
    let mut head = Vec::new();
    let read = File::take(open(path)?, GZIP_MAGIC.len() as u64).read_to_end(&mut head);
    read.map_err(|source| cannot_read(path, source))?;
    Ok(head == GZIP_MAGIC)
}
