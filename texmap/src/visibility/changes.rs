//! Where rows of sub-pixels show other triangles than other rows: a bit for each column.

use fearless_simd::prelude::*;
use fearless_simd::u32x16;
use fearless_simd_macros::simd;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::screen::lanes::LANES;
use crate::screen::padded_tile::SPAN_WIDTH;

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

#[cfg(test)]
mod tests {
    use super::*;
    use resample_core::simd::SimdLevel;

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
}
