//! The nodes of a document: where they stand in the world, which of them a scene shows, their cameras and their instances.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3, DVec4};
use gltf::json::Root;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::scene::Node;
use serde_json::Value;

use crate::input::files::excerpt;
use crate::input::gltf::accessor::{Integers, Numbers, Use};
use crate::input::gltf::document::{INSTANCES, list_of, position_of};
use crate::input::options::{Notes, SceneChoice};
use crate::scene::{SceneCamera, SceneLens};

// The node hierarchy: where every node stands in the world, and which nodes a scene shows.
//
// Takes the document, gives one transform per node and the nodes of the chosen scene. Transforms are composed in f64,
// from parents to children; a node with two parents and a cycle are errors, so no walk can go on for ever.
// Source: glTF 2.0, 3.5.

/// From the space of each node to the world, by those to their parents.
pub(crate) fn world_from_nodes(
    root: &Root,
    parent_from_nodes: &[DMat4],
) -> Result<Vec<DMat4>, String> {
    let parents = parents(root)?;
    let mut world: Vec<Option<DMat4>> = vec![None; root.nodes.len()];
    for start in 0..root.nodes.len() {
        // Up to the first node whose place is known, then down again.
        let mut chain = Vec::new();
        let mut next = Some(start);
        while let Some(node) = next.filter(|&node| world[node].is_none()) {
            if chain.len() > root.nodes.len() {
                return Err(format!(
                    "node {start} is below itself: the nodes form a cycle"
                ));
            }
            chain.push(node);
            next = parents[node];
        }
        let mut above = next.and_then(|node| world[node]).unwrap_or(DMat4::IDENTITY);
        for &node in chain.iter().rev() {
            above *= parent_from_nodes[node];
            world[node] = Some(above);
        }
    }
    Ok(world
        .into_iter()
        .map(|transform| transform.unwrap_or(DMat4::IDENTITY))
        .collect())
}

/// The nodes that a scene shows, in the order of the file: its own and all below them.
pub(crate) fn nodes_of_scene(
    root: &Root,
    choice: Option<&SceneChoice>,
) -> Result<Vec<usize>, String> {
    let mut todo: Vec<usize> = match chosen(root, choice)? {
        Some(scene) => root.scenes[scene]
            .nodes
            .iter()
            .rev()
            .map(gltf::json::Index::value)
            .collect(),
        // A file without scenes is a library of parts; all of them are shown.
        None => roots(root).into_iter().rev().collect(),
    };
    let mut seen = vec![false; root.nodes.len()];
    let mut shown = Vec::new();
    while let Some(node) = todo.pop() {
        let seen = seen
            .get_mut(node)
            .ok_or_else(|| format!("node {node} does not exist"))?;
        if !std::mem::replace(seen, true) {
            shown.push(node);
            todo.extend(children(&root.nodes[node]).rev());
        }
    }
    Ok(shown)
}

fn chosen(root: &Root, choice: Option<&SceneChoice>) -> Result<Option<usize>, String> {
    let names: Vec<_> = root
        .scenes
        .iter()
        .map(|scene| scene.name.as_deref())
        .collect();
    let (index, asked) = match choice {
        None => match (root.scene, names.len()) {
            (Some(scene), _) => (Some(scene.value()), "the default scene".to_owned()),
            (None, 0) => return Ok(None),
            (None, _) => (Some(0), "the first scene".to_owned()),
        },
        Some(SceneChoice(word)) => (
            position_of(&names, word),
            format!("scene '{}'", excerpt(word)),
        ),
    };
    if index.is_some_and(|index| index < names.len()) {
        return Ok(index);
    }
    let there = match names.len() {
        0 => "no scenes".to_owned(),
        _ => list_of(&names),
    };
    Err(format!("{asked} does not exist: the file has {there}"))
}

fn roots(root: &Root) -> Vec<usize> {
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(children) {
        if let Some(flag) = is_child.get_mut(child) {
            *flag = true;
        }
    }
    (0..root.nodes.len())
        .filter(|&node| !is_child[node])
        .collect()
}

