//! Camera paths: what lies between keys, and what is refused by name.

use serde_json::json;

use glam::DVec3;

use super::*;
use crate::values::Size;

const DEFAULTS: CameraDefaults = CameraDefaults {
    size: None,
    look_at_size: Size {
        width: 80,
        height: 60,
    },
    fov_y_deg: 30.0,
};

const BOUNDS: [DVec3; 2] = [DVec3::NEG_ONE, DVec3::ONE];

fn key(time: f64, position: [f64; 3]) -> Value {
    json!({"time": time, "camera": {"position": position, "target": [0, 0, 0], "up": [0, 1, 0]}})
}

fn path(list: Vec<Value>) -> Result<CameraPath> {
    keys(
        json!({ "keys": list }),
        &DEFAULTS,
        KeyKind::Volume,
        &|name| Ok(name.into()),
    )
}

fn complaint(list: Vec<Value>) -> String {
    format!("{:#}", path(list).expect_err("a bad path"))
}

#[test]
fn keys_around_an_object_go_around_it() {
    let path = path(vec![key(0.0, [0.0, 0.0, 4.0]), key(2.0, [4.0, 0.0, 0.0])]).expect("good");
    let pictures = path.pictures(5.0).expect("few");
    assert_eq!(
        pictures.len(),
        11,
        "two seconds at five pictures a second, both ends"
    );
    let cameras = path
        .cameras(&pictures, |camera| camera.for_bounds(BOUNDS))
        .expect("good cameras");
    for camera in &cameras {
        let eye = camera.eye_in_world();
        assert!((eye.length() - 4.0).abs() < 1e-9, "distance stays: {eye}");
        let to_target = (-eye).normalize();
        assert!(
            (camera.forward_in_world() - to_target).length() < 1e-9,
            "the target stays in the middle"
        );
    }
    let half = cameras[5].eye_in_world();
    assert!(
        (half - DVec3::new(8f64.sqrt(), 0.0, 8f64.sqrt())).length() < 1e-6,
        "half way: {half}"
    );
}

#[test]
fn a_zoom_is_steady() {
    let camera = |fov: f64| json!({"position": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y": fov});
    let list = vec![
        json!({"time": 0, "camera": camera(60.0)}),
        json!({"time": 1, "camera": camera(10.0)}),
    ];
    let path = path(list).expect("good");
    let pictures = path.pictures(4.0).expect("few");
    let focal: Vec<f64> = path
        .cameras(&pictures, |camera| camera.for_bounds(BOUNDS))
        .expect("good")
        .iter()
        .map(|c| c.fx)
        .collect();
    let ratios: Vec<f64> = focal.windows(2).map(|pair| pair[1] / pair[0]).collect();
    assert!(
        ratios.iter().all(|r| (r / ratios[0] - 1.0).abs() < 1e-9),
        "equal ratios: {ratios:?}"
    );
}

#[test]
fn what_cannot_be_a_path_is_refused_by_name() {
    assert!(
        complaint(vec![key(0.0, [0.0, 0.0, 4.0])]).contains("two keys"),
        "one key"
    );
    let same = vec![key(1.0, [0.0, 0.0, 4.0]), key(1.0, [4.0, 0.0, 0.0])];
    assert!(
        complaint(same).contains("key 1 of the path: \"time\" is 1"),
        "times"
    );
    let mut other = key(2.0, [4.0, 0.0, 0.0]);
    other["camera"]["projection"] = json!("orthographic");
    other["camera"]["height"] = json!(3);
    assert!(
        complaint(vec![key(0.0, [0.0, 0.0, 4.0]), other])
            .contains("key 1 of the path: its picture size")
    );
    let mut odd = key(2.0, [4.0, 0.0, 0.0]);
    odd["colour"] = json!("red");
    assert!(complaint(vec![key(0.0, [0.0, 0.0, 4.0]), odd]).contains("unknown key \"colour\""));
}
