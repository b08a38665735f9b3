//! Sub-pixels of a row that are computed together, in vectors.

use crate::span::SPAN_PX;

/// Sub-pixels that are computed together.
pub(crate) const LANES: usize = 16;

/// Sub-pixels of a row, and room for a vector that begins at the last of them.
pub(crate) const ROW: usize = SPAN_PX + LANES;

/// A number for each sub-pixel of a row.
pub(crate) type Lanes = [f32; ROW];

/// The number of each lane.
pub(crate) const IOTA: [f32; LANES] = [
    0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
];
