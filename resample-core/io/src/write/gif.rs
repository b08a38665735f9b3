//! Animated GIF: 256 colours a picture, opaque, for places that show nothing newer.
//!
//! Takes pictures of opaque 8-bit colours, one after another, gives the bytes of a file that repeats for ever. Each picture has its own palette,
//! found by the network of Dekker 1994 as the crate `gif` has it. Times are whole hundredths of a second; pictures keep their times on average.

use std::io::Write;

use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, ImageResult, RgbaImage};

use crate::film::FrameRate;

/// Most pixels a side.
pub const MAX_SIDE: u32 = u16::MAX as u32;

/// Speed of the search for a palette: 1 is the most exact, 30 the fastest. The crate `gif` recommends 10.
const EFFORT: i32 = 10;

/// An animation in the making.
pub struct Gif<W: Write> {
    encoder: GifEncoder<W>,
    size: [u32; 2],
    rate: FrameRate,
    /// Pictures so far.
    count: u32,
}

impl<W: Write> Gif<W> {
    /// Begins an animation of pictures of `size` pixels, width and height, each at most [`MAX_SIDE`].
    ///
    /// # Errors
    /// Those of writing.
    pub fn begin(to: W, size: [u32; 2], rate: FrameRate) -> ImageResult<Self> {
        let mut encoder = GifEncoder::new_with_speed(to, EFFORT);
        encoder.set_repeat(Repeat::Infinite)?;
        Ok(Self {
            encoder,
            size,
            rate,
            count: 0,
        })
    }

    /// Adds a picture: red, green and blue of each pixel, row by row from the top.
    ///
    /// # Errors
    /// Those of writing.
    pub fn add(&mut self, rgb: &[u8]) -> ImageResult<()> {
        let [width, height] = self.size;
        let rgba = rgb
            .chunks_exact(3)
            .flat_map(|pixel| [pixel[0], pixel[1], pixel[2], u8::MAX]);
        let mut picture = RgbaImage::new(width, height);
        picture
            .as_flat_samples_mut()
            .samples
            .iter_mut()
            .zip(rgba)
            .for_each(|(sample, code)| *sample = code);
        // Hundredths of a second at which this picture ends, less that at which it begins.
        let at = |count: u32| (f64::from(count) * 100.0 / self.rate.per_second()).round();
        let hundredths = resample_core::narrow::code32(at(self.count + 1) - at(self.count)).max(1);
        self.count += 1;
        let delay = Delay::from_numer_denom_ms(10 * hundredths, 1);
        self.encoder
            .encode_frame(Frame::from_parts(picture, 0, 0, delay))
    }
}
