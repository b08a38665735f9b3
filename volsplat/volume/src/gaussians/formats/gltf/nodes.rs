//! The nodes that a scene shows, with their meshes and where they stand in the world.
//!
//! Source: glTF 2.0, 3.5. The default scene, else the first; a file without scenes is shown whole.

use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};

use super::document::{Node, Root};
use crate::input::{Fault, unsupported};

/// The extension with which a node shows its mesh in many places.
const INSTANCES: &str = "EXT_mesh_gpu_instancing";

/// A mesh at its place.
pub(super) struct Shown {
    pub(super) mesh: usize,
    pub(super) world_from_mesh: DAffine3,
}

/// The meshes that a file shows, in the order of its nodes.
pub(super) fn shown(root: &Root) -> Result<Vec<Shown>, Fault> {
    let mut todo: Vec<(usize, DAffine3)> = first_nodes(root)?
        .into_iter()
        .rev()
        .map(|node| (node, DAffine3::IDENTITY))
        .collect();
    let mut seen = vec![false; root.nodes.len()];
    let mut shown = Vec::new();
    while let Some((number, world_from_parent)) = todo.pop() {
        let Some(node) = root.nodes.get(number) else {
            return Err(Fault::Invalid(format!("node {number} does not exist")));
        };
        if std::mem::replace(&mut seen[number], true) {
            return Err(Fault::Invalid(format!(
                "node {number} has two parents, or is below itself"
            )));
        }
        if node.extensions.contains_key(INSTANCES) {
            return Err(unsupported(format!(
                "node {number} shows its mesh in many places ({INSTANCES}): write one node for each place"
            )));
        }
        let world_from_mesh = world_from_parent * parent_from_node(node);
        if let Some(mesh) = node.mesh {
            shown.push(Shown {
                mesh,
                world_from_mesh,
            });
        }
        let children = node.children.iter().rev();
        todo.extend(children.map(|child| (*child, world_from_mesh)));
    }
    Ok(shown)
}

fn first_nodes(root: &Root) -> Result<Vec<usize>, Fault> {
    let chosen = root
        .scene
        .or_else(|| (!root.scenes.is_empty()).then_some(0));
    if let Some(chosen) = chosen {
        let none = || Fault::Invalid(format!("scene {chosen} does not exist"));
        return Ok(root.scenes.get(chosen).ok_or_else(none)?.nodes.clone());
    }
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|node| &node.children) {
        if let Some(is_child) = is_child.get_mut(*child) {
            *is_child = true;
        }
    }
    let nodes = (0..root.nodes.len()).filter(|node| !is_child[*node]);
    Ok(nodes.collect())
}

fn parent_from_node(node: &Node) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
    }
    // Quaternions in files are unit only to their digits.
    let rotation = node.rotation.map_or(DVec4::W, DVec4::from_array);
    let rotation = rotation.try_normalize().unwrap_or(DVec4::W);
    DAffine3::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, DVec3::from_array),
        DQuat::from_vec4(rotation),
        node.translation.map_or(DVec3::ZERO, DVec3::from_array),
    )
}
