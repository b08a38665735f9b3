//! The samples of a reference in a nameless temporary file: colours as three numbers a sample, then depth as one.
//!
//! The file lies in the folder that `TMPDIR` names, takes sixteen bytes a sample, and goes with the process. Rows lie
//! from the top, so that a part of the picture is read row by row. Limits: systems with positioned reads and writes; a
//! `TMPDIR` in memory (tmpfs) saves none.

use std::fs::File;

use crate::Error;

/// What is stored of each sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Linear red, green and blue.
    Colour,
    /// One number: as the depth file has it, and camera z once the file is looked through.
    Depth,
}

/// A part of a picture, samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rect {
    /// First column and row.
    pub(super) first: [usize; 2],
    /// Columns and rows.
    pub(super) size: [usize; 2],
}

/// The file.
#[derive(Debug)]
pub(super) struct Sheet {
    file: File,
    /// Samples along x and y.
    pub(super) size: [usize; 2],
}

impl Rect {
    /// Whether another part lies in this one.
    pub(super) fn holds(&self, other: &Self) -> bool {
        (0..2).all(|i| {
            self.first[i] <= other.first[i]
                && other.first[i] + other.size[i] <= self.first[i] + self.size[i]
        })
    }

    /// Samples of the part.
    pub(super) fn samples(&self) -> u64 {
        self.size[0] as u64 * self.size[1] as u64
    }
}

impl Kind {
    /// Numbers a sample.
    pub(super) fn channels(self) -> usize {
        match self {
            Self::Colour => 3,
            Self::Depth => 1,
        }
    }
}

impl Sheet {
    /// A file for a picture of this size, all zeros.
    pub(super) fn new(size: [usize; 2]) -> Result<Self, Error> {
        let file = tempfile::tempfile().and_then(|file| {
            file.set_len((size[0] * size[1] * 16) as u64)?;
            Ok(file)
        });
        Ok(Self {
            file: file.map_err(|source| failed(size, &source))?,
            size,
        })
    }

    /// Writes a piece of a row.
    pub(super) fn write(&self, kind: Kind, at: [usize; 2], values: &[f32]) -> Result<(), Error> {
        let mut bytes = Vec::with_capacity(4 * values.len());
        values
            .iter()
            .for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
        write_all_at(&self.file, &bytes, self.place(kind, at))
            .map_err(|source| failed(self.size, &source))
    }

    /// Reads a part; row after row, the numbers of each sample together.
    pub(super) fn read(&self, kind: Kind, part: &Rect) -> Result<Vec<f32>, Error> {
        let [columns, rows] = part.size;
        let mut values = Vec::with_capacity(columns * rows * kind.channels());
        let mut bytes = vec![0; columns * kind.channels() * 4];
        for row in 0..rows {
            let place = self.place(kind, [part.first[0], part.first[1] + row]);
            read_exact_at(&self.file, &mut bytes, place)
                .map_err(|source| failed(self.size, &source))?;
            let numbers = bytes
                .chunks_exact(4)
                .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            values.extend(numbers);
        }
        Ok(values)
    }

    /// The colours of a part.
    pub(super) fn colours(&self, part: &Rect) -> Result<Vec<[f32; 3]>, Error> {
        let mut colours = Vec::with_capacity(part.size[0] * part.size[1]);
        for row in 0..part.size[1] {
            let row = Rect {
                first: [part.first[0], part.first[1] + row],
                size: [part.size[0], 1],
            };
            colours.extend(
                self.read(Kind::Colour, &row)?
                    .chunks_exact(3)
                    .map(|c| [c[0], c[1], c[2]]),
            );
        }
        Ok(colours)
    }

    /// The byte at which a sample begins.
    fn place(&self, kind: Kind, [x, y]: [usize; 2]) -> u64 {
        let sample = (y * self.size[0] + x) as u64;
        match kind {
            Kind::Colour => 12 * sample,
            Kind::Depth => 12 * (self.size[0] * self.size[1]) as u64 + 4 * sample,
        }
    }
}

fn failed([width, height]: [usize; 2], source: &std::io::Error) -> Error {
    Error::Option(format!(
        "{width}x{height} samples cannot be kept in {} bytes of a temporary file: {source}; give TMPDIR a folder with \
         room, or allow more memory",
        width * height * 16
    ))
}

#[cfg(unix)]
fn write_all_at(file: &File, bytes: &[u8], place: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, place)
}

#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], place: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, place)
}

/// Elsewhere a nameless file has one position, which threads cannot share.
#[cfg(not(unix))]
fn write_all_at(_: &File, _: &[u8], _: u64) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

#[cfg(not(unix))]
fn read_exact_at(_: &File, _: &mut [u8], _: u64) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}
