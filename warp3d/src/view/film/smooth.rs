//! Noise within one picture's depth: averaged along surfaces before it is averaged over time.
//!
//! Takes inverse depth, gives it with each pixel the mean of its neighbours that differ by no more than noise does (the sigma filter, J.-S. Lee 1983, along rows
//! and then along columns). The noise is measured: surfaces bend little from pixel to pixel, so that most second differences are
//! noise. Depth without noise stays to the bit.

use rayon::prelude::*;

/// Neighbours to each side: a mean of 25, so that noise is a fifth of itself.
const REACH: usize = 2;

/// Deviations by which two pixels of one surface differ at most.
const SAME: f32 = 2.5;

/// Second differences that are looked at.
const PLACES: usize = 50_000;

/// Takes noise out of inverse depth; NaN stays.
pub(crate) fn denoise(nearness: &mut [f32], width: usize) {
    let noise = noise(nearness, width);
    if !(noise > 0.0) || width < 3 {
        return;
    }
    let height = nearness.len() / width;
    let limit = SAME * noise;
    let mut along = vec![0.0; nearness.len()];
    along
        .par_chunks_mut(width)
        .zip(nearness.par_chunks(width))
        .for_each(|(to, row)| {
            for (x, to) in to.iter_mut().enumerate() {
                let part = &row[x.saturating_sub(REACH)..(x + REACH + 1).min(width)];
                *to = mean_near(row[x], part.iter().copied(), limit);
            }
        });
    // The noise that is left along a row is smaller: its surfaces differ by less across rows.
    nearness
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, to)| {
            let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(height);
            for (x, to) in to.iter_mut().enumerate() {
                let column = rows.clone().map(|row| along[row * width + x]);
                *to = mean_near(along[y * width + x], column, limit);
            }
        });
}

/// The mean of the values that are no farther than `limit` from `own`.
fn mean_near(own: f32, values: impl Iterator<Item = f32>, limit: f32) -> f32 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        // Selected, not branched on.
        let counts = if (value - own).abs() <= limit {
            1.0
        } else {
            0.0
        };
        sum += if counts > 0.0 { value } else { 0.0 };
        count += counts;
    }
    if count > 0.0 { sum / count } else { own }
}

/// The standard deviation of noise: of second differences along rows, whose variance is six times that of their numbers. Four fifths of them are noise alone
/// where edges are few; the coding of films leaves half of them 0, so that a median would find none.
fn noise(nearness: &[f32], width: usize) -> f32 {
    let step = (nearness.len() / PLACES).max(1);
    let inner = |index: &usize| (1..width.saturating_sub(1)).contains(&(index % width));
    let places = (0..nearness.len()).step_by(step).filter(inner);
    let second = |i: usize| (nearness[i - 1] - 2.0 * nearness[i] + nearness[i + 1]).abs();
    let mut sizes: Vec<f32> = places.map(second).filter(|v| v.is_finite()).collect();
    let place = sizes.len() * 4 / 5;
    match sizes.is_empty() {
        true => 0.0,
        // Four fifths of normal numbers are within 1.2816 deviations.
        false => *sizes.select_nth_unstable_by(place, f32::total_cmp).1 / (1.2816 * 6f32.sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(noise: f32) -> Vec<f32> {
        let random = |i: usize| {
            (0..6)
                .map(|k| ((i * 6 + k) as f32 * 0.618_034).fract())
                .sum::<f32>()
                / 3.0
                - 1.0
        };
        (0..160 * 90)
            .map(|i| if i % 160 < 80 { 0.3 } else { 0.6 } + noise * random(i))
            .collect()
    }

    #[test]
    fn noise_goes_and_edges_stay() {
        let mut depth = steps(0.02);
        let before = noise(&depth, 160);
        denoise(&mut depth, 160);
        for (i, &q) in depth.iter().enumerate() {
            let truth = if i % 160 < 80 { 0.3 } else { 0.6 };
            assert!((q - truth).abs() < 0.02, "{i}: {q}");
        }
        assert!(noise(&depth, 160) < 0.4 * before);
    }

    #[test]
    fn exact_depth_stays() {
        let mut depth = steps(0.0);
        depth[7] = f32::NAN;
        let before = depth.clone();
        denoise(&mut depth, 160);
        assert!(
            depth
                .iter()
                .zip(&before)
                .all(|(a, b)| a.to_bits() == b.to_bits())
        );
    }
}
