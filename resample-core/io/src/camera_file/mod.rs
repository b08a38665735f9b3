//! Camera files: one camera or a list of cameras as JSON.
//!
//! Takes the path and what the command line says about size and field of view, gives cameras that are checked as
//! far as they can be before the volume is known. An object is either a look-at camera (position, target, up) or a
//! calibrated one (fx, fy, cx, cy, R, t); which of the two, its keys tell. Keys that are not known are errors.

pub mod json_fields;

use std::path::Path;

use glam::{DMat3, DVec3};
use resample_core::camera::orbit::Size;
use resample_core::{Camera, CameraError, Error, Intrinsics, LookAt, PixelCentre, Projection};
use serde_json::{Value, json};

use crate::camera_file::json_fields::Fields;
use crate::files::read_json;

type Result<T> = std::result::Result<T, Error>;

/// Most pixels of a picture: 16384 x 16384. The picture alone then takes 4 GiB; a camera file must not be able to
/// ask for all memory by its width and height.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Checks that a picture of this size can be held.
///
/// # Errors
/// A picture with more pixels than [`MAX_PIXELS`].
pub fn check_size(camera: &Camera) -> Result<()> {
    let (width, height) = (camera.width, camera.height);
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(Error::Option(format!(
            "a picture of {width}x{height} has more than {MAX_PIXELS} pixels: choose a smaller size"
        )));
    }
    Ok(())
}

/// An error of a camera's numbers.
fn fault(error: CameraError) -> Error {
    Error::Input(error.to_string())
}

/// An error behind the place where it is.
fn at(place: &str, error: Error) -> Error {
    Error::Input(format!("{place}: {error}"))
}

/// Defaults of the command line for a camera file.
#[derive(Clone, Copy, Debug)]
pub struct CameraDefaults {
    /// The picture size that was asked for; `None` leaves it to the file.
    pub size: Option<Size>,
    /// The size of a look-at camera when none was asked for.
    pub look_at_size: Size,
    /// Vertical field of view of a look-at camera without `fov_y`, degrees.
    pub fov_y_deg: f64,
}

/// A camera of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileCamera {
    /// The camera; its near plane counts only as far as `near` says.
    camera: Camera,
    near: NearPlane,
    /// From the eye to the target of a look-at camera, world units.
    target_distance: Option<f64>,
}

/// The cameras of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraFile {
    /// The file holds one object.
    One(FileCamera),
    /// The file holds a list, of at least one camera.
    List(Vec<FileCamera>),
}

/// Where the near plane of a camera comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NearPlane {
    /// It is in `camera`.
    Known,
    /// It follows from what the camera looks at.
    FromScene,
}

/// Near plane of a calibrated camera without `near`: this fraction of the distance to the far end of a volume or mesh,
/// or to the nearest sample of a depth image, the same fraction that a look-at camera takes of the distance to its
/// target.
pub const NEAR_FRACTION: f64 = 1e-4;

/// Largest camera file, bytes. A camera takes about 300 bytes, so this is 200 000 of them; a larger file is
/// something else that was named by mistake.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// The words of a projection.
const PROJECTIONS: [&str; 2] = ["perspective", "orthographic"];

/// Most cameras of a list: an hour of 28 pictures a second.
const MAX_CAMERAS: usize = 100_000;

/// Reads `path`. The error names the file, the number of the camera in a list (from 0), and the key.
pub fn read(path: &Path, defaults: &CameraDefaults) -> Result<CameraFile> {
    read_value(path)
        .and_then(|value| cameras(value, defaults))
        .map_err(|error| {
            at(
                &format!("{}: not a usable camera file", path.display()),
                error,
            )
        })
}

impl FileCamera {
    /// A camera of another kind of file, which states no near plane.
    pub fn without_near(camera: Camera) -> Self {
        Self {
            camera,
            near: NearPlane::FromScene,
            target_distance: None,
        }
    }

    /// The camera as it stands: its near plane may be a placeholder.
    pub fn with_any_near(&self) -> Camera {
        self.camera
    }

    /// The camera, with its near plane fitted to `bounds` (two corners of a box in the world) if the file gave none.
    pub fn for_bounds(&self, bounds: [DVec3; 2]) -> Result<Camera> {
        let eye = self.camera.eye_in_world();
        // Per axis, the farther of the two faces: together the farthest corner.
        let farthest = (bounds[0] - eye).abs().max((bounds[1] - eye).abs());
        self.for_distance(farthest.length())
    }

    /// The camera, with its near plane fitted to a scene at this distance, world units, if the file gave none.
    pub fn for_distance(&self, distance: f64) -> Result<Camera> {
        let mut camera = self.camera;
        if self.near == NearPlane::FromScene {
            camera.near = NEAR_FRACTION * distance;
        }
        camera.validated().map_err(fault)
    }

    /// From the eye to the target, world units, where the file gives a target.
    pub fn target_distance(&self) -> Option<f64> {
        self.target_distance
    }

    /// Picture width and height, px.
    pub fn size(&self) -> [u32; 2] {
        [self.camera.width, self.camera.height]
    }

    /// Kind of view.
    pub fn projection(&self) -> Projection {
        self.camera.projection
    }
}

