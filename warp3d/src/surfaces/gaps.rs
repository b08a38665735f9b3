//! Samples without a depth inside a surface: continued from their neighbours on either side.
//!
//! A sensor leaves out single samples in the middle of a wall. Where the samples before and after one, along a row or a
//! column, lie on one surface, its disparity is between theirs, and its colour is known. Every cell around it is then
//! joined as elsewhere: no hole opens, and the frame costs what it costs without gaps.
//!
//! Limits: gaps of two samples and more along both axes stay unknown, and so does every gap between two surfaces.

use rayon::prelude::*;

/// Rounds: a later one continues from what an earlier one has found, so that samples in a corner between others are met.
pub(crate) const ROUNDS: usize = 2;

/// Gives the samples between others of their surface a disparity. `tolerance` is by how much disparity may change from
/// sample to sample on one surface, relative to it.
pub(crate) fn bridge(disparity: &mut [f32], size: [usize; 2], tolerance: f32) {
    for _ in 0..ROUNDS {
        let found: Vec<(usize, f32)> = (0..disparity.len())
            .into_par_iter()
            .filter(|&index| disparity[index].is_nan())
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
