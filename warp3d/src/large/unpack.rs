//! From files to the temporary file, piece by piece, in whatever order the formats have the pieces.

use resample_io::files::first_bytes;
use resample_io::{Receiver, Room, Stored, colour, depth};

use super::blocks::BLOCK;
use super::files::Files;
use super::sheet::{Kind, Sheet};
use crate::Error;
use crate::input::check_sizes;
use crate::memory::survey_bytes;
use crate::surfaces::sharpen_edges;

/// The unpacked files.
pub(super) struct Unpacked {
    /// Colours, and the numbers of the depth file.
    pub(super) sheet: Sheet,
    /// Samples whose pixel is at least half covered.
    pub(super) covered: Mask,
    /// Samples for which the depth file has a number.
    pub(super) given: Mask,
    /// What kind of numbers these are.
    pub(super) stored: Stored,
}

/// One bit a sample.
pub(super) struct Mask {
    words: Vec<u64>,
    width: usize,
}

impl Mask {
    fn new([width, height]: [usize; 2]) -> Self {
        Self {
            words: vec![0; (width * height).div_ceil(64)],
            width,
        }
    }

    fn set(&mut self, x: usize, y: usize) {
        let index = y * self.width + x;
        self.words[index / 64] |= 1 << (index % 64);
    }

    pub(super) fn get(&self, x: usize, y: usize) -> bool {
        let index = y * self.width + x;
        self.words[index / 64] >> (index % 64) & 1 != 0
    }
}

/// Decodes the files.
pub(super) fn unpacked(
    files: &Files<'_>,
    size: [usize; 2],
    max_memory: u64,
) -> Result<Unpacked, Error> {
    let needed = survey_bytes(size, BLOCK + 2 * sharpen_edges::HALO);
    if needed > max_memory {
        return Err(Error::Option(format!(
            "{max_memory} bytes of memory are too little: a picture of {}x{} takes at least {needed} bytes to be looked \
             through, and more to be drawn",
            size[0], size[1]
        )));
    }
    // A depth that is not there need not wait for the picture.
    first_bytes(&files.depth.path, 1)?;
    let room = Room(max_memory - (size[0] * size[1] / 4) as u64);
    let sheet = Sheet::new(size)?;
    let mut colours = IntoSheet::new(&sheet, Kind::Colour);
    colour::decode(files.colour, room, &mut colours)?;
    check_sizes(size, colours.size, files.camera, &files.colour.path)?;
    let covered = colours.seen;
    let mut depths = IntoSheet::new(&sheet, Kind::Depth);
    let stored = depth::decode(files.depth, room, &mut depths)?;
    check_sizes(size, depths.size, files.camera, &files.depth.path)?;
    let given = depths.seen;
    Ok(Unpacked {
        sheet,
        covered,
        given,
        stored,
    })
}

/// Writes what it receives.
struct IntoSheet<'a> {
    sheet: &'a Sheet,
    kind: Kind,
    seen: Mask,
    size: [usize; 2],
    row: Vec<f32>,
}

impl<'a> IntoSheet<'a> {
    fn new(sheet: &'a Sheet, kind: Kind) -> Self {
        Self {
            sheet,
            kind,
            seen: Mask::new(sheet.size),
            size: [0; 2],
            row: Vec::new(),
        }
    }
}

impl Receiver for IntoSheet<'_> {
    fn begin(&mut self, size: [usize; 2]) -> Result<(), Error> {
        self.size = size;
        Ok(())
    }

    fn put(&mut self, [x, y]: [usize; 2], values: &[f32]) -> Result<(), Error> {
        // A picture of another size is not kept: reading it ends in an error.
        if self.size != self.sheet.size {
            return Ok(());
        }
        if self.kind == Kind::Depth {
            (0..values.len()).for_each(|i| self.seen.set(x + i, y));
            return self.sheet.write(Kind::Depth, [x, y], values);
        }
        self.row.clear();
        for (i, pixel) in values.chunks_exact(4).enumerate() {
            self.row.extend_from_slice(&pixel[..3]);
            // The centre of a pixel that is covered by less than a half shows nothing.
            if pixel[3] >= 0.5 {
                self.seen.set(x + i, y);
            }
        }
        self.sheet.write(Kind::Colour, [x, y], &self.row)
    }
}