/// The JSON value of a file, or that was typed in place of its name.
pub fn read_value(path: &Path) -> Result<Value> {
    let text = read_json(path, MAX_FILE_BYTES).map_err(|error| Error::Input(error.to_string()))?;
    serde_json::from_slice(&text).map_err(|error| Error::Input(error.to_string()))
}

fn cameras(value: Value, defaults: &CameraDefaults) -> Result<CameraFile> {
    let Value::Array(list) = value else {
        return Ok(CameraFile::One(one_camera(value, defaults)?));
    };
    if list.is_empty() {
        return Err(Error::Input("the list holds no camera".to_owned()));
    }
    if list.len() > MAX_CAMERAS {
        let count = list.len();
        return Err(Error::Input(format!(
            "the list holds {count} cameras, of which one run draws at most {MAX_CAMERAS}: split it"
        )));
    }
    let numbered = list.into_iter().enumerate();
    let cameras: Result<Vec<_>> = numbered
        .map(|(index, value)| {
            one_camera(value, defaults)
                .map_err(|error| at(&format!("camera {index} of the list"), error))
        })
        .collect();
    Ok(CameraFile::List(cameras?))
}

/// One camera from its JSON object.
pub fn one_camera(value: Value, defaults: &CameraDefaults) -> Result<FileCamera> {
    let mut fields = Fields::new(value)?;
    let calibrated = ["fx", "fy", "cx", "cy", "R", "t"]
        .iter()
        .any(|key| fields.holds(key));
    let camera = match calibrated {
        true => calibrated_camera(&mut fields, defaults)?,
        false => look_at_camera(&mut fields, defaults)?,
    };
    fields.finish()?;
    check_size(&camera.camera)?;
    Ok(camera)
}

/// The text of a file that reads back to the same cameras, bit by bit: an object, or a list of several.
pub fn text(cameras: &[Camera]) -> String {
    let value = match cameras {
        [camera] => object(camera),
        several => several.iter().map(object).collect(),
    };
    format!("{value:#}\n")
}

/// A calibrated camera as files have it; its numbers read back bit by bit.
pub fn object(camera: &Camera) -> Value {
    let world = camera.camera_from_world;
    let mut object = json!({
        "width": camera.width,
        "height": camera.height,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "R": world.matrix3.transpose().to_cols_array(),
        "t": world.translation.to_array(),
        "near": camera.near,
    });
    if camera.projection == Projection::Orthographic {
        object["projection"] = json!("orthographic");
    }
    object
}

fn look_at_camera(fields: &mut Fields, defaults: &CameraDefaults) -> Result<FileCamera> {
    let pose = LookAt {
        position: fields.required_vector("position")?,
        target: fields.required_vector("target")?,
        up: fields.required_vector("up")?,
    };
    let size = defaults.size.unwrap_or(defaults.look_at_size);
    let size = [size.width, size.height];
    let mut camera = match fields.word("projection", PROJECTIONS)? {
        Some("orthographic") => {
            Camera::orthographic(&pose, fields.required_number("height")?, size).map_err(fault)?
        }
        _ => {
            let fov_y_deg = fields.number("fov_y")?.unwrap_or(defaults.fov_y_deg);
            Camera::perspective(&pose, fov_y_deg.to_radians(), size).map_err(fault)?
        }
    };
    if let Some(near) = fields.number("near")? {
        camera.near = near;
    }
    let target_distance = Some(pose.position.distance(pose.target));
    Ok(FileCamera {
        camera: camera.validated().map_err(fault)?,
        near: NearPlane::Known,
        target_distance,
    })
}

fn calibrated_camera(fields: &mut Fields, defaults: &CameraDefaults) -> Result<FileCamera> {
    let intrinsics = intrinsics(fields)?;
    let rotation = DMat3::from_cols_array(&fields.required_numbers::<9>("R")?).transpose();
    let translation = fields.required_vector("t")?;
    let given = fields.number("near")?;
    // A near plane of 1 stands in until the volume is known, so that all the rest is checked now.
    let near = given.unwrap_or(1.0);
    let mut camera =
        Camera::from_intrinsics(&intrinsics, rotation, translation, near).map_err(fault)?;
    if fields.word("projection", PROJECTIONS)? == Some("orthographic") {
        camera.projection = Projection::Orthographic;
        camera = camera.validated().map_err(fault)?;
    }
    let camera = match defaults.size {
        Some(size) => camera.resized(size.width, size.height).map_err(fault)?,
        None => camera,
    };
    let near = if given.is_some() {
        NearPlane::Known
    } else {
        NearPlane::FromScene
    };
    Ok(FileCamera {
        camera,
        near,
        target_distance: None,
    })
}

fn intrinsics(fields: &mut Fields) -> Result<Intrinsics> {
    Ok(Intrinsics {
        width: fields.required_count("width")?,
        height: fields.required_count("height")?,
        fx: fields.required_number("fx")?,
        fy: fields.required_number("fy")?,
        cx: fields.required_number("cx")?,
        cy: fields.required_number("cy")?,
        pixel_centre: match fields.word("pixel_centre", ["half", "integer"])? {
            Some("integer") => PixelCentre::Integer,
            _ => PixelCentre::Half,
        },
    })
}

#[cfg(test)]
mod tests;
