//! Instances of a node's mesh (EXT_mesh_gpu_instancing): a translation, a rotation and a scale for each.
//!
//! Takes a node, gives the transforms from each instance's space to the node's; one, the identity, without the extension.
//! Limits: further attributes of instances, such as colours, are left out.

use glam::{DMat4, DQuat, DVec3, DVec4};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::scene::Node;
use serde_json::Value;

use super::accessor::{Integers, Numbers, Use};

/// Its name.
pub(super) const NAME: &str = "EXT_mesh_gpu_instancing";

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
    let extension = node.extensions.as_ref().and_then(|e| e.others.get(NAME));
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
        return Err(format!("{NAME}: its attributes have different counts"));
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
    let index = index.ok_or_else(|| format!("{NAME}: {} is no accessor", how.name))?;
    numbers.vectors(index, how).map(Some)
}
