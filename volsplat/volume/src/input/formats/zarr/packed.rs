//! Compressed bytes, undone within the size that they must have.

use std::io::Read;

/// How many bytes something must have when it is unpacked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Size {
    Exactly(usize),
    /// Where that depends on how well something inside was packed.
    AtMost(usize),
}

/// Most that a compression adds to what it cannot make smaller: an eighth, and room for headers. The formats that are read
/// here stay far below.
pub(crate) const SURPLUS_BYTES: usize = 1024;

impl Size {
    /// The most bytes.
    pub(crate) fn most(self) -> usize {
        match self {
            Self::Exactly(size) | Self::AtMost(size) => size,
        }
    }

    /// The size of these bytes while they are packed once more.
    pub(crate) fn packed(self) -> Self {
        let most = self.most();
        Self::AtMost(most.saturating_add(most / 8).saturating_add(SURPLUS_BYTES))
    }

    /// Refuses a size in a header that cannot be right.
    pub(crate) fn check(self, stated: usize) -> Result<(), String> {
        match self {
            Self::Exactly(needed) if stated != needed => Err(format!(
                "the chunk says that it has {stated} bytes, which its shape does not need"
            )),
            Self::AtMost(most) if stated > most => Err(format!(
                "the chunk says that it has {stated} bytes, and its shape needs at most {most}"
            )),
            _ => Ok(()),
        }
    }
}

/// Reads a stream to its end, but no further than one byte beyond what is needed: a surplus is an error later.
pub(crate) fn all_of(stream: impl Read, size: Size) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let read = stream
        .take((size.most() as u64).saturating_add(1))
        .read_to_end(&mut bytes);
    read.map_err(|error| format!("the chunk cannot be unpacked: {error}"))?;
    match size {
        Size::AtMost(most) if bytes.len() > most => Err(format!(
            "the chunk unpacks to more than the {most} bytes that its shape needs at most"
        )),
        _ => Ok(bytes),
    }
}

/// Unpacks Zstandard.
pub(crate) fn zstd(packed: &[u8], needed: Size) -> Result<Vec<u8>, String> {
    let stream = ruzstd::decoding::StreamingDecoder::new(packed);
    all_of(
        stream.map_err(|error| format!("the chunk cannot be unpacked: {error}"))?,
        needed,
    )
}

/// Unpacks an LZ4 block, which must fill `bytes`.
pub(crate) fn lz4_block(block: &[u8], bytes: &mut [u8]) -> Result<(), String> {
    match lz4_flex::block::decompress_into(block, bytes) {
        Ok(count) if count == bytes.len() => Ok(()),
        Ok(count) => Err(format!(
            "a block has {count} bytes where {} belong",
            bytes.len()
        )),
        Err(error) => Err(format!("the chunk cannot be unpacked: {error}")),
    }
}
