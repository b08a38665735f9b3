//! Tests of FLIP: closed forms first, then the authors' own program.

use super::super::patterns::{Pattern, WIDTH, disc_mask};
use super::*;

fn uniform(colour: [f32; 3]) -> Image {
    let mut image = Image::transparent(24, 16);
    image.rgba.fill([colour[0], colour[1], colour[2], 1.0]);
    image
}

#[test]
fn green_against_blue_is_the_largest_error() {
    let map = map(
        &uniform([0.0, 1.0, 0.0]),
        &uniform([0.0, 0.0, 1.0]),
        DEFAULT_PIXELS_PER_DEGREE,
    )
    .expect("valid");
    for error in map.values {
        assert!(
            (error - 1.0).abs() < 1e-9,
            "green against blue gives {error}, not 1"
        );
    }
}

#[test]
fn uniform_greys_have_the_closed_form() {
    // Greys have no chroma: the distance is the difference of CIELAB lightness, here 100 - 0.
    let largest = largest_distance(&ColourSpace::srgb());
    let fraction = 100f64.powf(0.7) / largest;
    let expected = 0.95 + (fraction - 0.4) / 0.6 * 0.05;
    let map = map(
        &uniform([0.0; 3]),
        &uniform([1.0; 3]),
        DEFAULT_PIXELS_PER_DEGREE,
    )
    .expect("valid");
    for error in map.values {
        assert!(
            (error - expected).abs() < 1e-9,
            "black against white gives {error}, expected {expected}"
        );
    }
}

#[test]
fn the_order_of_the_pictures_does_not_matter() {
    let (image, reference) = Pattern::Checker.pair();
    let forward = map(&image, &reference, 40.0).expect("valid");
    assert_eq!(
        forward,
        map(&reference, &image, 40.0).expect("valid"),
        "FLIP must be symmetric"
    );
    assert!(
        forward
            .values
            .iter()
            .all(|error| (0.0..=1.0).contains(error)),
        "errors lie in 0..=1"
    );
}

/// Expected: the authors' reference implementation, package flip-evaluator 1.7, called as `evaluate(reference, test,
/// "LDR", inputsRGB=False, applyMagma=False, parameters={"ppd": ...})` on the patterns as float32 arrays. Columns:
/// mean of all pixels, mean inside the disc, then the pixels (0, 0), (23, 18), (46, 36), (10, 30).
/// The reference computes in f32, which limits the agreement.
#[test]
fn patterns_agree_with_the_reference_implementation() {
    let expected = [
        (
            Pattern::Ramp,
            DEFAULT_PIXELS_PER_DEGREE,
            [
                0.12867265, 0.12019710, 0.15724136, 0.13318453, 0.19491574, 0.13201423,
            ],
        ),
        (
            Pattern::Ramp,
            20.0,
            [
                0.22729973, 0.23196343, 0.14093661, 0.17573188, 0.33032900, 0.32016951,
            ],
        ),
        (
            Pattern::Checker,
            DEFAULT_PIXELS_PER_DEGREE,
            [
                0.21447975, 0.22325688, 0.07434110, 0.00001507, 0.05960783, 0.07150053,
            ],
        ),
        (
            Pattern::Checker,
            20.0,
            [0.30381116, 0.34140603, 0.0, 0.0, 0.0, 0.04981264],
        ),
        (
            Pattern::Noise,
            DEFAULT_PIXELS_PER_DEGREE,
            [
                0.01986719, 0.01981714, 0.05208599, 0.02405126, 0.01495808, 0.02356616,
            ],
        ),
        (
            Pattern::Noise,
            20.0,
            [
                0.01823698, 0.01864072, 0.15526435, 0.00424731, 0.00010586, 0.06450250,
            ],
        ),
    ];
    for (pattern, pixels_per_degree, expected) in expected {
        let (image, reference) = pattern.pair();
        let map = map(&image, &reference, pixels_per_degree).expect("valid pair");
        let at = |x: usize, y: usize| map.values[y * WIDTH + x];
        let mean = FlipSummary::new(map.values.clone()).mean;
        let mean_in_disc = FlipSummary::new(map.selected(Some(&disc_mask()))).mean;
        let found = [
            mean,
            mean_in_disc,
            at(0, 0),
            at(23, 18),
            at(46, 36),
            at(10, 30),
        ];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-4,
                "{pattern:?} at {pixels_per_degree}: {found}, not {expected}"
            );
        }
    }
}

