//! Small pictures defined by integer formulas, for tests against other programs.
//!
//! Each pattern gives a test image and a reference of 47 x 37 pixels. Values are integers 0..=255 divided by 255 in
//! f32, so any program that follows the formulas has the same pictures to the last bit. With x the column, y the row
//! and c the channel (0 red, 1 green, 2 blue), the formulas are in [`Pattern::code`]; alpha is 1 inside a disc.

use super::inputs::Mask;
use crate::Image;

/// Width of every pattern.
pub(super) const WIDTH: usize = 47;
/// Height of every pattern.
pub(super) const HEIGHT: usize = 37;

/// The pair of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pattern {
    /// Sawtooth ramps, shifted by one pixel.
    Ramp,
    /// A two-coloured checkerboard, shifted by two pixels.
    Checker,
    /// Noise, with four steps added on every fifth diagonal.
    Noise,
}

impl Pattern {
    /// Test image and reference.
    pub(super) fn pair(self) -> (Image, Image) {
        (
            self.picture(|x, y, c| self.changed_code(x, y, c)),
            self.picture(|x, y, c| self.code(x, y, c)),
        )
    }

    fn code(self, x: usize, y: usize, c: usize) -> usize {
        match self {
            Self::Ramp => [x * 4, y * 5, x * y][c] % 256,
            Self::Checker if (x / 7 + y / 5) % 2 == 1 => [230, 40, 60][c],
            Self::Checker => [20, 60, 200][c],
            Self::Noise => ((x * 7919 + y * 104_729 + c * 1_299_721) % 65_521).pow(2) % 251,
        }
    }

    fn changed_code(self, x: usize, y: usize, c: usize) -> usize {
        match self {
            Self::Ramp => self.code(x + 1, y, c),
            Self::Checker => self.code(x + 2, y, c),
            Self::Noise => self.code(x, y, c) + if (x + y).is_multiple_of(5) { 4 } else { 0 },
        }
    }

    fn picture(self, code: impl Fn(usize, usize, usize) -> usize) -> Image {
        let mut image = Image::transparent(WIDTH, HEIGHT);
        for (at, pixel) in image.rgba.iter_mut().enumerate() {
            let (x, y) = (at % WIDTH, at / WIDTH);
            *pixel = std::array::from_fn(|c| match c {
                3 => f32::from(u8::from(in_disc(x, y))),
                _ => code(x, y, c) as f32 / 255.0,
            });
        }
        image
    }
}

/// The disc as a mask: 697 pixels.
pub(super) fn disc_mask() -> Mask {
    let inside = (0..WIDTH * HEIGHT)
        .map(|at| in_disc(at % WIDTH, at / WIDTH))
        .collect();
    Mask::new(WIDTH, HEIGHT, inside).expect("one flag per pixel")
}

/// Closer than 15 pixels to pixel (23, 18).
fn in_disc(x: usize, y: usize) -> bool {
    x.abs_diff(23).pow(2) + y.abs_diff(18).pow(2) < 15 * 15
}
