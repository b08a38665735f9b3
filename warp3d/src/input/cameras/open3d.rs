//! Open3D's JSON: a lens (`PinholeCameraIntrinsic`), a camera (`PinholeCameraParameters`) or a list of cameras
//! (`PinholeCameraTrajectory`).
//!
//! Matrices are written column by column; `extrinsic` is world-to-camera; axes x right, y down, z forward; pixel
//! centres at whole numbers. Source: Open3D's documentation of its file input and output. Cameras are named by their
//! number from 0.

use glam::{DAffine3, DMat4};
use resample_core::camera::PixelCentre;
use serde_json::Value;

use super::entry::{CameraSet, Entry, Lens, LensModel, Names};
use super::json::{numbers, side};

pub(super) fn is_it(value: &Value) -> bool {
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

pub(super) fn read(value: &Value) -> Result<CameraSet, String> {
    let list = cameras(value).ok_or("expected cameras of Open3D")?;
    let entries = list.into_iter().enumerate().map(|(index, camera)| {
        one(camera, index).map_err(|what| format!("camera {index}: {what}"))
    });
    Ok(CameraSet {
        format: "camera file of Open3D",
        entries: entries.collect::<Result<_, _>>()?,
        pair: None,
        names: Names::Words,
    })
}

fn one(camera: &Value, index: usize) -> Result<Entry, String> {
    let pose = DMat4::from_cols_array(&numbers::<16>(camera, "extrinsic")?);
    let (lens, size) = lens(camera.get("intrinsic").unwrap_or(&Value::Null))?;
    let model = LensModel {
        lens,
        size: size.ok_or("\"width\" and \"height\" are missing")?,
        distortion: None,
    };
    model.entry(index.to_string(), DAffine3::from_mat4(pose))
}

/// The lens of a `PinholeCameraIntrinsic` and the size of its picture, where it is stated.
pub(super) fn lens(value: &Value) -> Result<(Lens, Option<[u32; 2]>), String> {
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
