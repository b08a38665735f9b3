//! Components out of voxels that have several, separated while the data streams by.
//!
//! Takes a stream of interleaved components and returns the chosen ones: a single one as a stream, so that
//! memory holds one component only; several as the bytes of each, so that data is unpacked once.

use std::io;
use std::io::Read;

use crate::input::decode;
use crate::input::decode::Layout;
use crate::input::file::{Fault, unsupported};
use crate::volume::Voxels;

/// The components to read out of `components`: those that the caller chose, or the only one.
pub(crate) fn chosen(choice: &[usize], components: usize) -> Result<Vec<usize>, Fault> {
    if let Some(index) = choice.iter().find(|&&index| index >= components) {
        return Err(Fault::Option(format!(
            "component={index}: a voxel has {components} component(s), counted from 0"
        )));
    }
    match choice {
        [] if components == 1 => Ok(vec![0]),
        [] => Err(unsupported(format!(
            "a voxel has {components} components, such as colours or a vector: choose one with component=N, \
             from 0 to {}",
            components.saturating_sub(1)
        ))),
        choice => Ok(choice.to_vec()),
    }
}

/// How components are interleaved.
#[derive(Clone, Debug)]
pub(crate) struct Interleaved {
    /// Bytes of one component.
    pub(crate) scalar_bytes: usize,
    /// Components of a voxel, at least 1.
    pub(crate) components: usize,
    /// Those that are wanted, each below `components`; at least one.
    pub(crate) chosen: Vec<usize>,
}

/// The chosen components of a stream.
struct Separator<'a, R> {
    stream: R,
    layout: &'a Interleaved,
    /// The last bytes of each chosen component. [`Read`] returns those of the first, from `at` on.
    ready: Vec<Vec<u8>>,
    at: usize,
}

/// Bytes of whole voxels that are read at once, if one voxel is not larger. A guess.
const PIECE_BYTES: usize = 1 << 16;

/// Reads `layout.count` scalars of each chosen component out of a stream, which ends behind them.
pub(crate) fn read(
    stream: impl Read,
    layout: &Layout,
    interleaved: &Interleaved,
) -> Result<Vec<Voxels>, String> {
    let mut separator = Separator::new(stream, interleaved);
    if interleaved.chosen.len() == 1 {
        return Ok(vec![decode::binary(&mut separator, layout)?]);
    }
    let separated = separator.rest(layout.bytes()?);
    let separated = separated.map_err(|error| decode::broken(&error))?;
    let decoded = separated
        .into_iter()
        .map(|bytes| decode::binary(&mut bytes.as_slice(), layout));
    decoded.collect()
}

impl<'a, R: Read> Separator<'a, R> {
    fn new(stream: R, layout: &'a Interleaved) -> Self {
        Self {
            stream,
            layout,
            ready: vec![Vec::new(); layout.chosen.len()],
            at: 0,
        }
    }

    /// The bytes of each chosen component, up to the end or until there are more than `needed`.
    fn rest(mut self, needed: u64) -> io::Result<Vec<Vec<u8>>> {
        let mut all = vec![Vec::new(); self.ready.len()];
        while all[0].len() as u64 <= needed {
            self.refill()?;
            if self.ready[0].is_empty() {
                break;
            }
            for (all, ready) in all.iter_mut().zip(&self.ready) {
                all.extend_from_slice(ready);
            }
        }
        Ok(all)
    }

    /// Reads the next voxel where voxels are larger than a piece, as with components that lie one behind the other.
    fn refill_by_component(&mut self) -> io::Result<()> {
        let bytes = self.layout.scalar_bytes as u64;
        let mut scalar = Vec::new();
        for component in 0..self.layout.components {
            let mut stream = (&mut self.stream).take(bytes);
            let got = if self.layout.chosen.contains(&component) {
                scalar.clear();
                stream.read_to_end(&mut scalar)? as u64
            } else {
                io::copy(&mut stream, &mut io::sink())?
            };
            if got == 0 && component == 0 {
                return Ok(());
            }
            if got != bytes {
                return Err(cut());
            }
            for (ready, &chosen) in self.ready.iter_mut().zip(&self.layout.chosen) {
                if chosen == component {
                    ready.extend_from_slice(&scalar);
                }
            }
        }
        Ok(())
    }

