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

#[test]
fn a_resized_camera_sees_the_same_at_the_same_share_of_the_picture() {
    let camera = Camera::perspective(&pose(), 0.6, [200, 100]).expect("valid");
    let resized = camera.resized(300, 50).expect("valid");
    let point = camera
        .camera_from_world
        .transform_point3(DVec3::new(0.9, 0.3, -0.4));
    let [before, after] = [camera, resized].map(|camera| {
        camera.screen_from_camera(point) / DVec2::new(camera.width.into(), camera.height.into())
    });
    assert_eq!([resized.width, resized.height], [300, 50]);
    assert!((before - after).length() < 1e-12, "{before} and {after}");
}

#[test]
fn a_unit_of_length_changes_no_picture() {
    for camera in [
        Camera::perspective(&pose(), 1.2, [64, 48]).expect("valid"),
        Camera::orthographic(&pose(), 7.0, [64, 48]).expect("valid"),
    ] {
        let scaled = camera.in_unit(4.0);
        let point = DVec3::new(0.9, 0.3, -0.4);
        let [here, there] = [(camera, point), (scaled, point / 4.0)].map(|(camera, point)| {
            camera.screen_from_camera(camera.camera_from_world.transform_point3(point))
        });
        assert!((here - there).length() < 1e-12, "{here} and {there}");
        assert_eq!(scaled.near, camera.near / 4.0);
    }
}

#[test]
fn the_edges_of_a_view_are_its_angle_or_its_height() {
    let camera = Camera::perspective(&pose(), 1.2, [64, 48]).expect("valid");
    let top = camera.screen_from_camera(DVec3::new(0.0, -(0.6f64).tan(), 1.0));
    assert!((top - DVec2::new(32.0, 0.0)).length() < 1e-12, "{top}");
    assert!((camera.near - 1e-4 * pose().position.distance(pose().target)).abs() < 1e-15);
    let flat = Camera::orthographic(&pose(), 7.0, [64, 48]).expect("valid");
    let top = flat.screen_from_camera(DVec3::new(0.0, -3.5, 1.0));
    assert!((top - DVec2::new(32.0, 0.0)).length() < 1e-12, "{top}");
    let forward = (pose().target - pose().position).normalize();
    assert!((flat.forward_in_world() - forward).length() < 1e-12);
}

#[test]
fn each_number_of_a_camera_is_held_to_its_range() {
    let good = Camera::perspective(&pose(), 0.6, [200, 100]).expect("valid");
    let refused = |change: &dyn Fn(&mut Camera)| {
        let mut camera = good;
        change(&mut camera);
        assert!(camera.validated().is_err(), "{camera:?}");
    };
    for angle in [0.0, -1.0, std::f64::consts::PI, f64::NAN] {
        assert!(Camera::perspective(&pose(), angle, [200, 100]).is_err());
    }
    for height in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        assert!(Camera::orthographic(&pose(), height, [200, 100]).is_err());
    }
    refused(&|camera| camera.fx = 0.0);
    refused(&|camera| camera.fy = -1.0);
    refused(&|camera| camera.width = 0);
    refused(&|camera| camera.height = MAX_SIDE_PX + 1);
    refused(&|camera| camera.near = 0.0);
    refused(&|camera| camera.camera_from_world.translation.y = f64::NAN);
    refused(&|camera| camera.camera_from_world.matrix3.x_axis.x = f64::INFINITY);
    refused(&|camera| camera.camera_from_world.matrix3 *= -1.0);
    refused(&|camera| camera.camera_from_world.matrix3 *= 1.001);
    let mut largest = good;
    (largest.width, largest.height) = (MAX_SIDE_PX, 1);
    assert!(largest.validated().is_ok(), "the largest side is allowed");
    let mut flat = Camera::orthographic(&pose(), 7.0, [64, 48]).expect("valid");
    flat.near = -3.0;
    assert!(
        flat.validated().is_ok(),
        "parallel views have no nearest distance"
    );
}
