//! Slopes of the samples beside cuts, which frames ask for; those of all others are computed when somebody asks.
//!
//! One bit a sample says which are kept, and a count for each word of bits where they begin.

use rayon::prelude::*;

/// Samples of a word.
const WORD: usize = 64;

/// Change of disparity of some samples along each axis, backwards and forwards.
#[derive(Clone, Debug, Default)]
pub(crate) struct Slopes {
    kept: Vec<u64>,
    /// Number of slopes before those of each word.
    before: Vec<u32>,
    slopes: Vec<[[f32; 2]; 2]>,
}

impl Slopes {
    /// Those of the samples up to `count` for which `is_kept` holds.
    pub(crate) fn new(
        count: usize,
        is_kept: impl Fn(usize) -> bool + Sync,
        slope: impl Fn(usize) -> [[f32; 2]; 2] + Sync + Send,
    ) -> Self {
        let samples = |word: usize| word * WORD..((word + 1) * WORD).min(count);
        let bits = |word: usize| {
            let kept = samples(word).map(|index| u64::from(is_kept(index)) << (index % WORD));
            kept.sum::<u64>()
        };
        let kept: Vec<u64> = (0..count.div_ceil(WORD))
            .into_par_iter()
            .map(bits)
            .collect();
        let mut end = 0;
        let before = kept.iter().map(|bits| {
            let before = end;
            end += bits.count_ones();
            before
        });
        let before = before.collect();
        let is_set = |index: &usize| kept[index / WORD] >> (index % WORD) & 1 != 0;
        let slopes = (0..kept.len()).into_par_iter();
        let slopes = slopes.flat_map_iter(|word| samples(word).filter(is_set).map(&slope));
        Self {
            slopes: slopes.collect(),
            kept,
            before,
        }
    }

    /// The slope of a sample if it is kept.
    #[inline(always)]
    pub(crate) fn get(&self, index: usize) -> Option<[[f32; 2]; 2]> {
        let (word, bit) = (index / WORD, 1 << (index % WORD));
        let kept = self.kept[word];
        let among = (kept & (bit - 1)).count_ones();
        (kept & bit != 0).then(|| self.slopes[(self.before[word] + among) as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_slopes_are_found_and_others_are_not() {
        let is_kept = |i: usize| i.is_multiple_of(3) || i == 127;
        let slopes = Slopes::new(200, is_kept, |i| [[i as f32; 2], [-(i as f32); 2]]);
        for i in 0..200 {
            let expected = is_kept(i).then_some([[i as f32; 2], [-(i as f32); 2]]);
            assert_eq!(slopes.get(i), expected, "sample {i}");
        }
        assert!(Slopes::new(0, is_kept, |_| [[0.0; 2]; 2]).kept.is_empty());
    }
}
