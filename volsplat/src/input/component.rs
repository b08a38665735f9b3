//! One component out of voxels that have several, taken while the data streams by.
//!
//! Takes a stream of interleaved components and gives a stream of the chosen one, so that the decoder of scalars needs
//! no second form and memory holds one component only.

use std::io::{self, Read};

use super::fault::{Fault, unsupported};

/// Which of `components` is read: the one that the caller chose, or the only one.
pub(super) fn chosen(choice: Option<usize>, components: usize) -> Result<usize, Fault> {
    match choice {
        Some(index) if index < components => Ok(index),
        Some(index) => Err(Fault::Option(format!(
            "--component {index}: a voxel has {components} component(s), counted from 0"
        ))),
        None if components == 1 => Ok(0),
        None => Err(unsupported(format!(
            "a voxel has {components} components, such as colours or a vector: choose one with --component N, \
             from 0 to {}",
            components.saturating_sub(1)
        ))),
    }
}

/// How components are interleaved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interleaved {
    /// Bytes of one component.
    pub(super) scalar_bytes: usize,
    /// Components of a voxel, at least 1.
    pub(super) components: usize,
    /// The one that is wanted, below `components`.
    pub(super) chosen: usize,
}

/// The chosen component of a stream.
pub(super) struct OneComponent<R> {
    stream: R,
    layout: Interleaved,
    /// Unpacked bytes of the chosen component that were not asked for yet: `ready[at..]`.
    ready: Vec<u8>,
    at: usize,
}

/// Bytes of whole voxels that are read at once, if one voxel is not larger. A guess.
const PIECE_BYTES: usize = 1 << 16;

impl<R: Read> OneComponent<R> {
    pub(super) fn new(stream: R, layout: Interleaved) -> Self {
        Self { stream, layout, ready: Vec::new(), at: 0 }
    }

    fn refill(&mut self) -> io::Result<()> {
        let Interleaved { scalar_bytes, components, chosen } = self.layout;
        let voxel_bytes = scalar_bytes * components;
        let wanted = (PIECE_BYTES / voxel_bytes).max(1) * voxel_bytes;
        let mut piece = Vec::new();
        (&mut self.stream).take(wanted as u64).read_to_end(&mut piece)?;
        if !piece.len().is_multiple_of(voxel_bytes) {
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "it ends inside a voxel"));
        }
        let first = chosen * scalar_bytes;
        self.ready.clear();
        for voxel in piece.chunks_exact(voxel_bytes) {
            self.ready.extend_from_slice(&voxel[first..first + scalar_bytes]);
        }
        self.at = 0;
        Ok(())
    }
}

impl<R: Read> Read for OneComponent<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.layout.components == 1 {
            return self.stream.read(bytes);
        }
        if self.at == self.ready.len() {
            self.refill()?;
        }
        let count = bytes.len().min(self.ready.len() - self.at);
        bytes[..count].copy_from_slice(&self.ready[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(bytes: &[u8], layout: Interleaved) -> io::Result<Vec<u8>> {
        let mut out = Vec::new();
        OneComponent::new(bytes, layout).read_to_end(&mut out).map(|_| out)
    }

    #[test]
    fn each_component_is_taken_across_pieces() {
        let bytes: Vec<u8> = (0..6 * 40_000u32).map(|v| (v % 251) as u8).collect();
        for chosen in 0..3 {
            let layout = Interleaved { scalar_bytes: 2, components: 3, chosen };
            let expected: Vec<u8> =
                bytes.chunks(6).flat_map(|v| [v[2 * chosen], v[2 * chosen + 1]]).collect();
            assert_eq!(taken(&bytes, layout).expect("whole"), expected, "component {chosen}");
        }
    }

    #[test]
    fn a_cut_voxel_is_an_error() {
        let layout = Interleaved { scalar_bytes: 1, components: 3, chosen: 0 };
        assert!(taken(&[1, 2, 3, 4], layout).is_err(), "one byte of the second voxel");
    }

    #[test]
    fn a_choice_is_needed_where_there_is_one() {
        assert!(matches!(chosen(None, 1), Ok(0)), "the only one");
        assert!(matches!(chosen(Some(2), 3), Ok(2)), "the last");
        assert!(matches!(chosen(Some(3), 3), Err(Fault::Option(_))), "beyond");
        assert!(matches!(chosen(None, 3), Err(Fault::Unsupported(_))), "none chosen");
    }
}
