//! Camera files in JSON: NeRF's and Blender's, MPEG's, Open3D's, and cameras anywhere inside a file.

use glam::{DAffine3, DMat3, DMat4, DVec3};
use resample_core::camera::PixelCentre;
use serde_json::Value;

use crate::input::cameras::distortion::Distortion;
use crate::input::cameras::entry::{CameraSet, Entry, Hints, Lens, LensModel, Names};
use crate::input::cameras::text::inverse;

// Values inside JSON of any shape, each complaint with the name of its key.

/// The value that a text holds.
pub(super) fn value(text: &str) -> Result<Value, String> {
    serde_json::from_str(text).map_err(|error| format!("not valid JSON: {error}"))
}

/// A number under a key.
pub(super) fn number(object: &Value, key: &str) -> Result<Option<f64>, String> {
    match object.get(key) {
        None | Some(Value::Null) => Ok(None),
        Some(value) => value
            .as_f64()
            .map(Some)
            .ok_or_else(|| format!("\"{key}\": expected a number, found {}", short(value))),
    }
}

/// A number that must be there.
pub(super) fn required(object: &Value, key: &str) -> Result<f64, String> {
    number(object, key)?.ok_or_else(|| format!("\"{key}\" is missing"))
}

/// A whole number of pixels; some writers store it as 640.0.
pub(super) fn side(object: &Value, key: &str) -> Result<Option<u32>, String> {
    let Some(px) = number(object, key)? else {
        return Ok(None);
    };
    let whole = px >= 1.0 && px <= f64::from(u32::MAX) && px.fract() == 0.0;
    if whole {
        Ok(Some(px as u32))
    } else {
        Err(format!(
            "\"{key}\" is {px}: expected a whole number of pixels"
        ))
    }
}

/// Exactly `N` numbers under a key; lists inside the list are joined, as rows of a matrix are.
pub(super) fn numbers<const N: usize>(object: &Value, key: &str) -> Result<[f64; N], String> {
    let value = object
        .get(key)
        .ok_or_else(|| format!("\"{key}\" is missing"))?;
    let mut found = Vec::new();
    for entry in value.as_array().into_iter().flatten() {
        match entry.as_array() {
            Some(row) => found.extend(row.iter().map(Value::as_f64)),
            None => found.push(entry.as_f64()),
        }
    }
    let found: Option<Vec<f64>> = found.into_iter().collect();
    let array = found.and_then(|found| <[f64; N]>::try_from(found).ok());
    array.ok_or_else(|| {
        format!(
            "\"{key}\": expected a list of {N} numbers, found {}",
            short(value)
        )
    })
}

/// The start of a value, for a message.
fn short(value: &Value) -> String {
    value.to_string().chars().take(60).collect()
}

// NeRF's and Blender's `transforms.json`.
//
// Each frame has `transform_matrix`, camera-to-world, with OpenGL's axes: x right, y up, z towards the viewer. The
// lens is `fl_x`, `fl_y`, `cx`, `cy`, `w`, `h`, or the horizontal angle `camera_angle_x`, per frame or for all; pixel
// centres at one half. The picture's path is the camera's name. Source: the NeRF synthetic scenes, and the
// conventions of nerfstudio's data. Distortion is OpenCV's: `k1` to `k4`, `p1`, `p2`, or
// with the model `OPENCV_FISHEYE` that of a fish eye.

pub(super) fn is_transforms(value: &Value) -> bool {
    let frame = value
        .get("frames")
        .and_then(Value::as_array)
        .and_then(|frames| frames.first());
    frame.is_some_and(|frame| frame.get("transform_matrix").is_some())
}

pub(super) fn read_transforms(value: &Value, hints: &Hints) -> Result<CameraSet, String> {
    let frames = value
        .get("frames")
        .and_then(Value::as_array)
        .ok_or("\"frames\" is missing")?;
    let entries = frames.iter().enumerate().map(|(index, frame)| {
        let one = || -> Result<Entry, String> {
            let name = frame
                .get("file_path")
                .and_then(Value::as_str)
                .map_or(index.to_string(), str::to_owned);
            transforms_lens(frame, value, hints)?.entry(name, camera_from_world(frame)?)
        };
        one().map_err(|what| format!("frames[{index}]: {what}"))
    });
    Ok(CameraSet {
        format: "transforms.json",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Words,
    })
}

