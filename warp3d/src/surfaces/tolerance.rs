//! By how much disparity may change from sample to sample on one surface: what the depth map itself says.
//!
//! Second differences of disparity are 0 on planes. In exact depth they are next to nothing, in depth that is rounded to
//! codes a step now and then, and in noisy depth a number everywhere.

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
pub(crate) const BEND_STRIDE: usize = 7;

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
pub(crate) fn bends_of_row(disparity: &[f32], first: usize) -> impl Iterator<Item = f32> {
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
pub(crate) fn tolerance_of_bends(mut bends: Vec<f32>) -> f32 {
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
}
