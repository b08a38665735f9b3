//! Conversions to smaller numbers, each in one place: records of a frame hold f32 and u16 where the mathematics is f64 and usize.

/// The nearest f32: 24 bits, which suffice for what is relative to the eye, the tile or the pixel. Beyond the range it is infinite.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the nearest f32 is what is wanted"
)]
pub fn single(value: f64) -> f32 {
    value as f32
}

/// A column, a row, or a count of tiles: pictures have at most 32,768 pixels along a side, which a u16 holds.
///
/// ```
/// use resample_core::narrow::side;
///
/// assert_eq!(side(32_768), 32_768);
/// assert_eq!(side(1 << 20), u16::MAX);
/// ```
pub fn side(value: usize) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}

/// The whole number below a position on the screen, px, brought into what a u16 holds; NaN gives 0.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn pixel(pos_px: f64) -> u16 {
    pos_px as u16
}
