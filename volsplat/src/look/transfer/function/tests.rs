//! The function itself: interpolation, steps, ends, and the questions that culling asks.

use crate::look::transfer::*;

fn function(opacities: &[(f64, f64)]) -> TransferFunction {
    let opacities = opacities
        .iter()
        .map(|&(value, opacity)| OpacityKnot { value, opacity })
        .collect();
    TransferFunction::new(
        vec![ColourKnot {
            value: 0.0,
            rgb: [1.0; 3],
        }],
        opacities,
    )
    .expect("valid")
}

#[test]
fn linear_between_knots_and_constant_beyond() {
    let colours = vec![
        ColourKnot {
            value: 1.0,
            rgb: [0.0, 0.5, 1.0],
        },
        ColourKnot {
            value: 3.0,
            rgb: [1.0, 0.5, 0.0],
        },
    ];
    let opacities = vec![
        OpacityKnot {
            value: 0.0,
            opacity: 0.5,
        },
        OpacityKnot {
            value: 4.0,
            opacity: 1.0,
        },
    ];
    let function = TransferFunction::new(colours, opacities).expect("valid");
    assert_eq!(function.sample(2.0), ([0.5, 0.5, 0.5], 0.75));
    assert_eq!(function.sample(-9.0), ([0.0, 0.5, 1.0], 0.5));
    assert_eq!(function.sample(9.0), ([1.0, 0.5, 0.0], 1.0));
    assert_eq!(function.value_range(), (0.0, 4.0));
}

#[test]
fn the_upper_side_of_a_step_holds_from_its_value_on() {
    let function = function(&[
        (0.0, 0.0),
        (71.0, 0.0),
        (71.0, 0.3),
        (71.0, 1.0),
        (80.0, 0.5),
    ]);
    assert_eq!(
        (
            function.opacity(71.0f64.next_down()),
            function.opacity(71.0)
        ),
        (0.0, 1.0)
    );
}

#[test]
fn the_visible_range_is_the_least_interval() {
    assert_eq!(
        function(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.5), (3.0, 0.0), (9.0, 0.0)]).visible_range(),
        Some((1.0, 3.0))
    );
    assert_eq!(
        function(&[(0.0, 0.0), (1.0, 0.1)]).visible_range(),
        Some((0.0, f64::INFINITY))
    );
    assert_eq!(
        function(&[(0.0, 0.1)]).visible_range(),
        Some((f64::NEG_INFINITY, f64::INFINITY))
    );
    assert_eq!(function(&[(0.0, 0.0), (1.0, 0.0)]).visible_range(), None);
    assert_eq!(
        function(&[(71.0, 0.0), (71.0, 1.0)]).visible_range(),
        Some((71.0, f64::INFINITY))
    );
}

#[test]
fn rescaling_moves_knots_to_the_range() {
    let function = function(&[(-1.0, 0.0), (0.0, 0.25), (1.0, 1.0)]).rescaled(100.0, 300.0);
    assert_eq!(function.value_range(), (100.0, 300.0));
    assert_eq!(function.opacity(200.0), 0.25);
    assert_eq!(
        function.clone().rescaled(5.0, 5.0),
        function,
        "an empty range changes nothing"
    );
}

#[test]
fn extreme_scalars_stay_finite() {
    let function = function(&[(-1.7e308, 0.0), (1.7e308, 1.0)]);
    assert_eq!(function.opacity(0.0), 0.5);
    assert_eq!(
        (
            function.opacity(f64::INFINITY),
            function.opacity(f64::NEG_INFINITY)
        ),
        (1.0, 0.0)
    );
    assert!(function.opacity(f64::NAN).is_finite());
}

#[test]
fn faulty_knots_are_named() {
    let colour = |value, red| ColourKnot {
        value,
        rgb: [red, 0.0, 0.0],
    };
    let opacity = |value, opacity| OpacityKnot { value, opacity };
    let cases = [
        (vec![], vec![opacity(0.0, 0.0)], "at least one colour knot"),
        (vec![colour(0.0, 0.0)], vec![], "at least one opacity knot"),
        (
            vec![colour(2.0, 0.0), colour(1.0, 0.0)],
            vec![opacity(0.0, 0.0)],
            "colour knot 1 is at 1",
        ),
        (
            vec![colour(f64::NAN, 0.0)],
            vec![opacity(0.0, 0.0)],
            "colour knot 0 is at NaN",
        ),
        (
            vec![colour(0.0, -0.5)],
            vec![opacity(0.0, 0.0)],
            "colour knot 0 is [-0.5",
        ),
        (
            vec![colour(0.0, f32::INFINITY)],
            vec![opacity(0.0, 0.0)],
            "colour knot 0 is [inf",
        ),
        (
            vec![colour(0.0, 0.0)],
            vec![opacity(0.0, 1.5)],
            "opacity knot 0 is 1.5",
        ),
        (
            vec![colour(0.0, 0.0)],
            vec![opacity(0.0, f64::NAN)],
            "opacity knot 0 is NaN",
        ),
    ];
    for (colours, opacities, expected) in cases {
        let text = TransferFunction::new(colours, opacities)
            .expect_err("faulty")
            .to_string();
        assert!(text.contains(expected), "{text}");
    }
}
