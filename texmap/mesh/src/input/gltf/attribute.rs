//! The attributes of a primitive: what numbers each may have, and where it finds them.

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{Integers, Use};

const NUMBERS: &[ComponentType] = &[
    ComponentType::F32,
    ComponentType::I8,
    ComponentType::U8,
    ComponentType::I16,
    ComponentType::U16,
];

/// Positions, plain or quantised (KHR_mesh_quantization).
pub(super) const POSITION: Use = Use {
    name: "POSITION",
    shapes: &[Type::Vec3],
    components: NUMBERS,
    integers: Integers::AsMarked,
};

/// Normals, plain or quantised.
pub(super) const NORMAL: Use = Use {
    name: "NORMAL",
    shapes: &[Type::Vec3],
    components: NUMBERS,
    integers: Integers::Fractions,
};

/// Tangents and the sign of their bitangents.
pub(super) const TANGENT: Use = Use {
    name: "TANGENT",
    shapes: &[Type::Vec4],
    components: NUMBERS,
    integers: Integers::Fractions,
};

/// Texture coordinates.
pub(super) const TEXCOORD: Use = Use {
    name: "TEXCOORD",
    shapes: &[Type::Vec2],
    components: NUMBERS,
    integers: Integers::AsMarked,
};

/// Colours of vertices.
pub(super) const COLOUR: Use = Use {
    name: "COLOR",
    shapes: &[Type::Vec3, Type::Vec4],
    components: &[ComponentType::F32, ComponentType::U8, ComponentType::U16],
    integers: Integers::Fractions,
};

/// Corners of triangles.
pub(super) const INDICES: Use = Use {
    name: "indices",
    shapes: &[Type::Scalar],
    components: &[ComponentType::U8, ComponentType::U16, ComponentType::U32],
    integers: Integers::AsMarked,
};

/// The accessor of an attribute.
pub(super) fn attribute(primitive: &Primitive, semantic: &Semantic) -> Option<usize> {
    primitive
        .attributes
        .get(&key(semantic))
        .map(gltf::json::Index::value)
}

/// Checks that an attribute has one element per position, or none at all.
pub(super) fn same_count(name: &str, count: usize, positions: usize) -> Result<(), String> {
    if count != 0 && count != positions {
        return Err(format!(
            "{name} has {count} elements, POSITION has {positions}"
        ));
    }
    Ok(())
}

/// The key of an attribute in a primitive.
pub(super) fn key(semantic: &Semantic) -> Checked<Semantic> {
    Checked::Valid(semantic.clone())
}
