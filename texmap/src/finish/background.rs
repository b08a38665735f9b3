//! The background of a picture: nothing, a colour, or another picture.
//!
//! Takes a finished picture, gives it composited over its background. A background picture is scaled, its proportions
//! kept, until it covers the whole picture; what overhangs is cut off evenly. It is scaled in linear light with a
//! triangle filter that is as wide as the coarser of the two grids, so that it neither aliases nor blocks.
//! Limits: its own transparency is ignored.

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use resample_core::Image;
use resample_core::image::linear_from_srgb;
use resample_io::Gate;

use crate::Error;
use crate::scene::Texels;

/// The background of a picture.
#[derive(Clone, Debug)]
pub enum Background {
    /// Nothing: the picture keeps its transparency.
    Transparent,
    /// A colour, linear RGB.
    Colour([f32; 3]),
    /// Another picture.
    Picture(Arc<Backdrop>),
}

/// A background picture: rows from the top, at least one pixel.
#[derive(Debug)]
pub struct Backdrop {
    width: usize,
    height: usize,
    /// As they are stored: a photograph takes four bytes a pixel.
    texels: Texels,
    /// Linear light of each code of 8 bits.
    light: Vec<f32>,
}

impl Background {
    /// Reads a picture file.
    ///
    /// # Errors
    /// Those of reading a texture.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let texture = crate::load_picture(path, &Gate::default())?;
        let light = |code: u8| linear_from_srgb(f32::from(code) / 255.0);
        Ok(Self::Picture(Arc::new(Backdrop {
            width: texture.width,
            height: texture.height,
            texels: texture.texels,
            light: (0..=u8::MAX).map(light).collect(),
        })))
    }

    /// The colour that tinted glass is seen before: white where no colour is given.
    pub fn colour(&self) -> [f32; 3] {
        match self {
            Self::Colour(colour) => *colour,
            Self::Transparent | Self::Picture(_) => [1.0; 3],
        }
    }

    /// The picture with this behind it.
    pub fn behind(&self, image: Image) -> Image {
        let whole = [image.width, image.height];
        self.behind_window(image, [0, 0], whole)
    }

    /// A window of a picture of the size `whole`, from column and row `first` on, with this behind it.
    pub fn behind_window(&self, image: Image, first: [usize; 2], whole: [usize; 2]) -> Image {
        match self {
            Self::Transparent => image,
            Self::Colour(colour) => image.over_background(*colour),
            Self::Picture(backdrop) => backdrop.behind(image, first, whole),
        }
    }
}

impl Backdrop {
    fn behind(
        &self,
        mut image: Image,
        [left, top]: [usize; 2],
        [width, height]: [usize; 2],
    ) -> Image {
        // Source pixels per picture pixel; the smaller one, so that the whole picture is covered.
        let step = (self.width as f64 / width as f64).min(self.height as f64 / height as f64);
        let columns = taps(self.width, width, step);
        let rows = taps(self.height, height, step);
        image
            .rgba
            .par_chunks_mut(image.width)
            .zip(&rows[top..])
            .for_each(|(pixels, row)| {
                let line = self.mixed_rows(row);
                for (pixel, column) in pixels.iter_mut().zip(&columns[left..]) {
                    lay_over(pixel, mixed(column, |at| line[at]));
                }
            });
        image
    }

    /// One row of the backdrop, mixed from those under a row of the picture.
    fn mixed_rows(&self, taps: &[(usize, f32)]) -> Vec<[f32; 3]> {
        (0..self.width)
            .map(|x| mixed(taps, |y| self.linear(y * self.width + x)))
            .collect()
    }

    /// Linear RGB of a pixel.
    fn linear(&self, at: usize) -> [f32; 3] {
        match &self.texels {
            Texels::Srgb8(texels) => {
                let [r, g, b, _] = texels[at];
                [r, g, b].map(|code| self.light[usize::from(code)])
            }
            Texels::LinearF32(texels) => {
                let [r, g, b, _] = texels[at];
                [r, g, b]
            }
        }
    }
}

/// Source pixels and weights, which sum to 1, of each of `count` pixels along one direction.
fn taps(source: usize, count: usize, step: f64) -> Vec<Vec<(usize, f32)>> {
    let reach = step.max(1.0);
    let last = source.saturating_sub(1);
    let taps_of = |pixel: usize| {
        let centre = 0.5 * source as f64 + (pixel as f64 + 0.5 - 0.5 * count as f64) * step - 0.5;
        let first = (centre - reach).floor() as i64;
        let end = (centre + reach).ceil() as i64;
        let weight = |at: i64| (1.0 - (at as f64 - centre).abs() / reach).max(0.0);
        let sum: f64 = (first..=end).map(weight).sum();
        let tap = |at: i64| (at.clamp(0, last as i64) as usize, (weight(at) / sum) as f32);
        (first..=end).map(tap).filter(|tap| tap.1 > 0.0).collect()
    };
    (0..count).map(taps_of).collect()
}

fn mixed(taps: &[(usize, f32)], colour: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
    taps.iter().fold([0.0; 3], |sum, &(at, weight)| {
        let colour = colour(at);
        [0, 1, 2].map(|c| sum[c] + weight * colour[c])
    })
}

fn lay_over(pixel: &mut [f32; 4], behind: [f32; 3]) {
    let transmittance = 1.0 - pixel[3];
    for (channel, behind) in pixel.iter_mut().zip(behind) {
        *channel += transmittance * behind;
    }
    pixel[3] = 1.0;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn backdrop(
        width: usize,
        height: usize,
        colour: impl Fn(usize, usize) -> [f32; 3],
    ) -> Background {
        let texel = |i: usize| {
            let [r, g, b] = colour(i % width, i / width);
            [r, g, b, 1.0]
        };
        Background::Picture(Arc::new(Backdrop {
            width,
            height,
            texels: Texels::LinearF32((0..width * height).map(texel).collect()),
            light: Vec::new(),
        }))
    }

    #[test]
    fn an_even_background_stays_even_at_any_size() {
        for (width, height) in [(1, 1), (7, 3), (640, 480)] {
            let image =
                backdrop(width, height, |_, _| [0.2, 0.4, 0.8]).behind(Image::transparent(31, 17));
            for pixel in &image.rgba {
                let off = (0..3)
                    .map(|c| (pixel[c] - [0.2, 0.4, 0.8][c]).abs())
                    .fold(0.0, f32::max);
                assert!(
                    off < 1e-5 && pixel[3] == 1.0,
                    "{width}x{height}: {pixel:?} is not the even colour"
                );
            }
        }
    }

    #[test]
    fn the_middle_of_a_wide_background_is_kept_and_its_sides_cut() {
        // Red, green and blue thirds: a square picture shows the green one.
        let third = |x: usize| [0, 1, 2].map(|c| if x / 10 == c { 1.0 } else { 0.0 });
        let image = backdrop(30, 10, |x, _| third(x)).behind(Image::transparent(10, 10));
        assert!(
            image.rgba.iter().all(|pixel| pixel[1] == 1.0),
            "only green: {:?}",
            image.pixel(0, 0)
        );
    }

    #[test]
    fn an_opaque_pixel_hides_the_background() {
        let mut image = Image::transparent(1, 1);
        image.rgba[0] = [0.25, 0.5, 0.75, 1.0];
        let seen = backdrop(1, 1, |_, _| [1.0; 3]).behind(image);
        assert_eq!(
            seen.rgba[0],
            [0.25, 0.5, 0.75, 1.0],
            "the picture's own pixel"
        );
    }
}
