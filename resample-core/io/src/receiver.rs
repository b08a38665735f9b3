//! Where decoded numbers go: into memory whole, or piece by piece into a file.
//!
//! A reader decodes a file once and gives its numbers in pieces of rows, in whatever order the format has them. What
//! receives them decides what is kept. Nothing is received before the claims of a header have been checked.

use std::path::Path;

use super::files::fault;
use super::picture::Picture;
use crate::picture::{Plane, Stored};
use resample_core::Error;

/// Takes the numbers of a picture or of a depth, piece by piece.
pub trait Receiver {
    /// Width and height, px, before the first piece. Pixels that no piece holds are unknown.
    fn begin(&mut self, size: [usize; 2]) -> Result<(), Error>;
    /// A piece of a row from column and row `at` on: for a picture red, green, blue and coverage of each pixel, for a
    /// depth one number each.
    fn put(&mut self, at: [usize; 2], values: &[f32]) -> Result<(), Error>;
}

/// Most bytes that a decoder may hold at once.
#[derive(Clone, Copy, Debug)]
pub struct Room(pub u64);

impl Room {
    /// As much as there is.
    pub const ENDLESS: Self = Self(u64::MAX);

    /// Refuses a decoder that would hold `bytes`; `why` says what of the file it has to hold whole.
    pub fn check(self, path: &Path, bytes: u64, why: &str) -> Result<(), Error> {
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        if bytes <= self.0 {
            return Ok(());
        }
        Err(fault(
            path,
            format!(
                "{why} takes {} MiB to decode, {} MiB are left for it: allow more, or save the file as PNG \
                 without interlacing, EXR in scan lines, PFM or .npy, which are read row by row",
                mib(bytes),
                mib(self.0)
            ),
        ))
    }
}

/// A picture in memory, in the making.
#[derive(Default)]
pub(super) struct HeldPicture {
    size: [usize; 2],
    /// NaN, which is no colour of a piece, where no piece has come.
    rgb: Vec<[f32; 3]>,
    /// Empty as long as every pixel that has come is covered whole.
    coverage: Vec<f32>,
}

impl HeldPicture {
    /// The picture; its coverage only where the file has one, or lacks pixels.
    pub(super) fn picture(mut self, has_alpha: bool) -> Picture {
        let lacks_pixels = self.rgb.iter().any(|rgb| rgb[0].is_nan());
        if has_alpha || lacks_pixels {
            self.keep_coverage();
        }
        if lacks_pixels {
            let pixels = self.rgb.iter_mut().zip(&mut self.coverage);
            let missing = pixels.filter(|(rgb, _)| rgb[0].is_nan());
            missing.for_each(|(rgb, coverage)| (*rgb, *coverage) = ([0.0; 3], 0.0));
        }
        let [width, height] = self.size;
        Picture {
            width,
            height,
            rgb: self.rgb,
            coverage: (!self.coverage.is_empty()).then_some(self.coverage),
        }
    }

    fn keep_coverage(&mut self) {
        self.coverage.resize(self.rgb.len(), 1.0);
    }
}

impl Receiver for HeldPicture {
    fn begin(&mut self, size: [usize; 2]) -> Result<(), Error> {
        self.size = size;
        self.rgb = vec![[f32::NAN; 3]; size[0] * size[1]];
        Ok(())
    }

    fn put(&mut self, [x, y]: [usize; 2], values: &[f32]) -> Result<(), Error> {
        let first = y * self.size[0] + x;
        let pixels = values.chunks_exact(4);
        for (rgb, pixel) in self.rgb[first..].iter_mut().zip(pixels.clone()) {
            *rgb = [pixel[0], pixel[1], pixel[2]];
        }
        if self.coverage.is_empty() && pixels.clone().any(|pixel| pixel[3] != 1.0) {
            self.keep_coverage();
        }
        if !self.coverage.is_empty() {
            for (coverage, pixel) in self.coverage[first..].iter_mut().zip(pixels) {
                *coverage = pixel[3];
            }
        }
        Ok(())
    }
}

/// A depth in memory, in the making.
#[derive(Default)]
pub(super) struct HeldPlane {
    size: [usize; 2],
    values: Vec<f32>,
}

impl HeldPlane {
    /// The plane.
    pub(super) fn plane(self, stored: Stored) -> Plane {
        Plane {
            width: self.size[0],
            height: self.size[1],
            values: self.values,
            stored,
        }
    }
}

impl Receiver for HeldPlane {
    fn begin(&mut self, size: [usize; 2]) -> Result<(), Error> {
        self.size = size;
        self.values = vec![f32::NAN; size[0] * size[1]];
        Ok(())
    }

    fn put(&mut self, [x, y]: [usize; 2], values: &[f32]) -> Result<(), Error> {
        let first = y * self.size[0] + x;
        self.values[first..first + values.len()].copy_from_slice(values);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_gets_the_room_that_there_is_and_no_byte_more() {
        let path = Path::new("a.tif");
        assert!(Room(3 << 20).check(path, 3 << 20, "a strip").is_ok());
        assert!(Room::ENDLESS.check(path, u64::MAX, "a strip").is_ok());
        let error = Room(3 << 20).check(path, (3 << 20) + 1, "a strip");
        let error = error.expect_err("too much").to_string();
        assert!(
            error.starts_with("a.tif: a strip takes 4 MiB to decode, 3 MiB are left"),
            "{error}"
        );
    }

    #[test]
    fn pieces_land_in_their_rows_and_columns() {
        let mut plane = HeldPlane::default();
        plane.begin([3, 2]).expect("memory");
        plane.put([1, 1], &[5.0, 6.0]).expect("inside");
        let held = plane.plane(Stored::Float).values;
        assert!(held[..4].iter().all(|value| value.is_nan()), "unknown");
        assert_eq!(held[4..], [5.0, 6.0]);

        let mut picture = HeldPicture::default();
        picture.begin([2, 2]).expect("memory");
        picture.put([1, 1], &[0.1, 0.2, 0.3, 1.0]).expect("inside");
        let held = picture.picture(false);
        assert_eq!(held.rgb[3], [0.1, 0.2, 0.3]);
        assert_eq!(
            held.coverage,
            Some(vec![0.0, 0.0, 0.0, 1.0]),
            "pixels that no piece holds are not covered"
        );
        let mut whole = HeldPicture::default();
        whole.begin([1, 1]).expect("memory");
        whole.put([0, 0], &[0.1, 0.2, 0.3, 1.0]).expect("inside");
        assert_eq!(whole.picture(false).coverage, None, "covered all over");
    }
}
