//! Cameras of a glTF file.
//!
//! Takes the nodes that a scene shows, gives their cameras in the world. A node's scale does not reach its camera, as
//! glTF demands. A camera that cannot be used is left out, with a note, because the picture may not need it.
//! Source: glTF 2.0, 3.10. Limits: near and far planes are left to the renderer.

use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3};
use gltf::json::Root;

use super::super::notes::Notes;
use crate::scene::{SceneCamera, SceneLens};

/// The cameras of the nodes in `shown`.
pub(super) fn cameras(
    root: &Root,
    shown: &[usize],
    world_from_nodes: &[DMat4],
    notes: &mut Notes,
) -> Vec<SceneCamera> {
    let mut cameras = Vec::new();
    for &node in shown {
        let Some(index) = root.nodes[node].camera.map(|camera| camera.value()) else {
            continue;
        };
        let json = root.cameras.get(index);
        let pose = pose(&world_from_nodes[node]);
        match json.and_then(lens).zip(pose) {
            Some((lens, world_from_camera)) => {
                let name = json
                    .and_then(|json| json.name.clone())
                    .or_else(|| root.nodes[node].name.clone());
                cameras.push(SceneCamera {
                    name: name.unwrap_or_default(),
                    world_from_camera,
                    lens,
                });
            }
            None => notes.say(format!("camera {index} is not usable and is left out")),
        }
    }
    cameras
}

fn lens(json: &gltf::json::Camera) -> Option<SceneLens> {
    if let Some(lens) = &json.perspective {
        let fov_y_rad = f64::from(lens.yfov);
        let aspect = lens
            .aspect_ratio
            .map(f64::from)
            .filter(|&aspect| aspect > 0.0 && aspect.is_finite());
        let usable = fov_y_rad > 0.0 && fov_y_rad < std::f64::consts::PI;
        return usable.then_some(SceneLens::Perspective { fov_y_rad, aspect });
    }
    let lens = json.orthographic.as_ref()?;
    // The file gives half of the view; a negative one would mirror it, which glTF advises against.
    let size = 2.0 * DVec2::new(f64::from(lens.xmag), f64::from(lens.ymag)).abs();
    (size.is_finite() && size.min_element() > 0.0).then_some(SceneLens::Orthographic { size })
}

/// The pose without scale: it looks along the node's -z, and its up is as close to the node's y as can be.
fn pose(world_from_node: &DMat4) -> Option<DAffine3> {
    let position: DVec3 = world_from_node.w_axis.truncate();
    let backward = world_from_node.z_axis.truncate().try_normalize()?;
    let right = world_from_node
        .y_axis
        .truncate()
        .cross(backward)
        .try_normalize()?;
    let rotation = DMat3::from_cols(right, backward.cross(right), backward);
    position
        .is_finite()
        .then_some(DAffine3::from_mat3_translation(rotation, position))
}
