//! Soft edges: blurred walls become the walls again, exact ones stay, unknown samples end a ramp.

use super::*;

const PERSPECTIVE: Projection = Projection::Perspective;

/// Two slanted walls with the edge between samples 20 and 21, in disparity.
fn walls(x: f64) -> f64 {
    if x < 20.5 {
        0.5 + 0.001 * x
    } else {
        0.2 - 0.0005 * x
    }
}

/// Rows of camera z, blurred in disparity or in depth by a Gaussian of this sigma.
fn blurred(sigma: f64, is_depth: bool) -> Vec<f32> {
    let number = |x: f64| if is_depth { 1.0 / walls(x) } else { walls(x) };
    let row: Vec<f32> = (0..41)
        .map(|x| {
            let taps = (-200..=200).map(|i| f64::from(i) * 0.05 * sigma);
            let (mut sum, mut total) = (0.0, 0.0);
            for offset in taps {
                let weight = (-0.5 * (offset / sigma).powi(2)).exp();
                sum += weight * number(f64::from(x) + offset);
                total += weight;
            }
            let mean = sum / total;
            (if is_depth { mean } else { 1.0 / mean }) as f32
        })
        .collect();
    row.repeat(9)
}

#[test]
fn the_edges_of_exact_depth_are_sharp_and_stay_as_they_are() {
    let step: Vec<f32> = (0..41)
        .map(|x| (1.0 / walls(f64::from(x))) as f32)
        .collect();
    assert_eq!(Edges::of(PERSPECTIVE, &step, 41), Edges::Sharp, "a step");
    // A ball of 15 samples' radius before a wall, and a plane at a grazing angle.
    let ball = |x: i32| 4.0 - (1.0 - (f64::from(x - 20) / 15.0).powi(2)).max(0.0).sqrt();
    let ball: Vec<f32> = (0..41)
        .map(|x| {
            if (6..35).contains(&x) {
                ball(x) as f32
            } else {
                6.0
            }
        })
        .collect();
    assert_eq!(Edges::of(PERSPECTIVE, &ball, 41), Edges::Sharp, "a ball");
    let alone = |&z: &f32| if z < 6.0 { z } else { f32::NAN };
    let alone: Vec<f32> = ball.iter().map(alone).collect();
    assert_eq!(
        Edges::of(PERSPECTIVE, &alone, 41),
        Edges::Sharp,
        "a ball before nothing"
    );
    let plane: Vec<f32> = (0..41).map(|x| 1.0 / (0.5 - 0.01 * x as f32)).collect();
    assert_eq!(Edges::of(PERSPECTIVE, &plane, 41), Edges::Sharp, "a plane");
}

#[test]
fn a_ramp_becomes_the_two_walls_that_were_blurred() {
    for sigma in [0.6, 1.2, 2.0, 3.0] {
        for (is_depth, expected) in [(false, Edges::SoftInDisparity), (true, Edges::SoftInDepth)] {
            let depth = blurred(sigma, is_depth);
            let edges = Edges::of(PERSPECTIVE, &depth, 41);
            assert_eq!(edges, expected, "sigma {sigma}");
            let sharp = sharpened(PERSPECTIVE, (&depth, &grey(&depth)), 41, edges);
            for (at, z) in sharp.iter().enumerate() {
                let wall = walls((at % 41) as f64);
                let error = (1.0 / f64::from(*z) - wall).abs() / wall;
                // What is left of the tails, of a jump of 2.7 to 1.
                assert!(error < 0.05, "sigma {sigma}, sample {}: {error}", at % 41);
            }
        }
    }
}

#[test]
fn unknown_samples_end_a_ramp() {
    let mut depth = blurred(1.2, false);
    depth
        .iter_mut()
        .skip(20)
        .step_by(41)
        .for_each(|z| *z = f32::NAN);
    let sharp = sharpened(
        PERSPECTIVE,
        (&depth, &grey(&depth)),
        41,
        Edges::SoftInDisparity,
    );
    for (before, after) in depth.iter().zip(&sharp) {
        assert_eq!(before.is_nan(), after.is_nan());
    }
}

/// A picture without an edge.
fn grey(depth: &[f32]) -> Vec<[f32; 3]> {
    vec![[0.5; 3]; depth.len()]
}
