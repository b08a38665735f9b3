//! Rows of sub-pixels: where they show other triangles than other rows, a bit for each column, and the runs of one triangle.

use fearless_simd::prelude::*;
use fearless_simd::u32x16;
use fearless_simd_macros::simd;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::screen::{LANES, NONE, SPAN_WIDTH};

/// Two pieces of rows that are compared: where each begins, and how many sub-pixels they have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub(crate) here: usize,
    pub(crate) there: usize,
    pub(crate) len: usize,
}

impl Pair {
    /// The sub-pixels of a row, and those of another one so many columns farther right.
    pub(crate) fn of_rows([row, other]: [usize; 2], shift: isize) -> Self {
        let first = (-shift).max(0) as usize;
        Self {
            here: row * SPAN_WIDTH + first,
            there: (other * SPAN_WIDTH + first).wrapping_add_signed(shift),
            len: SPAN_WIDTH - shift.unsigned_abs(),
        }
    }
}

/// Lists for each pair at which of its sub-pixels the two show different triangles. Behind the last row there is room for a
/// vector.
pub(crate) fn changes(simd: Vectors, ids: &[u32], pairs: &[Pair], out: &mut Vec<u32>) {
    out.clear();
    dispatch!(simd, simd => compare(simd, ids, pairs, out));
}

#[simd]
fn compare<S: Simd>(simd: S, ids: &[u32], pairs: &[Pair], out: &mut Vec<u32>) {
    const { assert!(SPAN_WIDTH <= 2 * LANES) };
    for &Pair { here, there, len } in pairs {
        let mut same = vector_compared(simd, ids, [here, there]);
        if len > LANES {
            same |= vector_compared(simd, ids, [here + LANES, there + LANES]) << LANES;
        }
        out.push((!same & ((1 << len) - 1)) as u32);
    }
}

/// A bit for each of sixteen sub-pixels that show the same.
#[inline(always)]
fn vector_compared<S: Simd>(simd: S, ids: &[u32], [here, there]: [usize; 2]) -> u64 {
    let here = u32x16::from_slice(simd, &ids[here..here + LANES]);
    let there = u32x16::from_slice(simd, &ids[there..there + LANES]);
    here.simd_eq(there).to_bitmask()
}

/// The numbers of the bits that are set, the least first.
pub(crate) fn each_bit(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = bits.trailing_zeros() as usize;
        let found = bits != 0;
        bits &= bits.wrapping_sub(1);
        found.then_some(bit)
    })
}

// Sub-pixels sorted by the triangle that they show, so that those of one triangle are computed together.

/// Sub-pixels that stand beside each other in a row and show one triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Run {
    /// Place of the triangle in the tile's list.
    pub(crate) id: u32,
    /// The first sub-pixel, by its place in the tile's span.
    pub(crate) subpixel: u32,
    /// Where the colour of the first one goes; those of the others follow.
    pub(crate) place: u32,
    /// How many they are.
    pub(crate) len: u32,
}

/// Runs of sub-pixels, triangle by triangle.
#[derive(Clone, Debug, Default)]
pub(crate) struct ByTriangle {
    /// As they came.
    runs: Vec<Run>,
    sorted: Vec<Run>,
    /// By triangle: how many runs it has, then where its next one goes; 0 for those that are not shown.
    next: Vec<u32>,
    shown: Vec<u32>,
}

impl ByTriangle {
    /// Forgets all runs.
    pub(crate) fn clear(&mut self) {
        self.runs.clear();
    }

    /// Adds the runs of a row: of the wanted sub-pixels that show something.
    #[inline(always)]
    pub(crate) fn push_row(&mut self, ids: &[u32], wanted: &[bool], [subpixel, place]: [u32; 2]) {
        let (ids, wanted) = (&ids[..SPAN_WIDTH], &wanted[..SPAN_WIDTH]);
        let mut column = 0;
        while column < SPAN_WIDTH {
            let (first, id) = (column, ids[column]);
            column += 1;
            if !wanted[first] || id == NONE {
                continue;
            }
            while column < SPAN_WIDTH && wanted[column] && ids[column] == id {
                column += 1;
            }
            self.runs.push(Run {
                id,
                subpixel: subpixel + first as u32,
                place: place + first as u32,
                len: (column - first) as u32,
            });
        }
    }

    /// Sorts the runs: triangle by triangle, in the order in which these came first. The tile's list has so many triangles.
    pub(crate) fn sort(&mut self, triangles: usize) -> &[Run] {
        let Self {
            runs,
            sorted,
            next,
            shown,
        } = self;
        if next.len() < triangles {
            next.resize(triangles, 0);
        }
        shown.clear();
        for run in &*runs {
            let count = &mut next[run.id as usize];
            if *count == 0 {
                shown.push(run.id);
            }
            *count += 1;
        }
        let mut start = 0;
        for &id in &*shown {
            start += std::mem::replace(&mut next[id as usize], start);
        }
        sorted.resize(runs.len(), Run::default());
        for run in &*runs {
            let at = &mut next[run.id as usize];
            sorted[*at as usize] = *run;
            *at += 1;
        }
        shown.iter().for_each(|&id| next[id as usize] = 0);
        sorted
    }
}

#[cfg(test)]
mod tests {
    use resample_core::simd::SimdLevel;

    use super::*;

    #[test]
    fn changes_are_those_of_single_subpixels() {
        let mut ids: Vec<u32> = (0..200).map(|k| (k * k % 7) / 2).collect();
        ids.resize(200 + LANES, 0);
        let pairs: Vec<Pair> = (0..150)
            .map(|k| Pair {
                here: k,
                there: k * 37 % 150 + 11,
                len: SPAN_WIDTH - k % 3,
            })
            .collect();
        for simd in SimdLevel::ALL.map(SimdLevel::resolve) {
            let mut found = vec![5];
            changes(simd, &ids, &pairs, &mut found);
            assert_eq!(found.len(), pairs.len());
            for (bits, pair) in found.into_iter().zip(&pairs) {
                let differs = |&k: &usize| ids[pair.here + k] != ids[pair.there + k];
                let wanted: Vec<usize> = (0..pair.len).filter(differs).collect();
                assert_eq!(each_bit(bits).collect::<Vec<_>>(), wanted, "{pair:?}");
            }
        }
    }

    #[test]
    fn runs_of_a_triangle_stand_together_in_their_order() {
        let mut by_triangle = ByTriangle::default();
        let mut ids = [NONE; SPAN_WIDTH];
        ids[2..9].copy_from_slice(&[7, 7, 2, 2, 2, NONE, 7]);
        ids[SPAN_WIDTH - 1] = 0;
        let mut wanted = [true; SPAN_WIDTH];
        wanted[5] = false;
        let run = |id, subpixel, len| Run {
            id,
            subpixel,
            place: subpixel + 1000,
            len,
        };
        // Storage is used again.
        for _ in 0..2 {
            by_triangle.clear();
            by_triangle.push_row(&ids, &wanted, [100, 1100]);
            by_triangle.push_row(&[2; SPAN_WIDTH], &[true; SPAN_WIDTH], [300, 1300]);
            let last = 100 + SPAN_WIDTH as u32 - 1;
            let sorted = [
                run(7, 102, 2),
                run(7, 108, 1),
                run(2, 104, 1),
                run(2, 106, 1),
                run(2, 300, SPAN_WIDTH as u32),
                run(0, last, 1),
            ];
            assert_eq!(by_triangle.sort(8), sorted);
        }
    }
}
