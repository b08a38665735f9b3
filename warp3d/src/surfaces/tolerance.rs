//! By how much disparity may change from sample to sample on one surface: what the depth map itself says.
//!
//! Second differences of disparity are 0 on planes. In exact depth they are next to nothing, in depth that is rounded to
//! codes a step now and then, and in noisy depth a number everywhere.

use rayon::prelude::*;

/// Tolerance of exact depth, relative to disparity: a sphere of 50 samples' radius bends less from sample to sample
/// except in its outermost ones. Measured on ray-traced scenes: 0.2 to 0.8 % give the same pictures within 0.2 dB.
const EXACT_TOLERANCE: f32 = 0.004;

/// Largest tolerance of depth in steps, relative to disparity: what look like larger steps are edges.
const LARGEST_STEPS: f32 = 0.025;

/// Largest tolerance of noisy depth, relative to disparity. Measured on stereo with 0.5, 1 and 2 % of noise.
const LARGEST_NOISE: f32 = 0.08;

/// Depth of which more than this share of the second differences is not 0 is noise: depth in steps is flat in between.
const LEAST_MOVED: f32 = 0.95;

/// Second differences up to this are rounding of f32, relative to disparity.
const ROUNDING: f32 = 1e-6;

/// Samples from one triple of the depth map to the next that its steps are taken from.
const BEND_STRIDE: usize = 7;

/// The tolerance that the steps of the depth map call for.
pub(crate) fn tolerance_of(disparity: &[f32], size: [usize; 2]) -> f32 {
    let rows = disparity.chunks_exact(size[0]).enumerate();
    tolerance_of_bends(
        rows.flat_map(|(y, row)| bends_of_row(row, y * size[0]))
            .collect(),
    )
}

/// Second differences of disparity, relative, in a row whose first sample has the number `first`: every 7th triple of
/// the picture, which is enough for a median, and out of step with any pattern of the width.
fn bends_of_row(disparity: &[f32], first: usize) -> impl Iterator<Item = f32> {
    // The middle samples are numbers 1, 8, 15 and so on.
    let start = (1 + BEND_STRIDE - first % BEND_STRIDE) % BEND_STRIDE;
    let start = if start == 0 { BEND_STRIDE } else { start };
    (start..disparity.len().saturating_sub(1))
        .step_by(BEND_STRIDE)
        .filter_map(|x| {
            let bend =
                (disparity[x - 1] - 2.0 * disparity[x] + disparity[x + 1]).abs() / disparity[x];
            // Above 10 % is an edge.
            (bend < 0.1).then_some(bend)
        })
}

/// The tolerance from the second differences of a picture.
///
/// Rounding to steps of q moves a second difference by at most 2 q, and where it moves it at all, most often by q. So
/// the median of the relative second differences that are not 0 estimates q, and exact depth gives next to nothing.
///
/// Noise moves every second difference. The median of normal noise is 0.67 * sqrt(6) of its deviation, a step from sample
/// to sample has sqrt(2) of it: 2.5 medians are three deviations of a step.
fn tolerance_of_bends(mut bends: Vec<f32>) -> f32 {
    let all = bends.len();
    bends.retain(|&bend| bend > ROUNDING);
    if bends.is_empty() {
        return EXACT_TOLERANCE;
    }
    let is_noise = bends.len() as f32 > LEAST_MOVED * all as f32;
    let middle = bends.len() / 2;
    let (_, median, _) = bends.select_nth_unstable_by(middle, f32::total_cmp);
    if is_noise {
        (2.5 * *median).clamp(EXACT_TOLERANCE, LARGEST_NOISE)
    } else {
        (2.0 * *median).clamp(EXACT_TOLERANCE, LARGEST_STEPS)
    }
}

// Samples without a depth inside a surface: continued from their neighbours on either side.
//
// A sensor leaves out single samples in the middle of a wall. Where the samples before and after one, along a row or a
// column, lie on one surface, its disparity is between theirs, and its colour is known. Every cell around it is then
// joined as elsewhere: no hole opens, and the frame costs what it costs without gaps.
//
// Limits: gaps of two samples and more along both axes stay unknown, and so does every gap between two surfaces.

/// Rounds: a later one continues from what an earlier one has found, so that samples in a corner between others are met.
pub(crate) const ROUNDS: usize = 2;

/// Gives the samples between others of their surface a disparity. `tolerance` is by how much disparity may change from
/// sample to sample on one surface, relative to it.
pub(crate) fn bridge(disparity: &mut [f32], size: [usize; 2], tolerance: f32) {
    for _ in 0..ROUNDS {
        // Nothing is known beside most samples of an empty region.
        let is_beside_known = |index: usize| {
            let near = |step: usize| [index.wrapping_sub(step), index + step];
            let mut beside = [1, size[0]].into_iter().flat_map(near);
            beside.any(|at| disparity.get(at).is_some_and(|d| !d.is_nan()))
        };
        let found: Vec<(usize, f32)> = (0..disparity.len())
            .into_par_iter()
            .filter(|&index| disparity[index].is_nan() && is_beside_known(index))
            .filter_map(|index| Some((index, between(disparity, size, tolerance, index)?)))
            .collect();
        if found.is_empty() {
            return;
        }
        for (index, value) in found {
            disparity[index] = value;
        }
    }
}

