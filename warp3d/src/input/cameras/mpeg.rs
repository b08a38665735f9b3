//! MPEG's camera JSON, as the Reference View Synthesizer and the test model for immersive video have it.
//!
//! A camera has `Position` and `Rotation`, camera-to-world, with OMAF's axes: x forward, y left, z up. `Rotation` is
//! yaw, pitch and roll in degrees: turns around z, then y, then x. `Focal` and `Principle_point` in pixels, centres at
//! one half. Sources: the manual of the Reference View Synthesizer, and the common test conditions of MPEG immersive
//! video. Limits: `Projection` must be `Perspective`.

use glam::{DAffine3, DMat3, DVec3};
use resample_core::camera::PixelCentre;
use serde_json::Value;

use super::entry::{CameraSet, Entry, Lens, LensModel, Names};
use super::json::numbers;
use super::trajectory::inverse;

pub(super) fn is_it(value: &Value) -> bool {
    let first = value
        .get("cameras")
        .and_then(Value::as_array)
        .and_then(|cameras| cameras.first());
    first.is_some_and(|camera| camera.get("Position").is_some() && camera.get("Rotation").is_some())
}

pub(super) fn read(value: &Value) -> Result<CameraSet, String> {
    let cameras = value
        .get("cameras")
        .and_then(Value::as_array)
        .ok_or("\"cameras\" is missing")?;
    let entries = cameras.iter().enumerate().map(|(index, object)| {
        let name = object
            .get("Name")
            .and_then(Value::as_str)
            .map_or(index.to_string(), str::to_owned);
        one(object, &name).map_err(|what| format!("camera '{name}': {what}"))
    });
    Ok(CameraSet {
        format: "MPEG camera file",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Words,
    })
}

fn one(object: &Value, name: &str) -> Result<Entry, String> {
    let projection = object
        .get("Projection")
        .and_then(Value::as_str)
        .unwrap_or("Perspective");
    if projection != "Perspective" {
        return Err(format!(
            "the projection '{projection}' is not read, only Perspective"
        ));
    }
    let size = numbers::<2>(object, "Resolution")?.map(|px| px as u32);
    let [fx, fy] = numbers::<2>(object, "Focal")?;
    let [cx, cy] = numbers::<2>(object, "Principle_point")?;
    let [yaw, pitch, roll] = numbers::<3>(object, "Rotation")?.map(f64::to_radians);
    let turn =
        DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll);
    // The columns are where right, down and forward point in OMAF's axes.
    let omaf_from_camera = DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X);
    let position = DVec3::from_array(numbers::<3>(object, "Position")?);
    let world_from_camera = DAffine3 {
        matrix3: turn * omaf_from_camera,
        translation: position,
    };
    let lens = Lens {
        fx,
        fy,
        cx,
        cy,
        pixel_centre: PixelCentre::Half,
    };
    let model = LensModel {
        lens,
        size,
        distortion: None,
    };
    model.entry(name.to_owned(), inverse(world_from_camera))
}
