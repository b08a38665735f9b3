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
///
/// ```
/// use resample_core::narrow::pixel;
///
/// assert_eq!([-1.0, 2.6, 1e9, f64::NAN].map(pixel), [0, 2, u16::MAX, 0]);
/// ```
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn pixel(pos_px: f64) -> u16 {
    pos_px as u16
}

/// A number of a file as a code of 8 bits, brought into 0 to 255; NaN gives 0.
///
/// ```
/// use resample_core::narrow::code8;
///
/// assert_eq!([-1.0, 2.6, 1e9, f64::NAN].map(code8), [0, 2, u8::MAX, 0]);
/// ```
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn code8(value: f64) -> u8 {
    value as u8
}

/// The nearest code of 16 bits to a number, brought into 0 to 65535; NaN gives 0.
///
/// ```
/// use resample_core::narrow::code16;
///
/// assert_eq!([-1.0, 2.6, 1e9].map(code16), [0, 3, u16::MAX]);
/// ```
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn code16(value: f64) -> u16 {
    value.round() as u16
}

/// A whole number with its sign, rounded down.
///
/// ```
/// use resample_core::narrow::floor;
///
/// assert_eq!(floor(-1.5), -2);
/// ```
#[inline]
#[expect(
    clippy::cast_possible_truncation,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn floor(value: f64) -> i64 {
    value.floor() as i64
}

/// A count of a file as an index; one that is too great for the machine becomes the greatest, which memory never holds.
pub fn count(value: u64) -> usize {
    usize::try_from(value).unwrap_or(usize::MAX)
}

/// A number of a file as a code of 32 bits, brought into the range of u32, rounded down; NaN gives 0.
///
/// ```
/// use resample_core::narrow::code32;
///
/// assert_eq!([-1.0, 2.6, 1e12, f64::NAN].map(code32), [0, 2, u32::MAX, 0]);
/// ```
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn code32(value: f64) -> u32 {
    value as u32
}

/// A number as a count, rounded down; one that is negative or NaN gives 0, one that is too great the greatest.
///
/// ```
/// use resample_core::narrow::whole;
///
/// assert_eq!([-1.0, 2.6, f64::INFINITY].map(whole), [0, 2, u64::MAX]);
/// ```
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn whole(value: f64) -> u64 {
    value as u64
}

/// An index in 32 bits; one that is too great becomes the greatest, which no list of ours holds.
///
/// ```
/// use resample_core::narrow::index32;
///
/// assert_eq!(index32(7), 7);
/// ```
#[inline(always)]
pub fn index32(value: usize) -> u32 {
    value.try_into().unwrap_or(u32::MAX)
}

/// The index of the cell that a place lies in, counted from 0; 0 before it, and where the place is no number.
///
/// ```
/// use resample_core::narrow::cell;
///
/// assert_eq!([cell(2.9), cell(-1.5), cell(f32::NAN)], [2, 0, 0]);
/// ```
#[inline(always)]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn cell(place: f32) -> usize {
    place as usize
}

/// The nearest code of 8 bits.
///
/// ```
/// use resample_core::narrow::byte;
///
/// assert_eq!([byte(2.4), byte(-1.0), byte(300.0)], [2, 0, 255]);
/// ```
#[inline(always)]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, which is what is wanted"
)]
pub fn byte(value: f32) -> u8 {
    (value + 0.5) as u8
}
