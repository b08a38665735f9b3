//! The warping equation, by addition along rows, against the direct form and against plain projection in f64.

use glam::{DMat3, DVec2, DVec3};
use proptest::prelude::*;
use resample_core::Camera;
use resample_tests::warps::scenes::camera;
use warp3d::warp::Warp;

/// A camera near `origin`, turned by the Euler angles.
fn posed(size: [u32; 2], focal_px: f64, eye: DVec3, angles: [f64; 3]) -> Camera {
    let mut camera = camera(size, focal_px, eye, 0.0);
    let rotation = DMat3::from_euler(glam::EulerRot::XYZ, angles[0], angles[1], angles[2]);
    camera.camera_from_world = glam::DAffine3::from_mat3_translation(rotation, rotation * -eye);
    camera
}

/// Where a point of the reference lies on the target, without the warping equation.
fn projected(reference: &Camera, target: &Camera, pixel: DVec2, depth: f64) -> (DVec2, f64) {
    let (origin, direction) = reference.ray_in_camera(pixel);
    let in_world = reference
        .camera_from_world
        .inverse()
        .transform_point3(origin + depth * direction);
    let in_target = target.camera_from_world.transform_point3(in_world);
    (target.screen_from_camera(in_target), in_target.z)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn addition_along_rows_equals_the_direct_form(
        angles in prop::array::uniform3(-0.4f64..0.4),
        step in prop::array::uniform3(-1.0f64..1.0),
        offset in prop::sample::select(vec![0.0, 1e3, 1e7]),
    ) {
        let origin = DVec3::splat(offset);
        let reference = posed([1500, 4], 700.0, origin, [0.0; 3]);
        let target = posed([640, 480], 500.0, origin + DVec3::from_array(step), angles);
        let warp = Warp::new(&reference, &target);
        for y in 0..4 {
            let mut row = warp.row(y);
            for x in 0..1500u32 {
                let depth = 2.0 + f64::from((x * 7 + y * 13) % 50);
                let by_addition = row.next(1.0 / depth);
                let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let direct = warp.at(pixel, 1.0 / depth);
                if direct.divisor < 0.05 {
                    continue;
                }
                let drift = by_addition.pos_in_screen().distance(direct.pos_in_screen());
                // A divisor of 0.05 magnifies the bound of the sums twentyfold.
                prop_assert!(drift < 100.0 * warp3d::warp::DRIFT_PX, "drift of {drift} px at ({x}, {y})");
                let (expected, z) = projected(&reference, &target, pixel, depth);
                // Poses 1e7 units away are known to 2e-9 units, times the focal length.
                let allowed = 1e-9 + 1e-12 * offset;
                prop_assert!(
                    direct.pos_in_screen().distance(expected) < 1e3 * allowed,
                    "{} against {expected}", direct.pos_in_screen()
                );
                prop_assert!((direct.depth - z).abs() < 100.0 * allowed, "depth {} against {z}", direct.depth);
            }
        }
    }
}

#[test]
fn sums_are_restarted_before_they_drift() {
    let reference = camera([30_000, 2], 15_000.0, DVec3::ZERO, 0.0);
    let target = camera([640, 480], 15_000.0, DVec3::X * 0.1, 0.3);
    let warp = Warp::new(&reference, &target);
    let mut row = warp.row(1);
    let mut worst = 0.0f64;
    for x in 0..30_000u32 {
        let at = row.next(0.2);
        let direct = warp.at(DVec2::new(f64::from(x) + 0.5, 1.5), 0.2);
        worst = worst.max(at.pos_in_screen().distance(direct.pos_in_screen()));
    }
    assert!(
        worst < 2.0 * warp3d::warp::DRIFT_PX,
        "{worst} px of drift over a row of 30000"
    );
}

#[test]
fn infinity_is_a_direction() {
    let reference = camera([64, 48], 50.0, DVec3::ZERO, 0.0);
    let moved = camera([64, 48], 50.0, DVec3::new(3.0, -2.0, 1.0), 0.0);
    let pixel = DVec2::new(10.5, 20.5);
    let at = Warp::new(&reference, &moved).at(pixel, 0.0).pos_in_screen();
    assert!(
        at.distance(pixel) < 1e-12,
        "a translation does not move what is infinitely far: {at}"
    );
}
