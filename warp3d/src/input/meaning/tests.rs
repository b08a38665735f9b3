//! Each kind of depth against its formula, worked out by hand.

use glam::{DMat3, DVec3};
use resample_core::camera::PixelCentre;
use resample_core::{Intrinsics, LookAt};

use super::*;

/// A camera with focal length 2 px on a picture of 3 x 1 px; the centre of pixel 1 is on the axis.
fn camera() -> Camera {
    let pixel_centre = PixelCentre::Half;
    let k = Intrinsics {
        width: 3,
        height: 1,
        fx: 2.0,
        fy: 2.0,
        cx: 1.5,
        cy: 0.5,
        pixel_centre,
    };
    Camera::from_intrinsics(&k, DMat3::IDENTITY, DVec3::ZERO, 0.1).expect("a good camera")
}

fn plane(values: [f32; 3], stored: Stored) -> Plane {
    Plane {
        width: 3,
        height: 1,
        values: values.to_vec(),
        stored,
    }
}

fn z(meaning: &DepthMeaning, values: [f32; 3], stored: Stored) -> Vec<f32> {
    meaning
        .camera_z(&plane(values, stored), &camera())
        .expect("complete")
}

#[track_caller]
fn assert_near(found: &[f32], expected: &[f32]) {
    for (found, expected) in found.iter().zip(expected) {
        let near = (found - expected).abs() <= 1e-6 * expected.abs();
        assert!(
            near || (found.is_nan() && expected.is_nan()),
            "{found} instead of {expected}"
        );
    }
}

const UNKNOWN: f32 = f32::NAN;

#[test]
fn distances_along_rays_shrink_off_the_axis() {
    let meaning = DepthMeaning::of(DepthKind::Ray);
    // The ray through pixel 0 is (-1/2, 0, 1).
    let off_axis = 3.0 / 1.25f32.sqrt();
    assert_near(
        &z(&meaning, [3.0, 3.0, f32::INFINITY], Stored::Float),
        &[off_axis, 3.0, UNKNOWN],
    );
}

#[test]
fn disparity_takes_the_shift_of_the_principal_points() {
    let meaning = DepthMeaning {
        baseline: Some(10.0),
        doffs: 1.0,
        ..DepthMeaning::of(DepthKind::Disparity)
    };
    assert_near(
        &z(&meaning, [4.0, 0.0, f32::INFINITY], Stored::Float),
        &[4.0, 20.0, UNKNOWN],
    );
    // In whole numbers 0 is "unknown", and a quarter of the code is the disparity.
    let quarter = DepthMeaning {
        scale: Some(0.25),
        ..meaning
    };
    assert_near(
        &z(&quarter, [16.0, 0.0, 4.0], Stored::Code(255)),
        &[4.0, UNKNOWN, 10.0],
    );
    let behind = DepthMeaning {
        doffs: -5.0,
        ..meaning
    };
    assert_near(
        &z(&behind, [4.0, 5.0, 9.0], Stored::Float),
        &[UNKNOWN, UNKNOWN, 5.0],
    );
}

#[test]
fn codes_reach_their_planes_at_both_ends() {
    let mpeg = DepthMeaning {
        near_far: Some([2.0, 50.0]),
        ..DepthMeaning::of(DepthKind::Mpeg)
    };
    assert_near(
        &z(&mpeg, [255.0, 0.0, 127.5], Stored::Code(255)),
        &[2.0, 50.0, 2.0 * 2.0 * 50.0 / 52.0],
    );
    let wide = DepthMeaning {
        scale: Some(1.0 / 1023.0),
        ..mpeg
    };
    assert_near(
        &z(&wide, [1023.0, 0.0, 1023.0], Stored::Code(65_535)),
        &[2.0, 50.0, 2.0],
    );
    let gl = DepthMeaning {
        near_far: Some([0.5, 20.0]),
        ..DepthMeaning::of(DepthKind::OpenGl)
    };
    let middle = 0.5 * 20.0 / (20.0 - 0.5 * 19.5);
    assert_near(
        &z(&gl, [0.0, 1.0, 0.5], Stored::Float),
        &[0.5, UNKNOWN, middle],
    );
}

#[test]
fn a_parallel_depth_buffer_is_linear() {
    let pose = LookAt {
        position: DVec3::ZERO,
        target: DVec3::Z,
        up: DVec3::Y,
    };
    let camera = Camera::orthographic(&pose, 1.0, [3, 1]).expect("a good camera");
    let gl = DepthMeaning {
        near_far: Some([1.0, 5.0]),
        ..DepthMeaning::of(DepthKind::OpenGl)
    };
    let z = gl
        .camera_z(&plane([0.0, 0.25, 0.75], Stored::Float), &camera)
        .expect("complete");
    assert_near(&z, &[1.0, 2.0, 4.0]);
}

