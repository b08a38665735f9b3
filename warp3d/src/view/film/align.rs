//! How much the depth of a picture is scaled and shifted against that of the pictures before it.
//!
//! Takes pairs of inverse depths at the same things, gives scale and offset that make the new ones like the old. Most pairs
//! are right: those that depart count ever less (iterated least squares with Tukey's weights).

use resample_core::narrow::single;

/// The change that a picture's depth may have against that of another picture, as the depth of a network does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// Nothing: depth was measured.
    None,
    /// A factor.
    Scale,
    /// A factor and an offset of inverse depth.
    ScaleAndOffset,
}

/// Scale and offset of inverse depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    pub(crate) scale: f32,
    pub(crate) offset: f32,
    /// Standard deviation of the residuals of the pairs that agree.
    pub(crate) left: f32,
}

/// Rounds of weights: after ten nothing changes in the fifth digit.
const ROUNDS: usize = 10;

/// Deviations at which a pair no longer counts, Tukey's usual choice.
const CUT: f64 = 4.685;

/// Largest change of scale that is a network's; beyond it the scene has changed.
const MOST_SCALE: f64 = 2.0;

/// Least share of the pairs that must agree.
const AGREE: f64 = 0.3;

impl Line {
    pub(crate) fn of(self, value: f32) -> f32 {
        self.scale * value + self.offset
    }

    /// The line from the first to the second numbers of `pairs`; none where they agree on no line.
    pub(crate) fn through(pairs: &[[f32; 2]], freedom: Freedom) -> Option<Self> {
        if pairs.len() < 16 {
            return None;
        }
        let mut weights = vec![1.0f64; pairs.len()];
        let mut line = (1.0, 0.0, 0.0);
        for round in 0..ROUNDS {
            let (scale, offset) = match (round, freedom) {
                (_, Freedom::None) => (1.0, 0.0),
                (0, _) => (median_ratio(pairs), 0.0),
                (_, Freedom::Scale) => (fitted(pairs, &weights, false)?.0, 0.0),
                (_, Freedom::ScaleAndOffset) => fitted(pairs, &weights, true)?,
            };
            let apart =
                |&[from, to]: &[f32; 2]| (scale * f64::from(from) + offset - f64::from(to)).abs();
            let mut sorted: Vec<f64> = pairs.iter().map(apart).collect();
            let middle = sorted.len() / 2;
            let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
            // The deviation of numbers whose median distance is this, if they are normal.
            let deviation = 1.4826 * median;
            line = (scale, offset, deviation);
            let reach = CUT * deviation.max(1e-12);
            for (weight, pair) in weights.iter_mut().zip(pairs) {
                let share = (apart(pair) / reach).min(1.0);
                *weight = (1.0 - share * share).powi(2);
            }
        }
        let (scale, offset, left) = line;
        let agree = weights.iter().filter(|&&weight| weight > 0.1).count();
        let is_like = (1.0 / MOST_SCALE..=MOST_SCALE).contains(&scale)
            && agree as f64 >= AGREE * pairs.len() as f64;
        is_like.then_some(Self {
            scale: single(scale),
            offset: single(offset),
            left: single(left),
        })
    }
}

/// The median ratio of all pairs: a beginning that a third of wrong pairs does not spoil.
fn median_ratio(pairs: &[[f32; 2]]) -> f64 {
    let ratios = pairs.iter().filter(|pair| pair[0] > 0.0);
    let mut ratios: Vec<f64> = ratios
        .map(|&[from, to]| f64::from(to) / f64::from(from))
        .collect();
    let middle = ratios.len() / 2;
    match ratios.is_empty() {
        true => 1.0,
        false => *ratios.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

/// Weighted least squares. Scenes of one depth say nothing about an offset: it is drawn to 0 a little.
fn fitted(pairs: &[[f32; 2]], weights: &[f64], with_offset: bool) -> Option<(f64, f64)> {
    let (mut w, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (&[from, to], &weight) in pairs.iter().zip(weights) {
        let (from, to) = (f64::from(from), f64::from(to));
        w += weight;
        x += weight * from;
        y += weight * to;
        xx += weight * from * from;
        xy += weight * from * to;
    }
    if !(xx > 0.0) {
        return None;
    }
    if !with_offset {
        return Some((xy / xx, 0.0));
    }
    // As if a thousandth of the weight were pairs that say that there is no offset.
    let ridge = w * 1.001;
    let determinant = xx * ridge - x * x;
    Some((
        (ridge * xy - x * y) / determinant,
        (xx * y - x * xy) / determinant,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_among_wrong_pairs() {
        let pairs: Vec<[f32; 2]> = (0..1_000)
            .map(|i| {
                let from = 0.1 + 0.9 * (i as f32 * 0.618).fract();
                let noise = 0.004 * ((i as f32 * 0.391).fract() - 0.5);
                let to = if i % 4 == 0 {
                    0.9
                } else {
                    1.05 * from - 0.02 + noise
                };
                [from, to]
            })
            .collect();
        let line = Line::through(&pairs, Freedom::ScaleAndOffset).expect("a line");
        assert!((line.scale - 1.05).abs() < 2e-3, "{line:?}");
        assert!((line.offset + 0.02).abs() < 2e-3, "{line:?}");
        let scale = Line::through(&pairs, Freedom::Scale).expect("a factor");
        assert!(
            scale.offset == 0.0 && (scale.scale - 1.02).abs() < 0.02,
            "{scale:?}"
        );
        let none = Line::through(&pairs, Freedom::None).expect("no freedom");
        assert_eq!((none.scale, none.offset), (1.0, 0.0));
    }

    #[test]
    fn pairs_that_have_nothing_in_common_have_no_line() {
        let pairs: Vec<[f32; 2]> = (0..1_000)
            .map(|i| [(i as f32 * 0.618).fract(), 5.0 + (i as f32 * 0.414).fract()])
            .collect();
        assert_eq!(Line::through(&pairs, Freedom::ScaleAndOffset), None);
        assert_eq!(Line::through(&pairs[..3], Freedom::Scale), None);
        let flat = [[0.5f32, 0.55]; 40];
        let line = Line::through(&flat, Freedom::ScaleAndOffset).expect("a factor");
        assert!((line.of(0.5) - 0.55).abs() < 1e-3, "{line:?}");
    }
}
