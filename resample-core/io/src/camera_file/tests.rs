//! Camera files: what they mean, and what is refused by name.

use glam::DVec2;
use resample_core::Projection;
use serde_json::json;

use super::*;

const DEFAULTS: CameraDefaults = CameraDefaults {
    size: None,
    look_at_size: Size {
        width: 80,
        height: 60,
    },
    fov_y_deg: 30.0,
};

fn parsed(value: Value) -> Result<CameraFile> {
    cameras(value, &DEFAULTS)
}

fn camera_of(value: Value) -> Camera {
    match parsed(value).expect("a good camera") {
        CameraFile::One(camera) => camera
            .for_bounds([DVec3::splat(-1.0), DVec3::ONE])
            .expect("a good near plane"),
        CameraFile::List(_) => panic!("one object is not a list"),
    }
}

fn complaint(value: Value) -> String {
    format!("{:#}", parsed(value).expect_err("a bad camera"))
}

fn look_at() -> Value {
    json!({"position": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y": 90})
}

fn calibrated() -> Value {
    json!({"width": 40, "height": 30, "fx": 50, "fy": 51, "cx": 20, "cy": 15,
           "R": [0, -1, 0, 1, 0, 0, 0, 0, 1], "t": [0, 0, 4]})
}

fn with(mut camera: Value, key: &str, value: Value) -> Value {
    camera[key] = value;
    camera
}

fn without(mut camera: Value, key: &str) -> Value {
    camera.as_object_mut().expect("an object").remove(key);
    camera
}

#[test]
fn look_at_takes_its_angle_from_the_file_or_from_the_defaults() {
    let camera = camera_of(look_at());
    assert_eq!(
        (camera.width, camera.height),
        (80, 60),
        "size of the command line"
    );
    assert!(
        (camera.fy - 30.0).abs() < 1e-9,
        "90 degrees over 60 px: focal length {} px",
        camera.fy
    );
    let narrower = camera_of(without(look_at(), "fov_y"));
    assert!(
        (narrower.fy - 30.0 / 15f64.to_radians().tan()).abs() < 1e-9,
        "30 degrees when the file says none"
    );
    assert_eq!(
        camera_of(with(look_at(), "near", json!(0.25))).near,
        0.25,
        "near plane of the file"
    );
}

#[test]
fn orthographic_takes_a_height_in_world_units() {
    let ortho = with(
        without(look_at(), "fov_y"),
        "projection",
        json!("orthographic"),
    );
    let camera = camera_of(with(ortho.clone(), "height", json!(3.0)));
    assert_eq!(
        (camera.projection, camera.fy),
        (Projection::Orthographic, 20.0),
        "60 px for 3 units"
    );
    assert!(
        complaint(ortho.clone()).contains("\"height\" is missing"),
        "a parallel view needs its height"
    );
    let both = with(with(ortho, "height", json!(3.0)), "fov_y", json!(30));
    assert!(
        complaint(both).contains("unknown key \"fov_y\""),
        "a parallel view has no angle"
    );
}

#[test]
fn rotation_is_row_major_from_world_to_camera() {
    let camera = camera_of(calibrated());
    let seen = camera
        .camera_from_world
        .transform_point3(DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(seen, DVec3::new(-2.0, 1.0, 7.0), "R p + t");
    let integer = camera_of(with(calibrated(), "pixel_centre", json!("integer")));
    assert_eq!(
        DVec2::new(integer.cx, integer.cy),
        DVec2::new(20.5, 15.5),
        "integer centres move by half a pixel"
    );
}

#[test]
fn near_plane_of_a_calibrated_camera_follows_the_box() {
    let camera = camera_of(calibrated());
    // The eye is at (0, 0, -4), the farthest corner of the box at (1, 1, 1).
    assert!(
        (camera.near - 1e-4 * 27f64.sqrt()).abs() < 1e-12,
        "near plane {}",
        camera.near
    );
    assert_eq!(
        camera_of(with(calibrated(), "near", json!(0.5))).near,
        0.5,
        "the file's own near plane wins"
    );
}

#[test]
fn size_of_the_command_line_stretches_a_calibrated_camera() {
    let defaults = CameraDefaults {
        size: Some(Size {
            width: 80,
            height: 30,
        }),
        ..DEFAULTS
    };
    let CameraFile::One(camera) = cameras(calibrated(), &defaults).expect("good") else {
        panic!("one camera")
    };
    assert_eq!(
        (camera.camera.fx, camera.camera.cx),
        (100.0, 40.0),
        "x is doubled"
    );
    assert_eq!(
        (camera.camera.fy, camera.camera.cy),
        (51.0, 15.0),
        "y stays"
    );
}

#[test]
fn complaints_name_the_key_and_the_camera() {
    for (bad, part) in [
        (with(look_at(), "fov", json!(3)), "unknown key \"fov\""),
        (without(look_at(), "up"), "\"up\" is missing"),
        (
            with(look_at(), "target", json!([0, 0])),
            "\"target\": expected a list of 3 numbers, found [0,0]",
        ),
        (
            with(look_at(), "target", json!([0, 0, 5])),
            "position and target are the same point",
        ),
        (
            with(look_at(), "fov_y", json!("wide")),
            "\"fov_y\": expected a number",
        ),
        (with(look_at(), "fov_y", json!(180)), "field of view"),
        (with(look_at(), "near", json!(0)), "near"),
        (with(look_at(), "width", json!(80)), "unknown key \"width\""),
        (
            with(calibrated(), "R", json!([2, 0, 0, 0, 2, 0, 0, 0, 2])),
            "rotation",
        ),
        (
            with(calibrated(), "R", json!([1, 0, 0, 0, 1, 0, 0, 0, -1])),
            "rotation",
        ),
        (with(calibrated(), "width", json!(0)), "width"),
        (
            with(calibrated(), "width", json!(1.5)),
            "\"width\": expected a whole number",
        ),
        (
            with(calibrated(), "pixel_centre", json!("corner")),
            "\"pixel_centre\": expected \"half\" or \"integer\"",
        ),
        (
            json!([look_at(), without(look_at(), "up")]),
            "camera 1 of the list: \"up\" is missing",
        ),
        (json!([]), "holds no camera"),
        (json!(3), "expected an object"),
    ] {
        let said = complaint(bad.clone());
        assert!(
            said.contains(part),
            "{bad}: said {said:?} instead of {part:?}"
        );
    }
}

#[test]
fn a_list_stays_a_list_even_of_one() {
    let file = parsed(json!([look_at()])).expect("a good list");
    assert!(
        matches!(&file, CameraFile::List(list) if list.len() == 1),
        "a list of one: {file:?}"
    );
}
