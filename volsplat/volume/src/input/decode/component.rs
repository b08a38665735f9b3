//! One component out of voxels that have several, taken while the data streams by.
//!
//! Takes a stream of interleaved components and gives a stream of the chosen one, so that the decoder of scalars needs
//! no second form and memory holds one component only.

use std::io;
use std::io::Read;

use crate::input::file::{Fault, unsupported};

/// The component to read out of `components`: the one that the caller chose, or the only one.
pub(crate) fn chosen(choice: Option<usize>, components: usize) -> Result<usize, Fault> {
    match choice {
        Some(index) if index < components => Ok(index),
        Some(index) => Err(Fault::Option(format!(
            "component={index}: a voxel has {components} component(s), counted from 0"
        ))),
        None if components == 1 => Ok(0),
        None => Err(unsupported(format!(
            "a voxel has {components} components, such as colours or a vector: choose one with component=N, \
             from 0 to {}",
            components.saturating_sub(1)
        ))),
    }
}

/// How components are interleaved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interleaved {
    /// Bytes of one component.
    pub(crate) scalar_bytes: usize,
    /// Components of a voxel, at least 1.
    pub(crate) components: usize,
    /// The one that is wanted, below `components`.
    pub(crate) chosen: usize,
}

/// The chosen component of a stream.
pub(crate) struct OneComponent<R> {
    stream: R,
    layout: Interleaved,
    /// Unpacked bytes of the chosen component that were not asked for yet: `ready[at..]`.
    ready: Vec<u8>,
    at: usize,
}

/// Bytes of whole voxels that are read at once, if one voxel is not larger. A guess.
const PIECE_BYTES: usize = 1 << 16;

impl<R: Read> OneComponent<R> {
    pub(crate) fn new(stream: R, layout: Interleaved) -> Self {
        Self {
            stream,
            layout,
            ready: Vec::new(),
            at: 0,
        }
    }

    /// Reads the next whole component where voxels are larger than a piece, as with components that lie one behind the
    /// other.
    fn refill_by_component(&mut self) -> io::Result<()> {
        let Interleaved {
            scalar_bytes,
            components,
            chosen,
        } = self.layout;
        let cut = || io::Error::new(io::ErrorKind::UnexpectedEof, "it ends inside a voxel");
        let mut skip = |count: usize| -> io::Result<u64> {
            let count = (count * scalar_bytes) as u64;
            let skipped = io::copy(&mut (&mut self.stream).take(count), &mut io::sink())?;
            // Nothing at all is the end; a part is a cut.
            if skipped == count || skipped == 0 {
                Ok(skipped)
            } else {
                Err(cut())
            }
        };
        let before = skip(chosen)?;
        self.ready.clear();
        self.at = 0;
        (&mut self.stream)
            .take(scalar_bytes as u64)
            .read_to_end(&mut self.ready)?;
        match (self.ready.len(), before) {
            (0, _) if chosen == 0 || before == 0 => return Ok(()),
            (count, _) if count < scalar_bytes => return Err(cut()),
            _ => {}
        }
        let rest = (components - 1 - chosen) * scalar_bytes;
        let skipped = io::copy(&mut (&mut self.stream).take(rest as u64), &mut io::sink())?;
        if skipped == rest as u64 {
            Ok(())
        } else {
            Err(cut())
        }
    }

    fn refill(&mut self) -> io::Result<()> {
        let Interleaved {
            scalar_bytes,
            components,
            chosen,
        } = self.layout;
        let voxel_bytes = scalar_bytes.saturating_mul(components);
        if voxel_bytes > PIECE_BYTES {
            return self.refill_by_component();
        }
        let wanted = (PIECE_BYTES / voxel_bytes).max(1) * voxel_bytes;
        let mut piece = Vec::new();
        (&mut self.stream)
            .take(wanted as u64)
            .read_to_end(&mut piece)?;
        if !piece.len().is_multiple_of(voxel_bytes) {
            return Err(io::Error::new(
                io::ErrorKind::UnexpectedEof,
                "it ends inside a voxel",
            ));
        }
        let first = chosen * scalar_bytes;
        self.ready.clear();
        for voxel in piece.chunks_exact(voxel_bytes) {
            self.ready
                .extend_from_slice(&voxel[first..first + scalar_bytes]);
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
        OneComponent::new(bytes, layout)
            .read_to_end(&mut out)
            .map(|_| out)
    }

    #[test]
    fn each_component_is_taken_across_pieces() {
        let bytes: Vec<u8> = (0..6 * 40_000u32).map(|v| (v % 251) as u8).collect();
        for chosen in 0..3 {
            let layout = Interleaved {
                scalar_bytes: 2,
                components: 3,
                chosen,
            };
            let expected: Vec<u8> = bytes
                .chunks(6)
                .flat_map(|v| [v[2 * chosen], v[2 * chosen + 1]])
                .collect();
            assert_eq!(
                taken(&bytes, layout).expect("whole"),
                expected,
                "component {chosen}"
            );
        }
    }

    #[test]
    fn components_that_lie_one_behind_the_other_are_taken_too() {
        let bytes: Vec<u8> = (0..3 * 50_000u32).map(|v| (v % 251) as u8).collect();
        for chosen in 0..3 {
            let layout = Interleaved {
                scalar_bytes: 50_000,
                components: 3,
                chosen,
            };
            let expected = &bytes[50_000 * chosen..50_000 * (chosen + 1)];
            assert_eq!(
                taken(&bytes, layout).expect("whole"),
                expected,
                "component {chosen}"
            );
            assert!(
                taken(&bytes[..bytes.len() - 1], layout).is_err(),
                "component {chosen} of a cut stream"
            );
        }
    }

    #[test]
    fn a_cut_voxel_is_an_error() {
        let layout = Interleaved {
            scalar_bytes: 1,
            components: 3,
            chosen: 0,
        };
        assert!(
            taken(&[1, 2, 3, 4], layout).is_err(),
            "one byte of the second voxel"
        );
    }

    #[test]
    fn a_choice_is_needed_where_there_is_one() {
        assert!(matches!(chosen(None, 1), Ok(0)), "the only one");
        assert!(matches!(chosen(Some(2), 3), Ok(2)), "the last");
        assert!(
            matches!(chosen(Some(3), 3), Err(Fault::Option(_))),
            "beyond"
        );
        assert!(
            matches!(chosen(None, 3), Err(Fault::Unsupported(_))),
            "none chosen"
        );
    }
}
