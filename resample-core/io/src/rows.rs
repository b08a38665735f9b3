//! Rows of a picture as a file stores them.

use resample_core::Error;

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
