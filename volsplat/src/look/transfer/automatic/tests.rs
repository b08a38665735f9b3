//! The automatic function on made volumes; the real ones are judged in the tests package.

use glam::DAffine3;
use resample_volume::volume::{Volume, Voxels};

use crate::look::transfer::automatic::*;

fn automatic(voxels: Voxels) -> TransferFunction {
    let volume = Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid");
    TransferFunction::automatic(&Histogram::of_volume(&volume), ColourMap::default())
}

/// A background of mean 100 and deviation about 10, and an object one tenth as large around 1000.
fn two_bells(scale: f64, shift: f64) -> Vec<f64> {
    let bell = |mean: f64, count: usize| {
        (0..count).map(move |n| {
            let phases =
                [0.618_034, 0.754_878, 0.569_840].map(|step: f64| (n as f64 * step).fract());
            mean + 20.0 * (phases.iter().sum::<f64>() - 1.5)
        })
    };
    bell(100.0, 10_000)
        .chain(bell(1000.0, 1000))
        .map(|value| value * scale + shift)
        .collect()
}

#[test]
fn background_vanishes_and_object_stays_at_any_scale() {
    for (scale, shift) in [
        (1.0, 0.0),
        (1e-30, 0.0),
        (1e300, 0.0),
        (1.0, -5000.0),
        (0.01, 1e6),
    ] {
        let function = automatic(Voxels::F64(two_bells(scale, shift)));
        let at = |value: f64| function.opacity(value * scale + shift);
        assert_eq!(
            at(100.0),
            0.0,
            "scale {scale}, shift {shift}: the background is seen"
        );
        assert_eq!(
            at(130.0),
            0.0,
            "scale {scale}, shift {shift}: the end of the background is seen"
        );
        assert!(
            at(970.0) > 0.4,
            "scale {scale}, shift {shift}: the object is lost: {}",
            at(970.0)
        );
    }
}

#[test]
fn integers_are_treated_alike() {
    let values = two_bells(1.0, -600.0)
        .iter()
        .map(|v| v.round() as i16)
        .collect();
    let function = automatic(Voxels::I16(values));
    assert_eq!(function.opacity(-500.0), 0.0);
    assert!(function.opacity(400.0) > 0.4);
}

#[test]
fn a_constant_volume_is_visible() {
    for value in [0.0, -7.0, 1e300] {
        let function = automatic(Voxels::F64(vec![value; 8]));
        assert_eq!(function.opacity(value), OBJECT_OPACITY);
        assert!(
            function
                .colour(value)
                .iter()
                .all(|channel| channel.is_finite())
        );
    }
}

#[test]
fn of_two_values_the_greater_is_the_object() {
    for (low, high) in [(0u8, 255u8), (3, 4), (0, 1)] {
        let function = automatic(Voxels::U8([vec![low; 99], vec![high]].concat()));
        assert_eq!(
            (function.opacity(low.into()), function.opacity(high.into())),
            (0.0, OBJECT_OPACITY)
        );
    }
}

#[test]
fn the_split_of_two_values_lies_half_way() {
    assert_eq!(
        best_split(&[5, 0, 0, 0, 5]),
        Some(2),
        "bins 1 to 4 are equal, their middle is 2"
    );
    assert_eq!(best_split(&[5, 5]), Some(1));
    assert_eq!(best_split(&[9]), None);
    assert_eq!(best_split(&[0, 9, 0]), None);
}
