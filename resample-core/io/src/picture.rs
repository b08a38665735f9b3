//! A picture in linear light, a plane of numbers, and rows of either, as every format leaves them.

use resample_core::Error;

/// A picture in linear light.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// Linear red, green and blue, not premultiplied, all finite; rows from the top.
    pub rgb: Vec<[f32; 3]>,
    /// Covered part of each pixel, 0 to 1, where the file holds it; 0 where it holds no pixel.
    pub coverage: Option<Vec<f32>>,
}

/// The bytes that a picture takes while it is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Storage {
    /// Width and height, px.
    pub size: [u32; 2],
    /// Bytes of a channel: 1, 2, or 4 for any number.
    pub channel_bytes: u8,
    /// Bytes a pixel that the decoder holds at most.
    pub decoder_bytes: u64,
}

/// One number per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// The stored numbers, rows from the top; NaN where the file holds no pixel.
    pub values: Vec<f32>,
    /// The kind of the numbers.
    pub stored: Stored,
}

/// How numbers are stored, which decides what 0 may mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stored {
    /// Floating point.
    Float,
    /// Whole numbers from 0 to this largest code, such as 255 or 65535.
    Code(u32),
}

/// The numbers of a row as they are stored: 1 to 4 channels a pixel (grey, grey and alpha, colours, colours and alpha).
pub(super) enum Row<'a> {
    /// 8 bits.
    Bytes(&'a [u8]),
    /// 16 bits.
    Words(&'a [u16]),
    /// Single precision, linear light.
    Floats(&'a [f32]),
}

/// A receiver of a picture's rows.
pub(super) trait Rows {
    /// Width and height, px, and the number of channels.
    fn begin(&mut self, size: [usize; 2], channels: usize) -> Result<(), Error>;
    /// The row `y`.
    fn row(&mut self, y: usize, row: &Row<'_>) -> Result<(), Error>;
}
