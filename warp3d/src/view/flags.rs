//! One bit a pixel: sets of pixels that are grown, counted and asked for by rectangles, 64 pixels at a time.

use std::ops::Range;

use rayon::prelude::*;

/// Pixels of a word.
const WORD: usize = 64;

/// A set of pixels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Flags {
    words: Vec<u64>,
    per_row: usize,
}

impl Flags {
    /// The pixels of a picture of `width` for which `is_set(index)` holds, where `may_be(indices)` says that one may be.
    pub(crate) fn by_words(
        width: usize,
        height: usize,
        may_be: impl Fn(Range<usize>) -> bool + Sync,
        is_set: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let per_row = width.div_ceil(WORD);
        let mut words = vec![0; per_row * height];
        words
            .par_chunks_mut(per_row.max(1))
            .enumerate()
            .for_each(|(y, row)| {
                for (k, word) in row.iter_mut().enumerate() {
                    let first = y * width + k * WORD;
                    let count = WORD.min(width - k * WORD);
                    if may_be(first..first + count) {
                        let set = |bits, i| bits | u64::from(is_set(first + i)) << i;
                        *word = (0..count).fold(0, set);
                    }
                }
            });
        Self { words, per_row }
    }

    /// The set grown by `by` pixels along each axis, `by` below 64. Bits beyond the width may be set.
    pub(crate) fn grown(&self, by: usize) -> Self {
        let mut wide = self.clone();
        wide.words
            .par_chunks_mut(self.per_row.max(1))
            .zip(self.words.par_chunks(self.per_row.max(1)))
            .for_each(|(wide, row)| {
                for (k, word) in wide.iter_mut().enumerate() {
                    let before = if k > 0 { row[k - 1] } else { 0 };
                    let after = row.get(k + 1).copied().unwrap_or(0);
                    for step in 1..=by {
                        *word |= row[k] << step | row[k] >> step;
                        *word |= before >> (WORD - step) | after << (WORD - step);
                    }
                }
            });
        let mut grown = wide.clone();
        let height = self.words.len() / self.per_row.max(1);
        grown
            .words
            .par_chunks_mut(self.per_row.max(1))
            .enumerate()
            .for_each(|(y, grown)| {
                for from in y.saturating_sub(by)..(y + by + 1).min(height) {
                    for (word, &other) in grown.iter_mut().zip(wide.row(from)) {
                        *word |= other;
                    }
                }
            });
        grown
    }

    /// Those pixels of the set, in a picture of `width`, for which `keep(index)` holds.
    pub(crate) fn kept(&self, width: usize, keep: impl Fn(usize) -> bool + Sync) -> Self {
        let mut kept = self.clone();
        kept.words
            .par_chunks_mut(self.per_row.max(1))
            .enumerate()
            .for_each(|(y, row)| {
                for (k, word) in row.iter_mut().enumerate().filter(|(_, word)| **word != 0) {
                    let inside = Bits(*word).filter(|i| k * WORD + i < width);
                    let keeps = inside.filter(|i| keep(y * width + k * WORD + i));
                    *word = keeps.fold(0, |bits, i| bits | 1 << i);
                }
            });
        kept
    }

    /// The pixels of row `y` from `x` on, which is the first of a word: one bit each.
    #[inline(always)]
    pub(crate) fn word(&self, x: usize, y: usize) -> u64 {
        self.words[y * self.per_row + x / WORD]
    }

    /// Returns true if any pixel of these columns and rows, first and last, is in the set.
    #[inline]
    pub(crate) fn any(&self, columns: [usize; 2], rows: [usize; 2]) -> bool {
        let [first, last] = [columns[0] / WORD, columns[1] / WORD];
        let mask = |k: usize| {
            let from = if k == first {
                u64::MAX << (columns[0] % WORD)
            } else {
                u64::MAX
            };
            let to = if k == last {
                u64::MAX >> (WORD - 1 - columns[1] % WORD)
            } else {
                u64::MAX
            };
            from & to
        };
        (rows[0]..=rows[1]).any(|y| {
            let row = self.row(y);
            (first..=last).any(|k| row[k] & mask(k) != 0)
        })
    }

    /// The pixels of row `y` that are in the set, those beyond `width` left out.
    pub(crate) fn columns(&self, y: usize, width: usize) -> impl Iterator<Item = usize> {
        let words = self.row(y).iter().enumerate();
        words
            .flat_map(|(k, &word)| Bits(word).map(move |i| k * WORD + i))
            .take_while(move |&x| x < width)
    }

    fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.per_row..(y + 1) * self.per_row]
    }
}

/// The places of the bits of a word.
struct Bits(u64);

impl Iterator for Bits {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        (self.0 != 0).then(|| {
            let place = self.0.trailing_zeros() as usize;
            self.0 &= self.0 - 1;
            place
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_grow_and_are_asked_for_across_words() {
        let (width, height) = (150, 9);
        let set = [(63, 2), (64, 5), (0, 0), (149, 8)];
        let is_set = |i: usize| set.contains(&(i % width, i / width));
        let flags = Flags::by_words(width, height, |mut word| word.any(is_set), is_set);
        let grown = flags.grown(2);
        for y in 0..height {
            let near = |x: usize| {
                set.iter()
                    .any(|&(u, v)| x.abs_diff(u) <= 2 && y.abs_diff(v) <= 2)
            };
            let expected: Vec<usize> = (0..width).filter(|&x| near(x)).collect();
            assert_eq!(
                grown.columns(y, width).collect::<Vec<_>>(),
                expected,
                "row {y}"
            );
            assert!(
                (0..width).all(|x| grown.word(x, y) >> (x % WORD) & 1 == u64::from(near(x))),
                "row {y}"
            );
        }
        assert!(
            flags.any([60, 63], [0, 2]) && flags.any([64, 149], [5, 5]),
            "rectangles that hold a pixel"
        );
        assert!(
            !flags.any([1, 62], [0, 8]) && !flags.any([65, 149], [0, 7]),
            "rectangles that hold none"
        );
    }
}
