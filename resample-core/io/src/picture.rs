//! A picture in linear light, as every format leaves it.

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
