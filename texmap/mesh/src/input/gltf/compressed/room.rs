//! The memory that compressed geometry may take, and the parts of buffers where it lies.

use resample_io::Gate;

/// The memory that unpacked data may take.
pub(super) struct Room<'a> {
    unpacked: u64,
    pub(super) file_bytes: u64,
    pub(super) gate: &'a Gate,
}

impl<'a> Room<'a> {
    /// The memory limit for decoding a file of `file_bytes`, external buffers included.
    pub(super) fn new(file_bytes: u64, gate: &'a Gate) -> Self {
        Self {
            unpacked: 0,
            file_bytes,
            gate,
        }
    }

    pub(super) fn ask(&mut self, bytes: usize) -> Result<(), String> {
        self.unpacked = self.unpacked.saturating_add(bytes as u64);
        self.gate
            .ask_unpacked(self.unpacked, self.file_bytes, "the unpacked meshes")
    }
}

/// The part of a buffer that a view, or a compressed view, stands for.
pub(super) fn range(
    buffers: &[Vec<u8>],
    (buffer, start, length): (u64, u64, u64),
) -> Result<&[u8], String> {
    let bytes = usize::try_from(buffer)
        .ok()
        .and_then(|buffer| buffers.get(buffer))
        .ok_or_else(|| format!("buffer {buffer} does not exist"))?;
    let range = usize::try_from(start)
        .ok()
        .zip(usize::try_from(start.saturating_add(length)).ok());
    range
        .and_then(|(start, end)| bytes.get(start..end))
        .ok_or_else(|| {
            let size = bytes.len();
            format!("takes {length} bytes from byte {start} of a buffer of {size} bytes")
        })
}

/// The number of a thing in a list of a document.
pub(super) fn index_of(place: usize) -> Result<u32, String> {
    u32::try_from(place).map_err(|_| "it has too many parts".to_owned())
}