/// The mean of what lies half way between the neighbours along x and along y, as far as those are of one surface.
fn between(disparity: &[f32], size: [usize; 2], tolerance: f32, index: usize) -> Option<f32> {
    let place = [index % size[0], index / size[0]];
    let (mut sum, mut count) = (0.0, 0.0);
    for (axis, step) in [1, size[0]].into_iter().enumerate() {
        if place[axis] == 0 || place[axis] + 1 == size[axis] {
            continue;
        }
        let (before, after) = (disparity[index - step], disparity[index + step]);
        let allowed = tolerance * before.min(after);
        let change = 0.5 * (after - before);
        // On a slope the steps on either side are as large. A comparison with NaN is false.
        let goes_on = |beyond: Option<usize>, near: f32, sign: f32| {
            let beyond = beyond.map_or(f32::NAN, |beyond| disparity[beyond]);
            (change - sign * (near - beyond)).abs() <= allowed
        };
        let two_before = (place[axis] > 1).then(|| index - 2 * step);
        let two_behind = (place[axis] + 2 < size[axis]).then(|| index + 2 * step);
        if change.abs() <= allowed
            || goes_on(two_before, before, 1.0)
            || goes_on(two_behind, after, -1.0)
        {
            sum += 0.5 * (before + after);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_seventh_triple_inside_a_row_is_looked_at_whatever_the_width() {
        for width in [1, 2, 3, 5, 7, 8, 20, 23] {
            let number = |i: usize| 1.0 + 1e-3 * ((i * i * 31) % 17) as f32;
            let disparity: Vec<f32> = (0..width * 9).map(number).collect();
            let inside = |i: &usize| !i.is_multiple_of(width) && !(i + 1).is_multiple_of(width);
            let expected: Vec<f32> = (1..disparity.len() - 1)
                .step_by(7)
                .filter(inside)
                .map(|i| {
                    (disparity[i - 1] - 2.0 * disparity[i] + disparity[i + 1]).abs() / disparity[i]
                })
                .filter(|bend| *bend < 0.1)
                .collect();
            let rows = disparity.chunks_exact(width).enumerate();
            let found: Vec<f32> = rows
                .flat_map(|(y, row)| bends_of_row(row, y * width))
                .collect();
            assert_eq!(found, expected, "width {width}");
        }
    }

    #[test]
    fn the_tolerance_holds_three_deviations_of_a_noisy_step_and_two_steps_of_a_code() {
        let mut state = 7u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let size = [400, 400];
        for noise in [0.001, 0.005, 0.01] {
            let mut normal = || (0..12).map(|_| uniform()).sum::<f32>() - 6.0;
            let noisy: Vec<f32> = (0..size[0] * size[1])
                .map(|_| 1.0 + noise * normal())
                .collect();
            let expected = (3.0 * 2f32.sqrt() * noise).max(EXACT_TOLERANCE);
            let found = tolerance_of(&noisy, size);
            assert!((found / expected - 1.0).abs() < 0.05, "{noise}: {found}");
        }
        // A slope in steps of a hundredth.
        let steps: Vec<f32> = (0..size[0] * size[1])
            .map(|i| 1.0 + 0.01 * (0.1 * (i % size[0]) as f32).round() / 4.0)
            .collect();
        let found = tolerance_of(&steps, size);
        assert!((found / 0.005 - 1.0).abs() < 0.1, "steps: {found}");
    }

    const WIDTH: usize = 9;

    fn plane(x: usize, y: usize) -> f32 {
        1.0 + 0.001 * x as f32 + 0.03 * y as f32
    }

    fn bridged(known: impl Fn(usize, usize) -> Option<f32>) -> Vec<f32> {
        let mut disparity: Vec<f32> = (0..WIDTH * WIDTH)
            .map(|i| known(i % WIDTH, i / WIDTH).unwrap_or(f32::NAN))
            .collect();
        bridge(&mut disparity, [WIDTH; 2], 0.004);
        disparity
    }

    #[test]
    fn gaps_in_a_plane_are_on_the_plane() {
        let missing = |x: usize, y: usize| (x, y) == (4, 4) || y == 2 || (x, y) == (4, 3);
        let found = bridged(|x, y| (!missing(x, y)).then(|| plane(x, y)));
        for (i, &value) in found.iter().enumerate() {
            let expected = plane(i % WIDTH, i / WIDTH);
            assert!(
                (value - expected).abs() < 1e-6,
                "sample {i}: {value} against {expected}"
            );
        }
    }

    #[test]
    fn what_lies_between_two_surfaces_or_is_wider_than_a_sample_stays_unknown() {
        let step = bridged(|x, y| (x != 4).then(|| if x < 4 { 2.0 } else { plane(x, y) }));
        assert!(
            (0..WIDTH).all(|y| step[y * WIDTH + 4].is_nan()),
            "between surfaces"
        );
        let block = |v: usize| v == 4 || v == 5;
        let wide = bridged(|x, y| (!(block(x) && block(y))).then(|| plane(x, y)));
        assert!(wide[4 * WIDTH + 4].is_nan(), "two by two samples");
    }
}
