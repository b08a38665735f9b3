//! The numbers of a depth file as they are stored, before anything is said about their meaning.

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
