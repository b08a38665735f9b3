//! Cameras anywhere inside a JSON file, as test scenes have them: `{"ref": {...}, "targets": [{...}, ...]}`.
//!
//! A camera is an object with `W`, `H`, `fx`, `fy`, `cx`, `cy`, `R` (nine numbers, row by row) and `t`: OpenCV's axes
//! (x right, y down, z forward), world-to-camera, pixel centres at whole numbers. The path of keys to it is its name:
//! `targets/0`.

use glam::{DAffine3, DMat3, DVec3};
use resample_core::camera::PixelCentre;
use serde_json::Value;

use super::entry::{CameraSet, Entry, Lens, LensModel, Names};
use super::json::{numbers, required, side};

/// Deepest level at which a camera is looked for. A guess, far above what files have.
const DEEPEST: usize = 6;

pub(super) fn is_it(value: &Value) -> bool {
    !found(value).is_empty()
}

pub(super) fn read(value: &Value) -> Result<CameraSet, String> {
    let entries = found(value).into_iter().map(|(name, object)| {
        one(object, &name).map_err(|what| format!("camera '{name}': {what}"))
    });
    Ok(CameraSet {
        format: "camera file",
        entries: entries.collect::<Result<_, String>>()?,
        pair: None,
        names: Names::Words,
    })
}

/// The cameras and their names, in the file's order.
fn found(value: &Value) -> Vec<(String, &Value)> {
    let mut found = Vec::new();
    look_into(value, &mut Vec::new(), &mut found);
    found
}

fn look_into<'a>(value: &'a Value, path: &mut Vec<String>, found: &mut Vec<(String, &'a Value)>) {
    let is_camera = ["W", "H", "R", "t"]
        .iter()
        .all(|key| value.get(key).is_some());
    if is_camera {
        found.push((path.join("/"), value));
        return;
    }
    if path.len() == DEEPEST {
        return;
    }
    let children: Vec<(String, &Value)> = match value {
        Value::Object(map) => map
            .iter()
            .map(|(key, child)| (key.clone(), child))
            .collect(),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .map(|(index, child)| (index.to_string(), child))
            .collect(),
        _ => return,
    };
    for (key, child) in children {
        path.push(key);
        look_into(child, path, found);
        path.pop();
    }
}

fn one(object: &Value, name: &str) -> Result<Entry, String> {
    let side = |key: &str| side(object, key)?.ok_or_else(|| format!("\"{key}\" is missing"));
    let size = [side("W")?, side("H")?];
    let lens = Lens {
        fx: required(object, "fx")?,
        fy: required(object, "fy")?,
        cx: required(object, "cx")?,
        cy: required(object, "cy")?,
        pixel_centre: PixelCentre::Integer,
    };
    let rotation = DMat3::from_cols_array(&numbers::<9>(object, "R")?).transpose();
    let translation = DVec3::from_array(numbers::<3>(object, "t")?);
    let pose = DAffine3 {
        matrix3: rotation,
        translation,
    };
    let model = LensModel {
        lens,
        size,
        distortion: None,
    };
    model.entry(name.to_owned(), pose)
}
