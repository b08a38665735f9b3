//! Noise within one picture's depth: averaged along surfaces before it is averaged over time.
//!
//! Takes inverse depth, gives it with each pixel the mean of its neighbours that differ by no more than noise does (the sigma filter, J.-S. Lee 1983, along rows
//! and then along columns). The noise is measured: surfaces bend little from pixel to pixel, so that most second differences are
//! noise. Depth without noise stays to the bit.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::simd::SimdLevel;

/// Neighbours to each side: a mean of 25, so that noise is a fifth of itself.
const REACH: usize = 2;

/// Deviations by which two pixels of one surface differ at most.
const SAME: f32 = 2.5;

/// Limits of noise by which a pixel may differ from the median around it: four deviations.
const MOST: f32 = 1.6;

/// The part of noise that a mean of 25 leaves.
const LEFT: f32 = 0.2;

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
    let cleared = medians(nearness, width, limit);
    nearness.copy_from_slice(&cleared);
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
    let cleared = medians(nearness, width, LEFT * limit);
    nearness.copy_from_slice(&cleared);
}

/// The medians of each pixel and the eight around it, where the pixel differs from it by what noise does, or from all the eight by more: a sigma filter leaves such a
/// pixel as it is, and it would tear the surface that it lies on. All other pixels stay.
fn medians(nearness: &[f32], width: usize, limit: f32) -> Vec<f32> {
    let last = nearness.len() / width - 1;
    let vectors = SimdLevel::Auto.resolve();
    let mut medians = nearness.to_vec();
    let rows = medians.par_chunks_mut(width).enumerate();
    rows.for_each(|(y, to)| {
        let row = |y: usize| &nearness[y * width..(y + 1) * width];
        let rows = [row(y.saturating_sub(1)), row(y), row((y + 1).min(last))];
        dispatch!(vectors, simd => clear_row(simd, to, rows, limit));
    });
    medians
}

#[simd]
fn clear_row<S: Simd>(_simd: S, to: &mut [f32], rows: [&[f32]; 3], limit: f32) {
    let inner = 1..to.len() - 1;
    let (lanes, rest) = to[inner].as_chunks_mut::<LANES>();
    let first = 1 + lanes.len() * LANES;
    for (part, to) in lanes.iter_mut().enumerate() {
        *to = cleared(rows, 1 + part * LANES, limit);
    }
    for (part, to) in rest.iter_mut().enumerate() {
        [*to] = cleared(rows, first + part, limit);
    }
}

/// The pixels of the middle row from `x` on, cleared. Loops over lanes without a branch become vectors of any machine.
#[inline(always)]
fn cleared<const N: usize>(rows: [&[f32]; 3], x: usize, limit: f32) -> [f32; N] {
    let mut around = [[0.0; N]; 9];
    for (three, row) in around.chunks_exact_mut(3).zip(rows) {
        for (lanes, at) in three.iter_mut().zip(x - 1..) {
            lanes.copy_from_slice(&row[at..at + N]);
        }
    }
    let own = around[4];
    let mut alike = [0.0; N];
    for lanes in &around {
        for ((value, own), alike) in lanes.iter().zip(&own).zip(&mut alike) {
            let is_like = (value - own).abs() <= limit;
            *alike += if is_like { 1.0 } else { 0.0 };
        }
    }
    for (a, b) in ORDER {
        let (mut low, mut high) = (around[a], around[b]);
        for (low, high) in low.iter_mut().zip(&mut high) {
            let (one, other) = (*low, *high);
            *low = if one < other { one } else { other };
            *high = if one < other { other } else { one };
        }
        (around[a], around[b]) = (low, high);
    }
    let mut cleared = own;
    for ((own, median), alike) in cleared.iter_mut().zip(around[4]).zip(alike) {
        // NaN is like nothing, not even itself, and stays.
        let is_noise = (*own - median).abs() <= MOST * limit;
        let is_alone = (alike == 1.0) & median.is_finite();
        *own = if is_noise | is_alone { median } else { *own };
    }
    cleared
}

/// Pixels that are cleared at once.
const LANES: usize = 16;

/// Exchanges after which the middle of nine values is their median (Paeth, "Median finding on a 3x3 grid", 1990).
const ORDER: [(usize, usize); 19] = [
    (1, 2),
    (4, 5),
    (7, 8),
    (0, 1),
    (3, 4),
    (6, 7),
    (1, 2),
    (4, 5),
    (7, 8),
    (0, 3),
    (5, 8),
    (4, 7),
    (3, 6),
    (1, 4),
    (2, 5),
    (4, 7),
    (4, 2),
    (6, 4),
    (4, 2),
];

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
    fn the_median_is_that_of_sorted_values() {
        let random = |i: usize| ((i * i + 7 * i) as f32 * 0.618_034).fract();
        for first in 0..500 {
            let nine: Vec<f32> = (0..9).map(|i| random(9 * first + i)).collect();
            let rows = [&nine[..3], &nine[3..6], &nine[6..]];
            let [found] = cleared::<1>(rows, 1, 10.0);
            let mut sorted = nine.clone();
            sorted.sort_by(f32::total_cmp);
            assert_eq!(found, sorted[4], "{nine:?}");
        }
    }

    #[test]
    fn a_pixel_unlike_all_around_it_is_noise_and_a_thin_line_is_not() {
        let mut depth = steps(0.02);
        let clean = |x: usize| if x < 80 { 0.3 } else { 0.6 };
        // A pixel far off, and a line of one pixel's width.
        depth[40 * 160 + 30] = 0.5;
        for y in 0..90 {
            depth[y * 160 + 120] = 0.9;
        }
        denoise(&mut depth, 160);
        assert!((depth[40 * 160 + 30] - clean(30)).abs() < 0.02);
        for y in 1..89 {
            let found = depth[y * 160 + 120];
            assert!((found - 0.9).abs() < 0.02, "row {y}: {found}");
        }
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