fn camera_from_world(frame: &Value) -> Result<DAffine3, String> {
    let m = numbers::<16>(frame, "transform_matrix")?;
    let column = |i: usize| DVec3::new(m[i], m[4 + i], m[8 + i]);
    // From x right, y down, z forward to x right, y up, z backward.
    let world_from_camera = DAffine3 {
        matrix3: DMat3::from_cols(column(0), -column(1), -column(2)),
        translation: column(3),
    };
    Ok(inverse(world_from_camera))
}

fn transforms_lens(frame: &Value, all: &Value, hints: &Hints) -> Result<LensModel, String> {
    let either = |key: &str| -> Result<Option<f64>, String> {
        Ok(number(frame, key)?.or(number(all, key)?))
    };
    let model = |value: &Value| value.get("camera_model")?.as_str().map(str::to_owned);
    let is_fish_eye = model(frame)
        .or(model(all))
        .is_some_and(|model| model.contains("FISHEYE"));
    let k = |key: &str| -> Result<f64, String> { Ok(either(key)?.unwrap_or(0.0)) };
    let distortion = if is_fish_eye {
        Some(Distortion::fish_eye([
            k("k1")?,
            k("k2")?,
            k("k3")?,
            k("k4")?,
        ]))
    } else {
        Distortion::with_eighth(
            [k("k1")?, k("k2")?, k("k3")?, 0.0, 0.0, 0.0],
            [k("p1")?, k("p2")?],
            k("k4")?,
        )
    };
    let stated =
        |key: &str| -> Result<Option<u32>, String> { Ok(side(frame, key)?.or(side(all, key)?)) };
    let stated = stated("w")?
        .zip(stated("h")?)
        .map(|(width, height)| [width, height]);
    let size = stated
        .or(hints.size)
        .ok_or("no \"w\" and \"h\": give the picture's size")?;
    let [width, height] = size.map(f64::from);
    let from_angle = |key: &str, side: f64| -> Result<Option<f64>, String> {
        Ok(either(key)?.map(|angle_rad| 0.5 * side / (0.5 * angle_rad).tan()))
    };
    let fx = either("fl_x")?.or(from_angle("camera_angle_x", width)?);
    let fx = fx.ok_or("no \"fl_x\" and no \"camera_angle_x\": the focal length is missing")?;
    let fy = either("fl_y")?
        .or(from_angle("camera_angle_y", height)?)
        .unwrap_or(fx);
    let cx = either("cx")?.unwrap_or(0.5 * width);
    let cy = either("cy")?.unwrap_or(0.5 * height);
    Ok(LensModel {
        lens: Lens {
            fx,
            fy,
            cx,
            cy,
            pixel_centre: PixelCentre::Half,
        },
        size,
        distortion,
    })
}

// MPEG's camera JSON, as the Reference View Synthesizer and the test model for immersive video have it.
//
// A camera has `Position` and `Rotation`, camera-to-world, with OMAF's axes: x forward, y left, z up. `Rotation` is
// yaw, pitch and roll in degrees: turns around z, then y, then x. `Focal` and `Principle_point` in pixels, centres at
// one half. Sources: the manual of the Reference View Synthesizer, and the common test conditions of MPEG immersive
// video. Limits: `Projection` must be `Perspective`.

pub(super) fn is_mpeg(value: &Value) -> bool {
    let first = value
        .get("cameras")
        .and_then(Value::as_array)
        .and_then(|cameras| cameras.first());
    first.is_some_and(|camera| camera.get("Position").is_some() && camera.get("Rotation").is_some())
}