fn parents(root: &Root) -> Result<Vec<Option<usize>>, String> {
    let mut parents = vec![None; root.nodes.len()];
    for (parent, node) in root.nodes.iter().enumerate() {
        for child in children(node) {
            let slot = parents
                .get_mut(child)
                .ok_or_else(|| format!("node {parent}: child {child} does not exist"))?;
            if let Some(other) = slot.replace(parent) {
                return Err(format!(
                    "node {child} is a child of both node {other} and node {parent}"
                ));
            }
        }
    }
    Ok(parents)
}

fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(gltf::json::Index::value)
}

// Cameras of a glTF file.
//
// Takes the nodes that a scene shows, gives their cameras in the world. A node's scale does not reach its camera, as
// glTF demands. A camera that cannot be used is left out, with a note, because the picture may not need it.
// Source: glTF 2.0, 3.10. Limits: near and far planes are left to the renderer.

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

// Instances of a node's mesh (EXT_mesh_gpu_instancing): a translation, a rotation and a scale for each.
//
// Takes a node, gives the transforms from each instance's space to the node's; one, the identity, without the extension.
// Limits: further attributes of instances, such as colours, are left out.

const FLOATS: &[ComponentType] = &[ComponentType::F32];

const TRANSLATION: Use = Use {
    name: "TRANSLATION",
    shapes: &[Type::Vec3],
    components: FLOATS,
    integers: Integers::AsMarked,
};

const SCALE: Use = Use {
    name: "SCALE",
    ..TRANSLATION
};

const ROTATION: Use = Use {
    name: "ROTATION",
    shapes: &[Type::Vec4],
    components: &[ComponentType::F32, ComponentType::I8, ComponentType::I16],
    integers: Integers::Fractions,
};

/// The transforms of the instances of a node's mesh.
pub(super) fn instances(node: &Node, numbers: &Numbers) -> Result<Vec<DMat4>, String> {
    let extension = node
        .extensions
        .as_ref()
        .and_then(|e| e.others.get(INSTANCES));
    let Some(attributes) = extension.and_then(|value| value.get("attributes")) else {
        return Ok(vec![DMat4::IDENTITY]);
    };
    let translations = vectors::<3>(attributes, numbers, &TRANSLATION)?;
    let rotations = vectors::<4>(attributes, numbers, &ROTATION)?;
    let scales = vectors::<3>(attributes, numbers, &SCALE)?;
    let counts = [
        translations.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
    ];
    let mut counts = counts.into_iter().flatten();
    let count = counts.next().unwrap_or(1);
    if counts.any(|other| other != count) {
        return Err(format!("{INSTANCES}: its attributes have different counts"));
    }
    let vector = |list: &Option<Vec<[f32; 3]>>, at: usize, default: f64| {
        list.as_ref().map_or(DVec3::splat(default), |list| {
            DVec3::from_array(list[at].map(f64::from))
        })
    };
    let instance = |at: usize| {
        let rotation = rotations
            .as_ref()
            .map_or(DVec4::W, |list| DVec4::from_array(list[at].map(f64::from)));
        let rotation = rotation.try_normalize().unwrap_or(DVec4::W);
        DMat4::from_scale_rotation_translation(
            vector(&scales, at, 1.0),
            DQuat::from_vec4(rotation),
            vector(&translations, at, 0.0),
        )
    };
    Ok((0..count).map(instance).collect())
}

/// The numbers of an attribute, if there is one.
fn vectors<const N: usize>(
    attributes: &Value,
    numbers: &Numbers,
    how: &Use,
) -> Result<Option<Vec<[f32; N]>>, String> {
    let Some(index) = attributes.get(how.name) else {
        return Ok(None);
    };
    let index = index.as_u64().and_then(|index| usize::try_from(index).ok());
    let index = index.ok_or_else(|| format!("{INSTANCES}: {} is no accessor", how.name))?;
    numbers.vectors(index, how).map(Some)
}
