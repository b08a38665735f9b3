//! glTF 2.0: .gltf with buffers beside it or inside, and .glb.
//!
//! Takes the bytes of a file, gives a scene. The container is opened (`container.rs`), nodes are placed (`nodes.rs`), and
//! each mesh of the chosen scene is read (`primitive.rs`, `deform.rs`) with its material (`material.rs`); every number
//! comes through `accessor.rs`, which checks it.
//! Source: the glTF 2.0 specification of the Khronos Group. Limits: skins and morph targets stand still, points and
//! lines are left out, and of materials only colour, alpha and emitted light are read.

mod accessor;
mod attribute;
mod camera;
mod container;
mod deform;
mod material;
mod nodes;
mod primitive;

use std::path::Path;

use glam::DMat4;
use gltf::json::Root;

use super::choice::LoadOptions;
use super::files::excerpt;
use super::notes::Notes;
use crate::scene::{Mesh, Scene};
use accessor::Numbers;
use deform::Place;
use material::Materials;

/// Whether a file starts as a binary glTF does.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    container::is_binary(bytes)
}

/// Reads a document; names in it are relative to `folder`.
pub(super) fn load(
    bytes: &[u8],
    folder: &Path,
    options: &LoadOptions,
    notes: &mut Notes,
) -> Result<Scene, String> {
    let document = container::open(bytes, folder)?;
    let root = &document.root;
    tell_what_is_left_out(root, notes);
    let numbers = Numbers::new(root, &document.buffers);
    let world_from_nodes = nodes::world_from_nodes(root)?;
    let shown = nodes::shown(root, options.scene.as_ref())?;
    let mut materials = Materials::new(root, &numbers, folder);
    let mut meshes = Vec::new();
    for &node in &shown {
        let Some(index) = root.nodes[node].mesh else {
            continue;
        };
        let read = Reading {
            root,
            numbers: &numbers,
            world_from_nodes: &world_from_nodes,
            node,
        };
        read.mesh(index.value(), &mut materials, &mut meshes, notes)?;
    }
    let cameras = camera::cameras(root, &shown, &world_from_nodes, notes);
    let Materials {
        materials,
        textures,
        ..
    } = materials;
    Ok(Scene {
        meshes,
        materials,
        textures: textures.into_textures(),
        cameras,
    })
}

/// What is needed to read the mesh of a node.
struct Reading<'a> {
    root: &'a Root,
    numbers: &'a Numbers<'a>,
    world_from_nodes: &'a [DMat4],
    node: usize,
}

impl Reading<'_> {
    fn mesh(
        &self,
        index: usize,
        materials: &mut Materials,
        meshes: &mut Vec<Mesh>,
        notes: &mut Notes,
    ) -> Result<(), String> {
        let (root, node) = (self.root, self.node);
        let json = root
            .meshes
            .get(index)
            .ok_or_else(|| format!("node {node}: mesh {index} does not exist"))?;
        let name = json.name.clone().or_else(|| root.nodes[node].name.clone());
        let name = name.unwrap_or_else(|| format!("mesh {index}"));
        let weights = root.nodes[node]
            .weights
            .as_deref()
            .or(json.weights.as_deref())
            .unwrap_or_default();
        let place = self.place()?;
        for (number, primitive) in json.primitives.iter().enumerate() {
            let located =
                |what: String| format!("mesh '{}', primitive {number}: {what}", excerpt(&name));
            let Some(mut mesh) = primitive::mesh(primitive, self.numbers, &place, weights, notes)
                .map_err(located)?
            else {
                continue;
            };
            let material = primitive.material.map(|material| material.value());
            mesh.material = materials.place(material, notes).map_err(located)?;
            mesh.name.clone_from(&name);
            meshes.push(mesh);
        }
        Ok(())
    }

    /// A skinned mesh goes with its joints and not with its node.
    fn place(&self) -> Result<Place, String> {
        let Some(skin) = self.root.nodes[self.node].skin else {
            return Ok(Place::Node(self.world_from_nodes[self.node]));
        };
        let index = skin.value();
        let skin = self
            .root
            .skins
            .get(index)
            .ok_or_else(|| format!("skin {index} does not exist"))?;
        let binds = match skin.inverse_bind_matrices {
            Some(accessor) => self
                .numbers
                .vectors::<16>(accessor.value(), &deform::BIND)?,
            None => Vec::new(),
        };
        if !binds.is_empty() && binds.len() < skin.joints.len() {
            return Err(format!(
                "skin {index}: {} joints, but {} matrices",
                skin.joints.len(),
                binds.len()
            ));
        }
        let joint = |(place, joint): (usize, &gltf::json::Index<gltf::json::Node>)| {
            let node = joint.value();
            let world = self.world_from_nodes.get(node);
            let world =
                world.ok_or_else(|| format!("skin {index}: joint {node} does not exist"))?;
            let bind = binds.get(place).map_or(DMat4::IDENTITY, |m| {
                DMat4::from_cols_array(&m.map(f64::from))
            });
            Ok(*world * bind)
        };
        Ok(Place::Skin(
            skin.joints
                .iter()
                .enumerate()
                .map(joint)
                .collect::<Result<_, String>>()?,
        ))
    }
}

fn tell_what_is_left_out(root: &Root, notes: &mut Notes) {
    for name in container::read_over(root) {
        notes.say(format!(
            "{name} is not modelled: light on surfaces differs, colour and shape do not"
        ));
    }
    if !root.animations.is_empty() {
        notes.say(
            "animations are not played: the scene stands still in the pose of the file".to_owned(),
        );
    }
}

#[cfg(test)]
mod tests;
