//! Sub-pixels that are computed together, in vectors.

/// Sub-pixels that are computed together.
pub(crate) const LANES: usize = 16;

/// A number for each of them.
pub(crate) type Lanes = [f32; LANES];

/// The number of each lane.
pub(crate) const IOTA: Lanes = [
    0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
];