#[test]
fn weighted_quartiles_weigh_each_error_by_itself() {
    // The total is 8: the five small errors hold 1.25 of it, the large ones 6.75.
    let summary = FlipSummary::new(vec![3.0, 0.25, 0.25, 0.25, 3.75, 0.25, 0.25]);
    assert_eq!(
        summary.weighted_quartile_1, 3.0,
        "a quarter (2) is reached in the error 3"
    );
    assert_eq!(
        summary.weighted_median, 3.0,
        "half (4) is reached in the error 3"
    );
    assert_eq!(
        summary.weighted_quartile_3, 3.75,
        "three quarters (6) need the last error"
    );
    assert_eq!(
        (summary.mean, summary.max),
        (8.0 / 7.0, 3.75),
        "mean and maximum"
    );
    assert_eq!(FlipSummary::new(Vec::new()).mean, 0.0, "no pixel, no error");
}

#[test]
fn the_viewing_condition_is_checked() {
    let image = uniform([0.5; 3]);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1001.0] {
        let found = map(&image, &image, bad);
        assert!(
            matches!(found, Err(MetricsError::BadPixelsPerDegree(_))),
            "{bad} pixels per degree was accepted"
        );
    }
    let default = pixels_per_degree(0.7, 0.7, 3840.0);
    assert!(
        (default - DEFAULT_PIXELS_PER_DEGREE).abs() < 1e-12,
        "the default screen has {default}"
    );
    assert!(
        (default - 67.0206).abs() < 1e-4,
        "the default screen has {default} pixels per degree"
    );
}

#[test]
fn the_matrix_is_that_of_srgb() {
    // IEC 61966-2-1 prints the matrix to four decimals.
    let expected = DMat3::from_cols_array(&[
        0.4124, 0.2126, 0.0193, 0.3576, 0.7152, 0.1192, 0.1805, 0.0722, 0.9505,
    ]);
    let found = ColourSpace::srgb().xyz_from_rgb;
    assert!(found.abs_diff_eq(expected, 1e-4), "sRGB to XYZ is {found}");
}

#[test]
fn white_black_and_round_trip() {
    let space = ColourSpace::srgb();
    let white = DVec3::new(100.0, 0.0, 0.0);
    assert!(
        space
            .opponent_from_rgb(DVec3::ONE)
            .abs_diff_eq(white, 1e-10),
        "YCxCz of white"
    );
    assert!(
        space
            .hunt_lab_from_rgb(DVec3::ONE)
            .abs_diff_eq(white, 1e-10),
        "CIELAB of white"
    );
    assert!(
        space
            .hunt_lab_from_rgb(DVec3::ZERO)
            .abs_diff_eq(DVec3::ZERO, 1e-10),
        "CIELAB of black"
    );
    let colour = DVec3::new(0.1, 0.7, 0.4);
    let back = space.rgb_from_opponent(space.opponent_from_rgb(colour));
    assert!(
        back.abs_diff_eq(colour, 1e-12),
        "{colour} came back as {back}"
    );
}

#[test]
fn balanced_taps_sum_to_one_on_each_side() {
    let kernels = Kernels::new(DEFAULT_PIXELS_PER_DEGREE);
    for taps in [&kernels.first, &kernels.second] {
        let positive: f64 = taps.iter().filter(|&&tap| tap > 0.0).sum();
        let total: f64 = taps.iter().sum();
        assert!(
            (positive - 1.0).abs() < 1e-12 && total.abs() < 1e-12,
            "sums {positive} and {total}"
        );
    }
}

#[test]
fn a_full_step_against_nothing_has_the_closed_form() {
    // Between the two columns at the step the derivative sees nearly all of the step: the taps on one side sum
    // to 1. The pixel right of the step misses none of the positive taps, as the centre tap is 0.
    let step = ScalarMap {
        width: 64,
        height: 8,
        values: (0..512)
            .map(|at| if at % 64 < 32 { -16.0 } else { 100.0 })
            .collect(),
    };
    let flat = ScalarMap {
        values: vec![-16.0; 512],
        ..step
    };
    let found = difference(&step, &flat, DEFAULT_PIXELS_PER_DEGREE).values[4 * 64 + 32];
    let expected = std::f64::consts::FRAC_1_SQRT_2.sqrt();
    assert!(
        (found - expected).abs() < 1e-12,
        "feature difference {found}, expected {expected}"
    );
}