pub(super) fn read_mpeg(value: &Value) -> Result<CameraSet, String> {
    let cameras = value
        .get("cameras")
        .and_then(Value::as_array)
        .ok_or("\"cameras\" is missing")?;
    let entries = cameras.iter().enumerate().map(|(index, object)| {
        let name = object
            .get("Name")
            .and_then(Value::as_str)
            .map_or(index.to_string(), str::to_owned);
        mpeg_camera(object, &name).map_err(|what| format!("camera '{name}': {what}"))
    });
    Ok(CameraSet {
        format: "MPEG camera file",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Words,
    })
}

fn mpeg_camera(object: &Value, name: &str) -> Result<Entry, String> {
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

// Open3D's JSON: a lens (`PinholeCameraIntrinsic`), a camera (`PinholeCameraParameters`) or a list of cameras
// (`PinholeCameraTrajectory`).
//
// Matrices are written column by column; `extrinsic` is world-to-camera; axes x right, y down, z forward; pixel
// centres at whole numbers. Source: Open3D's documentation of its file input and output. Cameras are named by their
// number from 0.

pub(super) fn is_open3d(value: &Value) -> bool {
    cameras(value).is_some()
}

/// Returns true if a file holds a lens alone.
pub(super) fn is_lens(value: &Value) -> bool {
    value.get("intrinsic_matrix").is_some()
}

fn cameras(value: &Value) -> Option<Vec<&Value>> {
    let is_camera = |value: &Value| {
        value.get("extrinsic").is_some() && value.get("intrinsic").is_some_and(is_lens)
    };
    let list: Vec<&Value> = match value.get("parameters").and_then(Value::as_array) {
        Some(list) => list.iter().collect(),
        None => vec![value],
    };
    let is_list = !list.is_empty() && list.iter().all(|camera| is_camera(camera));
    is_list.then_some(list)
}

pub(super) fn read_open3d(value: &Value) -> Result<CameraSet, String> {
    let list = cameras(value).ok_or("expected cameras of Open3D")?;
    let entries = list.into_iter().enumerate().map(|(index, camera)| {
        open3d_camera(camera, index).map_err(|what| format!("camera {index}: {what}"))
    });
    Ok(CameraSet {
        format: "camera file of Open3D",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Words,
    })
}

fn open3d_camera(camera: &Value, index: usize) -> Result<Entry, String> {
    let pose = DMat4::from_cols_array(&numbers::<16>(camera, "extrinsic")?);
    let (lens, size) = open3d_lens(camera.get("intrinsic").unwrap_or(&Value::Null))?;
    let model = LensModel {
        lens,
        size: size.ok_or("\"width\" and \"height\" are missing")?,
        distortion: None,
    };
    model.entry(index.to_string(), DAffine3::from_mat4(pose))
}

/// The lens of a `PinholeCameraIntrinsic` and the size of its picture, where it is stated.
pub(super) fn open3d_lens(value: &Value) -> Result<(Lens, Option<[u32; 2]>), String> {
    let k = numbers::<9>(value, "intrinsic_matrix")?;
    let lens = Lens {
        fx: k[0],
        fy: k[4],
        cx: k[6],
        cy: k[7],
        pixel_centre: PixelCentre::Integer,
    };
    let size = side(value, "width")?.zip(side(value, "height")?);
    Ok((lens, size.map(|(width, height)| [width, height])))
}

// Cameras anywhere inside a JSON file, as test scenes have them: `{"ref": {...}, "targets": [{...}, ...]}`.
//
// A camera is an object with `W`, `H`, `fx`, `fy`, `cx`, `cy`, `R` (nine numbers, row by row) and `t`: OpenCV's axes
// (x right, y down, z forward), world-to-camera, pixel centres at whole numbers. The path of keys to it is its name:
// `targets/0`.

/// Deepest level at which a camera is looked for. A guess, far above what files have.
const DEEPEST: usize = 6;

pub(super) fn is_nested(value: &Value) -> bool {
    !found(value).is_empty()
}

pub(super) fn read_nested(value: &Value) -> Result<CameraSet, String> {
    let entries = found(value).into_iter().map(|(name, object)| {
        nested_camera(object, &name).map_err(|what| format!("camera '{name}': {what}"))
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

fn nested_camera(object: &Value, name: &str) -> Result<Entry, String> {
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
