//! Cameras that a mesh file brings along.
//!
//! Takes a scene's cameras and the name or number that was typed, gives a camera of the renderer. The vertical field of
//! view is the file's; the width follows from the picture's proportions.
//! Limits: near and far planes of the file are not used; nothing within sight is cut off.

use glam::DVec3;
use resample_core::{Camera, Error, LookAt};

use crate::scene::{SceneCamera, SceneLens};

/// Height of a picture without a size of its own, px.
const DEFAULT_HEIGHT_PX: u32 = 800;

/// The camera called `word`, or of that number from 0, for a scene with bounding box `bounds`; width and height in px.
///
/// # Errors
/// There is no such camera, or it cannot be used.
pub fn named(
    cameras: &[SceneCamera],
    word: &str,
    size: Option<[u32; 2]>,
    bounds: [DVec3; 2],
) -> Result<Camera, Error> {
    let by_name = cameras.iter().find(|camera| camera.name == word);
    let found = by_name.or_else(|| cameras.get(word.parse::<usize>().ok()?));
    match found {
        Some(camera) => placed(camera, size, bounds),
        None => Err(Error::Option(format!(
            "--camera-name {word}: no such camera: {}",
            list(cameras)
        ))),
    }
}

fn placed(
    camera: &SceneCamera,
    size: Option<[u32; 2]>,
    bounds: [DVec3; 2],
) -> Result<Camera, Error> {
    let pose = &camera.world_from_camera;
    let (position, forward) = (pose.translation, -pose.matrix3.z_axis);
    // The distance of the target decides the near plane only: that of the farthest corner suits what is shown.
    let reach = (bounds[0] - position)
        .abs()
        .max((bounds[1] - position).abs())
        .length();
    let distance = if reach > 0.0 { reach } else { 1.0 };
    let look = LookAt {
        position,
        target: position + distance * forward,
        up: pose.matrix3.y_axis,
    };
    let size = size.unwrap_or_else(|| own_size(&camera.lens));
    let made = match camera.lens {
        SceneLens::Perspective { fov_y_rad, .. } => Camera::perspective(&look, fov_y_rad, size),
        SceneLens::Orthographic { size: view } => Camera::orthographic(&look, view.y, size),
    };
    made.map_err(|error| Error::Option(error.to_string()))
}

/// The default height, and the width that the file's proportions give.
fn own_size(lens: &SceneLens) -> [u32; 2] {
    let aspect = match *lens {
        SceneLens::Perspective { aspect, .. } => aspect.unwrap_or(1.0),
        SceneLens::Orthographic { size } => size.x / size.y,
    };
    let height = DEFAULT_HEIGHT_PX;
    let widest = f64::from(resample_core::camera::MAX_SIDE_PX);
    let width = (f64::from(height) * aspect).round().clamp(1.0, widest) as u32;
    [width, height]
}

fn list(cameras: &[SceneCamera]) -> String {
    // More would not be read.
    const LISTED: usize = 10;
    let named = |(index, camera): (usize, &SceneCamera)| match camera.name.as_str() {
        "" => index.to_string(),
        name => format!("{index} ({})", name.chars().take(40).collect::<String>()),
    };
    match cameras {
        [] => "the file has none".to_owned(),
        _ => {
            let names: Vec<_> = cameras.iter().enumerate().take(LISTED).map(named).collect();
            format!("the file has {}", names.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DQuat, DVec2};

    use super::*;

    const BOUNDS: [DVec3; 2] = [DVec3::splat(-1.0), DVec3::splat(1.0)];

    fn cameras() -> Vec<SceneCamera> {
        let perspective = SceneLens::Perspective {
            fov_y_rad: 1.0,
            aspect: Some(2.0),
        };
        let orthographic = SceneLens::Orthographic {
            size: DVec2::new(3.0, 6.0),
        };
        let pose = DAffine3::from_rotation_translation(
            DQuat::from_rotation_y(0.5),
            DVec3::new(0.0, 0.0, 5.0),
        );
        [("front", perspective), ("", orthographic)]
            .map(|(name, lens)| SceneCamera {
                name: name.into(),
                world_from_camera: pose,
                lens,
            })
            .to_vec()
    }

    #[test]
    fn what_lies_before_the_camera_is_in_the_middle_and_up_is_up() {
        for word in ["front", "0", "1"] {
            let camera = named(&cameras(), word, None, BOUNDS).expect("there is such a camera");
            let pose = cameras()[0].world_from_camera;
            let seen = |pos: DVec3| {
                let in_world = pose.transform_point3(pos);
                camera.screen_from_camera(camera.camera_from_world.transform_point3(in_world))
            };
            let middle = DVec2::new(f64::from(camera.width), f64::from(camera.height)) * 0.5;
            assert!(
                (seen(DVec3::new(0.0, 0.0, -3.0)) - middle).length() < 1e-9,
                "{word}: straight ahead"
            );
            let shifted = seen(DVec3::new(0.5, 0.5, -3.0)) - middle;
            assert!(
                shifted.x > 0.0 && shifted.y < 0.0,
                "{word}: right and up, not {shifted}"
            );
        }
    }

    #[test]
    fn sizes_follow_the_file_unless_one_is_asked_for() {
        let camera = |word: &str, size| named(&cameras(), word, size, BOUNDS).expect("a camera");
        assert_eq!(
            (camera("0", None).width, camera("1", None).width),
            (1600, 400),
            "proportions of the file"
        );
        let size = Some([10, 20]);
        assert_eq!(
            (camera("0", size).width, camera("0", size).height),
            (10, 20),
            "what was asked for"
        );
    }

    #[test]
    fn an_unknown_camera_lists_those_there_are() {
        let error = named(&cameras(), "back", None, BOUNDS)
            .expect_err("no such camera")
            .to_string();
        assert!(error.contains("0 (front), 1"), "{error}");
        assert!(
            named(&[], "0", None, BOUNDS).is_err_and(|e| e.to_string().contains("none")),
            "no cameras"
        );
    }
}
