//! glTF 2.0: .gltf with buffers beside it or inside, and .glb.
//!
//! Takes the bytes of a file, gives a scene. The container is opened (`document`) and its geometry unpacked
//! (`compressed`), nodes are placed (`nodes`), at a moment of an
//! animation (`animation`), and each mesh of the chosen scene is read (`primitive`) with its material (`material`) and its pictures (`images`); every number
//! comes through `accessor`, which checks it.
//! Source: the glTF 2.0 specification of the Khronos Group. Limits: points and lines are left out, and of materials refraction, iridescence and anisotropy.

mod accessor;
mod compressed;
mod document;
mod animation;
mod nodes;
mod layers;
mod material;
mod images;
mod primitive;

use glam::{DMat4, DVec3};
use gltf::json::Root;
use resample_io::Gate;
use serde_json::Value;

use crate::input::files::{Names, excerpt};
use crate::input::finish;
use crate::input::options::{LoadOptions, Notes};
use crate::scene::{Mesh, Scene};
use accessor::Numbers;
use animation::NodePoses;
use document::Transform;
use material::Materials;
use primitive::MeshTransform;

/// Returns true if a file starts as a binary glTF does.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    document::is_binary(bytes)
}

/// The content of a mesh file beside the drawn scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// Names of the scenes; empty where one has none.
    pub scenes: Vec<String>,
    /// The animations.
    pub animations: Vec<Animation>,
}

/// An animation.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// Its name, where it has one.
    pub name: Option<String>,
    /// Time of its last key, s.
    pub length_s: f64,
}

/// Reads what a document has; names in it count from `names`.
pub(crate) fn contents(bytes: &[u8], names: &Names) -> Result<Contents, String> {
    let document = document::open(bytes, names)?;
    let numbers = Numbers::new(&document.root, &document.buffers);
    let of = |animation: &Value| Animation {
        name: animation
            .get("name")
            .and_then(Value::as_str)
            .map(str::to_owned),
        length_s: animation::length_s(animation, &numbers),
    };
    let scenes = document.root.scenes.iter();
    Ok(Contents {
        scenes: scenes
            .map(|scene| scene.name.clone().unwrap_or_default())
            .collect(),
        animations: document.animations.iter().map(of).collect(),
    })
}

/// Reads a document; names in it count from `names`.
pub(super) fn load(
    bytes: &[u8],
    names: &Names,
    options: &LoadOptions,
    notes: &mut Notes,
) -> Result<Scene, String> {
    let document = document::open(bytes, names)?;
    let root = &document.root;
    document::tell(root, notes);
    let numbers = Numbers::new(root, &document.buffers);
    let mut posed = NodePoses::new(&document.transforms);
    match &options.pose {
        Some(pose) => animation::pose(&document.animations, pose, &numbers, &mut posed, notes)?,
        None if document.animations.is_empty() => {}
        None => notes
            .say("animations are not played: the scene stands in the pose of the file".to_owned()),
    }
    let parent_from_nodes: Vec<DMat4> = posed
        .transforms
        .iter()
        .map(Transform::parent_from_node)
        .collect();
    let world_from_nodes = nodes::world_from_nodes(root, &parent_from_nodes)?;
    let shown = nodes::nodes_of_scene(root, options.scene.as_ref())?;
    let mut materials = Materials::new(root, &numbers, names, options.light_maps);
    let meshes_shown = shown.iter().filter_map(|&node| root.nodes[node].mesh);
    materials.decode_ahead(meshes_shown.filter_map(|mesh| root.meshes.get(mesh.value())));
    let held = bytes.len() + document.buffers.iter().map(Vec::len).sum::<usize>();
    let mut meshes = Meshes::new(names.gate, held as u64);
    for &node in &shown {
        let Some(index) = root.nodes[node].mesh else {
            continue;
        };
        let read = Reading {
            root,
            numbers: &numbers,
            world_from_nodes: &world_from_nodes,
            weights: posed.weights.get(&node).map(Vec::as_slice),
            node,
        };
        let instances = nodes::instances(&root.nodes[node], &numbers)
            .map_err(|what| format!("node {node}: {what}"))?;
        for instance in &instances {
            let place = read.mesh_transform(instance)?;
            read.mesh((index.value(), &place), &mut materials, &mut meshes, notes)?;
        }
    }
    let cameras = nodes::cameras(root, &shown, &world_from_nodes, notes);
    let Materials {
        materials,
        textures,
        ..
    } = materials;
    let mut scene = Scene {
        meshes: meshes.list,
        materials,
        textures: textures.into_textures(),
        cameras,
        ..Scene::default()
    };
    finish::set_origin(&mut scene, &meshes.positions);
    Ok(scene)
}