#[test]
fn what_cannot_be_a_distance_is_unknown() {
    let plain = DepthMeaning::of(DepthKind::Z);
    assert_near(
        &z(&plain, [0.0, -1.0, f32::NAN], Stored::Float),
        &[UNKNOWN; 3],
    );
    assert_near(
        &z(&plain, [f32::INFINITY, 1e-30, 3e38], Stored::Float),
        &[UNKNOWN, 1e-30, 3e38],
    );
    let inverse = DepthMeaning::of(DepthKind::Inverse);
    assert_near(
        &z(&inverse, [0.0, 0.25, -2.0], Stored::Float),
        &[UNKNOWN, 4.0, UNKNOWN],
    );
    let told = DepthMeaning {
        invalid: Some(0.1),
        ..plain
    };
    assert_near(
        &z(&told, [0.1, 0.2, 0.3], Stored::Float),
        &[UNKNOWN, 0.2, 0.3],
    );
    let huge = DepthMeaning {
        scale: Some(1e30),
        ..plain
    };
    assert_near(
        &z(&huge, [1e30, 1.0, 2.0], Stored::Float),
        &[UNKNOWN, 1e30, 2e30],
    );
}

#[test]
fn a_meaning_that_is_not_complete_says_what_is_missing() {
    let said = |meaning: DepthMeaning, stored: Stored| {
        meaning
            .camera_z(&plane([1.0; 3], stored), &camera())
            .expect_err("not complete")
    };
    let of = DepthMeaning::of;
    assert!(
        said(of(DepthKind::Z), Stored::Code(65_535)).contains("--depth-scale"),
        "scale of whole numbers"
    );
    assert!(
        said(of(DepthKind::Disparity), Stored::Float).contains("baseline"),
        "baseline"
    );
    assert!(
        said(of(DepthKind::Mpeg), Stored::Code(255)).contains("--near and --far"),
        "planes"
    );
    let swapped = DepthMeaning {
        near_far: Some([5.0, 1.0]),
        ..of(DepthKind::OpenGl)
    };
    assert!(
        said(swapped, Stored::Float).contains("near < far"),
        "planes the wrong way around"
    );
    let negative = DepthMeaning {
        scale: Some(-1.0),
        ..of(DepthKind::Z)
    };
    assert!(
        said(negative, Stored::Float).contains("above 0"),
        "negative scale"
    );
    let backwards = DepthMeaning {
        baseline: Some(-3.0),
        ..of(DepthKind::Disparity)
    };
    assert!(
        said(backwards, Stored::Float).contains("baseline"),
        "negative baseline"
    );
}

fn codes(values: &[f32], largest: u32) -> Plane {
    Plane {
        width: 1,
        height: values.len(),
        values: values.to_vec(),
        stored: Stored::Code(largest),
    }
}

#[test]
fn relative_depth_is_linear_in_inverse_depth_between_its_planes() {
    let map = codes(&[20.0, 120.0, 70.0], 255);
    let mut meaning = DepthMeaning::of(DepthKind::Relative);
    let z = meaning.camera_z(&map, &camera()).expect("no unit needed");
    let close = |found: f32, expected: f64| (f64::from(found) / expected - 1.0).abs() < 1e-6;
    assert!(
        close(z[0], 10.0) && close(z[1], 1.0) && close(z[2], 1.0 / 0.55),
        "{z:?}"
    );
    meaning.near_far = Some([2.0, 4.0]);
    let z = meaning.camera_z(&map, &camera()).expect("planes");
    assert!(close(z[0], 4.0) && close(z[1], 2.0), "{z:?}");
    let flat = codes(&[0.0, 0.0], 65535);
    let z = meaning.camera_z(&flat, &camera()).expect("flat");
    assert!(close(z[0], 4.0), "0 is the farthest, not unknown: {z:?}");
}

#[test]
fn inverse_depth_without_a_unit_puts_its_nearest_at_one() {
    let z = DepthMeaning::of(DepthKind::Inverse)
        .camera_z(&codes(&[0.0, 50.0, 200.0], 255), &camera())
        .expect("no unit needed");
    assert!(z[0].is_nan(), "0 is unknown");
    assert_eq!(z[1..], [4.0, 1.0]);
}

#[test]
fn a_map_that_is_upside_down_or_without_a_unit_is_noted() {
    let far_above = [9.0, 8.0, 5.0, 4.0, 2.0, 1.0];
    let near_above = [1.0, 2.0, 4.0, 5.0, 8.0, 9.0];
    let whole = Stored::Code(255);
    let note = |kind, stored, z: &[f32]| DepthMeaning::of(kind).note(stored, z, 1);
    let inverted = note(DepthKind::Z, whole, &near_above).expect("a note");
    assert!(inverted.contains("relative"), "{inverted}");
    assert_eq!(note(DepthKind::Z, whole, &far_above), None);
    assert_eq!(
        note(DepthKind::Z, Stored::Float, &near_above),
        None,
        "a renderer's"
    );
    let open = note(DepthKind::Relative, whole, &far_above).expect("a note");
    assert!(open.contains("between 1 and 10"), "{open}");
    let inverted = note(DepthKind::Relative, whole, &near_above).expect("a note");
    assert!(inverted.contains("farther"), "{inverted}");
}
