//! NeRF's and Blender's `transforms.json`.
//!
//! Each frame has `transform_matrix`, camera-to-world, with OpenGL's axes: x right, y up, z towards the viewer. The
//! lens is `fl_x`, `fl_y`, `cx`, `cy`, `w`, `h`, or the horizontal angle `camera_angle_x`, per frame or for all; pixel
//! centres at one half. The picture's path is the camera's name. Source: the NeRF synthetic scenes, and the
//! conventions of nerfstudio's data. Distortion is OpenCV's: `k1` to `k4`, `p1`, `p2`, or
//! with the model `OPENCV_FISHEYE` that of a fish eye.

use glam::{DAffine3, DMat3, DVec3};
use resample_core::camera::PixelCentre;
use serde_json::Value;

use super::distortion::Distortion;
use super::entry::{CameraSet, Entry, Hints, Lens, LensModel, Names};
use super::json::{number, numbers, side};
use super::trajectory::inverse;

pub(super) fn is_it(value: &Value) -> bool {
    let frame = value
        .get("frames")
        .and_then(Value::as_array)
        .and_then(|frames| frames.first());
    frame.is_some_and(|frame| frame.get("transform_matrix").is_some())
}

pub(super) fn read(value: &Value, hints: &Hints) -> Result<CameraSet, String> {
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
            lens(frame, value, hints)?.entry(name, camera_from_world(frame)?)
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

fn lens(frame: &Value, all: &Value, hints: &Hints) -> Result<LensModel, String> {
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