/// Meshes, and their positions in the world, which are laid into them at last.
struct Meshes<'a> {
    gate: &'a Gate,
    /// Bytes of the file and its buffers.
    held: u64,
    list: Vec<Mesh>,
    positions: Vec<Vec<DVec3>>,
    vertices: u64,
}

impl<'a> Meshes<'a> {
    fn new(gate: &'a Gate, held: u64) -> Self {
        Self {
            gate,
            held,
            list: Vec::new(),
            positions: Vec::new(),
            vertices: 0,
        }
    }

    /// Adds a mesh; a few bytes can ask for many vertices, by instances or because they are all zero.
    fn push(&mut self, mesh: Mesh, positions: Vec<DVec3>) -> Result<(), String> {
        // A position in f64 and in f32, a normal, texture coordinates and a colour; a triangle for every vertex.
        const VERTEX_BYTES: u64 = 24 + 12 + 12 + 8 + 16 + 12;
        self.vertices += positions.len() as u64;
        self.list.push(mesh);
        self.positions.push(positions);
        let bytes = self.vertices.saturating_mul(VERTEX_BYTES);
        self.gate
            .ask_unpacked(bytes, self.held, "the vertices of all instances")
    }
}

/// The input for reading the mesh of a node.
struct Reading<'a> {
    root: &'a Root,
    numbers: &'a Numbers<'a>,
    world_from_nodes: &'a [DMat4],
    /// Weights of morph targets that an animation gives the node.
    weights: Option<&'a [f32]>,
    node: usize,
}

impl Reading<'_> {
    fn mesh(
        &self,
        (index, place): (usize, &MeshTransform),
        materials: &mut Materials,
        meshes: &mut Meshes,
        notes: &mut Notes,
    ) -> Result<(), String> {
        let (root, node) = (self.root, self.node);
        let json = root
            .meshes
            .get(index)
            .ok_or_else(|| format!("node {node}: mesh {index} does not exist"))?;
        let name = json.name.clone().or_else(|| root.nodes[node].name.clone());
        let name = name.unwrap_or_else(|| format!("mesh {index}"));
        let weights = self
            .weights
            .or(root.nodes[node].weights.as_deref())
            .or(json.weights.as_deref())
            .unwrap_or_default();
        for (number, primitive) in json.primitives.iter().enumerate() {
            let located =
                |what: String| format!("mesh '{}', primitive {number}: {what}", excerpt(&name));
            let Some((mut mesh, positions)) =
                primitive::mesh(primitive, self.numbers, place, weights, notes).map_err(located)?
            else {
                continue;
            };
            let material = primitive.material.map(|material| material.value());
            mesh.material = materials
                .place(material, place.scale(), notes)
                .map_err(located)?;
            mesh.name.clone_from(&name);
            meshes.push(mesh, positions)?;
        }
        Ok(())
    }

    /// A skinned mesh goes with its joints and not with its node.
    fn mesh_transform(&self, instance: &DMat4) -> Result<MeshTransform, String> {
        let Some(skin) = self.root.nodes[self.node].skin else {
            return Ok(MeshTransform::Node(
                self.world_from_nodes[self.node] * *instance,
            ));
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
                .vectors::<16>(accessor.value(), &primitive::BIND)?,
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
        Ok(MeshTransform::Skin(
            skin.joints
                .iter()
                .enumerate()
                .map(joint)
                .collect::<Result<_, String>>()?,
        ))
    }
}

#[cfg(test)]
mod tests;
