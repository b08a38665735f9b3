//! References larger than memory: their samples stay in a temporary file, and a picture is drawn from the parts that it
//! can show.
//!
//! 1. `unpack`: the files are decoded once, piece by piece, into the temporary file (`sheet`).
//! 2. `survey`: the file is looked through once: camera z, the tolerance of surfaces, the box around all samples, and for
//!    each block of 64 x 64 samples the range of disparity that its pieces can take (`blocks`).
//! 3. [`LargeWarper`]: a picture is cut into windows, each of which sees a part of each reference that fits the memory.
//!    The parts are read and warped as if they were pictures of their own, and the windows put together.
//!
//! The picture is that of the references in memory, up to rounding: a part reaches so far beyond what its window sees
//! that nothing beyond it has a weight (`warper::REACH`).

mod blocks;
mod files;
mod sheet;
mod survey;
mod unpack;
mod warper;

use resample_core::Camera;

use crate::options::SurfaceTolerance;
use crate::prepared::Surveyed;
use crate::{Error, Reference};
use blocks::Blocks;
use sheet::{Kind, Rect, Sheet};

pub use files::Files;
pub use warper::LargeWarper;

/// A reference whose samples lie in a file.
#[derive(Debug)]
pub struct LargeReference {
    /// The camera; its width and height are those of the picture.
    pub camera: Camera,
    sheet: Sheet,
    blocks: Blocks,
    surveyed: Surveyed,
    known: u64,
    nearest: f32,
}

impl LargeReference {
    /// Decodes the files of a reference, holding at most about `max_memory` bytes.
    ///
    /// # Errors
    /// Those of reading the files into memory, a temporary file that cannot be written, and a file that must be decoded
    /// whole and does not fit.
    pub fn read(
        files: &Files<'_>,
        tolerance: SurfaceTolerance,
        max_memory: u64,
    ) -> Result<Self, Error> {
        let size = [files.camera.width as usize, files.camera.height as usize];
        let unpacked = unpack::unpacked(files, size, max_memory)?;
        let found = survey::survey(files, &unpacked, tolerance)?;
        Ok(Self {
            camera: *files.camera,
            sheet: unpacked.sheet,
            blocks: found.blocks,
            surveyed: found.surveyed,
            known: found.known,
            nearest: found.nearest,
        })
    }

    /// Camera z of the nearest sample, world units.
    pub fn nearest(&self) -> f32 {
        self.nearest
    }

    /// Number of samples with a depth.
    pub fn known(&self) -> u64 {
        self.known
    }

    /// Number and camera z of every `step`th sample; NaN where unknown.
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub fn depths(&self, step: usize) -> Result<Vec<(usize, f32)>, Error> {
        let width = self.sheet.size[0];
        let one = |index: usize| {
            let place = Rect {
                first: [index % width, index / width],
                size: [1, 1],
            };
            Ok((index, self.sheet.read(Kind::Depth, &place)?[0]))
        };
        (0..width * self.sheet.size[1])
            .step_by(step.max(1))
            .map(one)
            .collect()
    }

    /// A part of the reference as a reference of its own: the same eye, with the principal point moved.
    fn part(&self, part: &Rect) -> Result<Reference, Error> {
        let camera = Camera {
            width: part.size[0] as u32,
            height: part.size[1] as u32,
            cx: self.camera.cx - part.first[0] as f64,
            cy: self.camera.cy - part.first[1] as f64,
            ..self.camera
        };
        Ok(Reference {
            camera,
            colour: self.sheet.colours(part)?,
            depth: self.sheet.read(Kind::Depth, part)?,
        })
    }

    /// A single sample without depth: nothing of the reference is seen, but its eye stays where it is.
    fn nothing(&self) -> Reference {
        let camera = Camera {
            width: 1,
            height: 1,
            ..self.camera
        };
        Reference {
            camera,
            colour: vec![[0.0; 3]],
            depth: vec![f32::NAN],
        }
    }
}
