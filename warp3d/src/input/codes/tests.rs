//! Smooth maps in coarse codes come back smooth, and edges stay edges.

use super::*;

const SIZE: [usize; 2] = [160, 120];

/// A slanted plane with a bump, in codes of one step.
fn slanted(slope: [f32; 2], x: usize, y: usize) -> f32 {
    let [dx, dy] = [x as f32 - 90.0, y as f32 - 50.0];
    60.0 + slope[0] * x as f32 + slope[1] * y as f32 + 9.0 * (-(dx * dx + dy * dy) / 500.0).exp()
}

fn plane(stored: Stored, value: impl Fn(usize, usize) -> f32) -> Plane {
    let pixels = (0..SIZE[0] * SIZE[1]).map(|i| value(i % SIZE[0], i / SIZE[0]));
    Plane {
        width: SIZE[0],
        height: SIZE[1],
        values: pixels.collect(),
        stored,
    }
}

fn inverse(value: f32) -> f64 {
    if value > 0.0 {
        1.0 / f64::from(value)
    } else {
        f64::NAN
    }
}

/// Largest second difference along x and y, and the root mean square error, steps.
fn roughness(found: &[f32], truth: impl Fn(usize, usize) -> f32) -> [f32; 2] {
    let at = |x: usize, y: usize| found[y * SIZE[0] + x];
    let (mut bend, mut squares) = (0f32, 0.0);
    for y in 1..SIZE[1] - 1 {
        for x in 1..SIZE[0] - 1 {
            let here = at(x, y);
            bend = bend.max((at(x - 1, y) - 2.0 * here + at(x + 1, y)).abs());
            bend = bend.max((at(x, y - 1) - 2.0 * here + at(x, y + 1)).abs());
            squares += (here - truth(x, y)).powi(2);
        }
    }
    [bend, (squares / found.len() as f32).sqrt()]
}

#[test]
fn a_smooth_map_in_codes_comes_back_smooth() {
    let slopes = [
        [0.03, 0.01],
        [0.1, 0.05],
        [0.4, -0.15],
        [0.6, 0.5],
        [1.3, 0.3],
    ];
    for slope in slopes {
        let truth = |x: usize, y: usize| slanted(slope, x, y);
        let codes = plane(Stored::Code(255), |x, y| truth(x, y).round());
        let [bend, error] = roughness(&codes.values, truth);
        // Rounding has a deviation of 1 / sqrt(12).
        assert!(bend >= 1.0 && (error - 0.29).abs() < 0.01, "{slope:?}");
        let smooth = smoothed(&codes, &inverse).expect("coarse");
        let [bend, error] = roughness(&smooth.values, truth);
        assert!(bend < 0.26 && error < 0.1, "{slope:?}: {bend} {error}");
        let leaves = |(a, b): (&f32, &f32)| (a - b).abs() >= 0.5;
        assert!(
            !codes.values.iter().zip(&smooth.values).any(leaves),
            "intervals"
        );
        // The same numbers in wider codes.
        let wide = plane(Stored::Code(65_535), |x, y| 257.0 * truth(x, y).round());
        let wide = smoothed(&wide, &inverse).expect("coarse").values;
        let agrees = |(a, b): (&f32, &f32)| (a / 257.0 - b).abs() < 1e-3;
        assert!(wide.iter().zip(&smooth.values).all(agrees));
    }
}

#[test]
fn edges_and_unknown_numbers_stay() {
    let step = plane(Stored::Code(255), |x, _| if x < 80 { 40.0 } else { 42.0 });
    assert_eq!(
        smoothed(&step, &inverse).expect("coarse").values,
        step.values
    );
    let holes = plane(Stored::Code(255), |x, y| match (x / 7 + y / 5) % 4 {
        0 => 0.0,
        _ => slanted([0.1, 0.0], x, y).round(),
    });
    let smooth = smoothed(&holes, &inverse).expect("coarse");
    let stays = |(a, b): (&f32, &f32)| (*a == 0.0) == (*b == 0.0);
    assert!(holes.values.iter().zip(&smooth.values).all(stays));
}

#[test]
fn fine_numbers_are_left_alone() {
    let fine = plane(Stored::Code(65_535), |x, y| {
        (100.0 * slanted([0.1, 0.0], x, y)).round()
    });
    assert!(smoothed(&fine, &inverse).is_none(), "16 bits");
    let floats = plane(Stored::Float, |x, y| slanted([0.1, 0.0], x, y));
    assert!(smoothed(&floats, &inverse).is_none(), "32-bit floats");
    let camera_z = plane(Stored::Float, |x, y| {
        (4.0 + (x * y % 1024) as f32 / 256.0).floor()
    });
    assert!(
        smoothed(&camera_z, &f64::from).is_none(),
        "no step of a half float is an edge in z"
    );
}

#[test]
fn half_floats_have_their_place_among_each_other() {
    let cases = [
        (0.0, 0),
        (2f32.powi(-24), 1),
        (2f32.powi(-14), 1024),
        (1.0, 15 << 10),
        (65_504.0, 0x7bff),
    ];
    for (value, level) in cases {
        assert!(
            is_half(value) && Scale::Half.level(value) == level,
            "{value}"
        );
        assert_eq!(Scale::Half.value(level as f32), value);
        assert_eq!(Scale::Half.value(-(level as f32)), -value);
    }
    assert!(!is_half(1.0 + 2f32.powi(-11)) && !is_half(65_536.0) && !is_half(1e-9));
    // Half way between two of them.
    assert_eq!(
        Scale::Half.value((15 << 10) as f32 + 0.5),
        1.0 + 2f32.powi(-11)
    );
}
