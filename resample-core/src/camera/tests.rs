//! Cameras from every source project as their formulas say, and broken ones are refused.

use super::*;

fn pose() -> LookAt {
    LookAt {
        position: DVec3::new(3.0, -2.0, 5.0),
        target: DVec3::new(0.5, 1.0, 0.0),
        up: DVec3::Y,
    }
}

#[test]
fn target_is_the_picture_centre_and_up_is_up() {
    let camera = Camera::perspective(&pose(), 0.6, [200, 100]).expect("valid");
    let seen = camera.screen_from_camera(camera.camera_from_world.transform_point3(pose().target));
    assert!(
        (seen - DVec2::new(100.0, 50.0)).length() < 1e-9,
        "target at {seen}"
    );
    let above = camera
        .camera_from_world
        .transform_point3(pose().target + DVec3::Y);
    assert!(
        camera.screen_from_camera(above).y < 50.0,
        "up must point to smaller y"
    );
    assert!(
        (camera.eye_in_world() - pose().position).length() < 1e-12,
        "eye"
    );
}

#[test]
fn ray_and_projection_are_inverse() {
    for camera in [
        Camera::perspective(&pose(), 1.2, [64, 48]).expect("valid"),
        Camera::orthographic(&pose(), 7.0, [64, 48]).expect("valid"),
    ] {
        let pixel = DVec2::new(13.25, 40.5);
        let (origin, direction) = camera.ray_in_camera(pixel);
        let back = camera.screen_from_camera(origin + 3.7 * direction);
        assert!((back - pixel).length() < 1e-10, "{back} against {pixel}");
    }
}

#[test]
fn integer_centres_move_the_principal_point_by_half_a_pixel() {
    let mut k = Intrinsics {
        width: 8,
        height: 6,
        fx: 5.0,
        fy: 6.0,
        cx: 3.5,
        cy: 2.5,
        pixel_centre: PixelCentre::Integer,
    };
    let integer = Camera::from_intrinsics(&k, DMat3::IDENTITY, DVec3::ZERO, 0.1).expect("valid");
    k.pixel_centre = PixelCentre::Half;
    let half = Camera::from_intrinsics(&k, DMat3::IDENTITY, DVec3::ZERO, 0.1).expect("valid");
    assert_eq!((integer.cx - half.cx, integer.cy - half.cy), (0.5, 0.5));
}

#[test]
fn bad_cameras_are_refused_with_a_reason() {
    let mut same = pose();
    same.target = same.position;
    assert_eq!(
        Camera::perspective(&same, 1.0, [8, 8]),
        Err(CameraError::NoDirection)
    );
    let mut along = pose();
    along.up = along.target - along.position;
    assert_eq!(
        Camera::perspective(&along, 1.0, [8, 8]),
        Err(CameraError::NoUp)
    );
    let good = Camera::perspective(&pose(), 1.0, [8, 8]).expect("valid");
    let mut scaled = good;
    scaled.camera_from_world.matrix3 *= 1.01;
    assert!(matches!(
        scaled.validated(),
        Err(CameraError::NotRotation(_))
    ));
    let mut flat = good;
    flat.camera_from_world.matrix3.x_axis = DVec3::splat(1e-9);
    assert!(matches!(flat.validated(), Err(CameraError::NotRotation(_))));
    assert!(good.resized(0, 8).is_err(), "empty picture");
    assert!(
        Camera::perspective(&pose(), f64::NAN, [8, 8]).is_err(),
        "NaN angle"
    );
}