    fn refill(&mut self) -> io::Result<()> {
        self.at = 0;
        self.ready.iter_mut().for_each(Vec::clear);
        let scalar_bytes = self.layout.scalar_bytes;
        let voxel_bytes = scalar_bytes.saturating_mul(self.layout.components);
        if voxel_bytes > PIECE_BYTES {
            return self.refill_by_component();
        }
        let wanted = (PIECE_BYTES / voxel_bytes).max(1) * voxel_bytes;
        let mut piece = Vec::new();
        (&mut self.stream)
            .take(wanted as u64)
            .read_to_end(&mut piece)?;
        if !piece.len().is_multiple_of(voxel_bytes) {
            return Err(cut());
        }
        for (ready, &chosen) in self.ready.iter_mut().zip(&self.layout.chosen) {
            let first = chosen * scalar_bytes;
            for voxel in piece.chunks_exact(voxel_bytes) {
                ready.extend_from_slice(&voxel[first..first + scalar_bytes]);
            }
        }
        Ok(())
    }
}

fn cut() -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, "it ends inside a voxel")
}

impl<R: Read> Read for Separator<'_, R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.layout.components == 1 {
            return self.stream.read(bytes);
        }
        if self.at == self.ready[0].len() {
            self.refill()?;
        }
        let ready = &self.ready[0][self.at..];
        let count = bytes.len().min(ready.len());
        bytes[..count].copy_from_slice(&ready[..count]);
        self.at += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Endian, VoxelType};

    fn taken(bytes: &[u8], layout: &Interleaved) -> io::Result<Vec<u8>> {
        let mut out = Vec::new();
        Separator::new(bytes, layout)
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
                chosen: vec![chosen],
            };
            let expected: Vec<u8> = bytes
                .chunks(6)
                .flat_map(|v| [v[2 * chosen], v[2 * chosen + 1]])
                .collect();
            assert_eq!(
                taken(&bytes, &layout).expect("whole"),
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
                chosen: vec![chosen],
            };
            let expected = &bytes[50_000 * chosen..50_000 * (chosen + 1)];
            assert_eq!(
                taken(&bytes, &layout).expect("whole"),
                expected,
                "component {chosen}"
            );
            assert!(
                taken(&bytes[..bytes.len() - 1], &layout).is_err(),
                "component {chosen} of a cut stream"
            );
        }
    }

    #[test]
    fn several_components_are_separated_in_one_pass() {
        let words: Vec<u16> = (0..3 * 30_000u32).map(|v| (v % 65_521) as u16).collect();
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        // Pixel by pixel, and one behind the other.
        for scalar_bytes in [2, bytes.len() / 3] {
            let layout = Layout {
                voxel_type: VoxelType::U16,
                endian: Endian::Little,
                count: words.len() / 3,
            };
            let chosen = vec![2, 0, 2];
            let interleaved = Interleaved {
                scalar_bytes,
                components: 3,
                chosen: chosen.clone(),
            };
            let mut stream = bytes.as_slice();
            let several = read(&mut stream, &layout, &interleaved).expect("whole");
            assert!(stream.is_empty(), "one pass takes all bytes");
            let one = |component: usize| {
                let interleaved = Interleaved {
                    chosen: vec![component],
                    ..interleaved.clone()
                };
                read(bytes.as_slice(), &layout, &interleaved).expect("whole")
            };
            let expected: Vec<Voxels> = chosen.iter().flat_map(|&c| one(c)).collect();
            assert_eq!(several, expected, "{scalar_bytes} bytes a component");
            let longer = [bytes.as_slice(), &[0; 6]].concat();
            for wrong in [&bytes[..bytes.len() - 6], &longer] {
                assert!(read(wrong, &layout, &interleaved).is_err());
            }
        }
    }

    #[test]
    fn a_cut_voxel_is_an_error() {
        let layout = Interleaved {
            scalar_bytes: 1,
            components: 3,
            chosen: vec![0],
        };
        assert!(
            taken(&[1, 2, 3, 4], &layout).is_err(),
            "one byte of the second voxel"
        );
    }

    #[test]
    fn a_choice_is_needed_where_there_is_one() {
        assert!(matches!(chosen(&[], 1).as_deref(), Ok([0])), "the only one");
        assert!(matches!(chosen(&[2], 3).as_deref(), Ok([2])), "the last");
        assert!(
            matches!(chosen(&[1, 3], 3), Err(Fault::Option(_))),
            "beyond"
        );
        assert!(
            matches!(chosen(&[], 3), Err(Fault::Unsupported(_))),
            "none chosen"
        );
    }
}
