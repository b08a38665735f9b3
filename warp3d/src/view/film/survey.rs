//! A film looked through once, small: its shots, and the range of the depths of each.

use resample_core::narrow::{code16, whole};

use super::cuts::{Cuts, Thumb};

/// Bins between the least and the largest number: of 65,536 codes each has its own.
const BINS: usize = 1 << 16;

/// A shot of a film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Its first picture.
    pub first: usize,
    /// The stored numbers of which this share of all is smaller and larger; `None` where nothing is known.
    pub range: Option<[f64; 2]>,
}

/// The changes and the codes of the pictures so far.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    cuts: Cuts,
    /// How often each code occurs in each picture, of those that occur.
    counts: Vec<Vec<(u16, u32)>>,
}

impl Survey {
    /// Adds a picture that is `width` wide, and the stored numbers of its depth, whole numbers up to 65,535 of which larger ones are nearer.
    pub fn add(&mut self, colour: &[[f32; 3]], width: usize, numbers: &[f32], its_width: usize) {
        self.cuts.add(Thumb::new(colour, width, numbers, its_width));
        let mut sorted: Vec<u16> = numbers
            .iter()
            .filter(|v| v.is_finite())
            .map(|&v| code16(f64::from(v)))
            .collect();
        sorted.sort_unstable();
        let mut counts: Vec<(u16, u32)> = Vec::new();
        for code in sorted {
            match counts.last_mut() {
                Some((last, count)) if *last == code => *count += 1,
                _ => counts.push((code, 1)),
            }
        }
        self.counts.push(counts);
    }

    /// How many pictures there are.
    pub fn pictures(&self) -> usize {
        self.counts.len()
    }

    /// The shots; those that begin at the pictures of `cuts`, if they are given. `share` of the numbers at each end are left out of a range.
    pub fn shots(&self, cuts: Option<&[usize]>, share: f64) -> Vec<Shot> {
        let mut firsts = cuts.map_or_else(|| self.cuts.all(), <[usize]>::to_vec);
        firsts.retain(|&first| first < self.pictures());
        firsts.push(0);
        firsts.sort_unstable();
        firsts.dedup();
        let end = |number: usize| firsts.get(number + 1).copied().unwrap_or(self.pictures());
        (0..firsts.len())
            .map(|number| Shot {
                first: firsts[number],
                range: self.range(firsts[number]..end(number), share),
            })
            .collect()
    }

    fn range(&self, pictures: std::ops::Range<usize>, share: f64) -> Option<[f64; 2]> {
        let mut bins = vec![0u64; BINS];
        for &(code, count) in self.counts.get(pictures)?.iter().flatten() {
            bins[usize::from(code)] += u64::from(count);
        }
        let all: u64 = bins.iter().sum();
        let left_out = whole(share * all as f64);
        let low = passed(0..BINS, &bins, left_out)?;
        let high = passed((0..BINS).rev(), &bins, left_out)?;
        (low < high).then_some([low as f64, high as f64])
    }
}

/// The first code at which more than `left_out` numbers have passed.
fn passed(mut codes: impl Iterator<Item = usize>, bins: &[u64], left_out: u64) -> Option<usize> {
    let mut passed = 0;
    codes.find(|&code| {
        passed += bins[code];
        passed > left_out
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shot_has_the_range_of_its_pictures() {
        let mut survey = Survey::default();
        for index in 0..20u16 {
            let shot = u16::from(index >= 12);
            let number = |i: u16| f32::from(100 * shot + (i % 50) + 20);
            let numbers: Vec<f32> = (0..600).map(number).collect();
            let light = |i: u16| [0.1 + 0.8 * f32::from(shot ^ u16::from(i % 30 < 15)); 3];
            let colour: Vec<[f32; 3]> = (0..600).map(light).collect();
            survey.add(&colour, 30, &numbers, 30);
        }
        let shots = survey.shots(None, 0.0);
        let expected = [(0, [20.0, 69.0]), (12, [120.0, 169.0])];
        assert_eq!(survey.pictures(), 20);
        assert_eq!(shots.len(), 2);
        for (shot, (first, range)) in shots.iter().zip(expected) {
            assert_eq!((shot.first, shot.range), (first, Some(range)));
        }
        let given = survey.shots(Some(&[5, 99]), 0.0);
        let firsts: Vec<usize> = given.iter().map(|shot| shot.first).collect();
        assert_eq!(firsts, [0, 5], "given cuts, those beyond the end left out");
        assert_eq!(given[1].range, Some([20.0, 169.0]));
        // A number in a hundred at each end.
        assert_eq!(survey.shots(None, 0.03)[0].range, Some([21.0, 68.0]));
    }
}
