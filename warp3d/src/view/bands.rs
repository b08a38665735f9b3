//! Bands of target rows: what one task owns.
//!
//! The cut does not look at the number of threads, so the same bytes come out on any number of them.

/// Rows of a band, px. Small enough that a full-HD picture has 34 of them to share out, large enough that a segment of
/// a reference row seldom touches more than two.
pub(crate) const BAND_ROWS: usize = 32;

/// A closed range of screen rows (px), empty when `low > high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RowRange {
    /// Lowest screen y.
    pub(crate) low: f32,
    /// Highest screen y.
    pub(crate) high: f32,
}

impl RowRange {
    /// Nothing.
    pub(crate) const EMPTY: Self = Self {
        low: f32::INFINITY,
        high: f32::NEG_INFINITY,
    };

    /// Widens the range to hold `y`.
    pub(crate) fn include(&mut self, y: f32) {
        self.low = self.low.min(y);
        self.high = self.high.max(y);
    }

    /// Widens the range to hold `other`.
    pub(crate) fn join(&mut self, other: Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    /// Returns true if the range touches rows `first..end` (px).
    pub(crate) fn touches(&self, first: usize, end: usize) -> bool {
        self.high >= first as f32 && self.low <= end as f32
    }
}
