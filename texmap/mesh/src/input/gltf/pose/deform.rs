//! Vertices into the world: morph targets by their weights, skins by their joints, else the node.
//!
//! Takes local positions and normals, gives world ones. Everything is composed in f64; normals go by the cofactors of
//! the matrix, which need no inverse and keep their side when the matrix mirrors.
//! Source: glTF 2.0, 3.7.2.2 and 3.7.3.

use glam::{DMat3, DMat4, DVec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};

use crate::input::gltf::accessor::{Integers, Numbers, Use};
use crate::input::gltf::attribute::{NORMAL, POSITION, TANGENT, attribute, same_count};

/// How a mesh gets into the world.
pub(crate) enum MeshTransform {
    /// By its node.
    Node(DMat4),
    /// By joints: from the mesh's space to the world, one per joint of the skin.
    Skin(Vec<DMat4>),
}

/// Positions, normals and how their triangles wind, in the world.
pub(crate) struct WorldVertices {
    pub positions: Vec<DVec3>,
    /// One per position, of any length; empty where the file has none.
    pub normals: Vec<DVec3>,
    /// One per position; empty where the file has none.
    pub tangents: Vec<[f32; 4]>,
    /// True where the space around a position is mirrored, so that its triangles turn round.
    pub mirrored: Vec<bool>,
}

const JOINTS: Use = Use {
    name: "JOINTS",
    shapes: &[Type::Vec4],
    components: &[ComponentType::U8, ComponentType::U16],
    integers: Integers::AsMarked,
};

const WEIGHTS: Use = Use {
    name: "WEIGHTS",
    shapes: &[Type::Vec4],
    components: &[ComponentType::F32, ComponentType::U8, ComponentType::U16],
    integers: Integers::Fractions,
};

/// Inverse bind matrices.
pub(crate) const BIND: Use = Use {
    name: "inverseBindMatrices",
    shapes: &[Type::Mat4],
    components: &[ComponentType::F32],
    integers: Integers::AsMarked,
};

/// Places the vertices of a primitive; `weights` are those of its morph targets.
pub(crate) fn deformed(
    primitive: &Primitive,
    numbers: &Numbers,
    place: &MeshTransform,
    weights: &[f32],
) -> Result<WorldVertices, String> {
    let vectors = |index: usize, how: &Use| -> Result<Vec<DVec3>, String> {
        Ok(numbers
            .vectors::<3>(index, how)?
            .iter()
            .map(|v| DVec3::from_array(v.map(f64::from)))
            .collect())
    };
    let position = attribute(primitive, &Semantic::Positions).ok_or("it has no POSITION")?;
    let mut positions = vectors(position, &POSITION)?;
    let mut normals = match attribute(primitive, &Semantic::Normals) {
        Some(index) => vectors(index, &NORMAL)?,
        None => Vec::new(),
    };
    same_count("NORMAL", normals.len(), positions.len())?;
    let tangents = match attribute(primitive, &Semantic::Tangents) {
        Some(index) => numbers.vectors::<4>(index, &TANGENT)?,
        None => Vec::new(),
    };
    same_count("TANGENT", tangents.len(), positions.len())?;
    for (target, &weight) in primitive
        .targets
        .iter()
        .flatten()
        .zip(weights)
        .filter(|(_, weight)| **weight != 0.0)
    {
        for (index, how, vertices) in [
            (target.positions, &POSITION, &mut positions),
            (target.normals, &NORMAL, &mut normals),
        ] {
            let Some(index) = index.filter(|_| !vertices.is_empty()) else {
                continue;
            };
            let moved = vectors(index.value(), how)?;
            same_count("a morph target", moved.len(), vertices.len())?;
            vertices
                .iter_mut()
                .zip(moved)
                .for_each(|(vertex, by)| *vertex += f64::from(weight) * by);
        }
    }
    match place {
        MeshTransform::Node(matrix) => Ok(moved(positions, normals, &tangents, |_| *matrix)),
        MeshTransform::Skin(joints) => {
            let matrices = blended(primitive, numbers, joints, positions.len())?;
            Ok(moved(positions, normals, &tangents, |vertex| {
                matrices[vertex]
            }))
        }
    }
}

fn moved(
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    tangents: &[[f32; 4]],
    world_from_mesh: impl Fn(usize) -> DMat4,
) -> WorldVertices {
    let linear = |vertex: usize| DMat3::from_mat4(world_from_mesh(vertex));
    let mirrored = (0..positions.len())
        .map(|vertex| linear(vertex).determinant() < 0.0)
        .collect();
    let normal = |(vertex, normal): (usize, &DVec3)| {
        let linear = linear(vertex);
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
        cofactors * *normal * linear.determinant().signum()
    };
    let normals = normals.iter().enumerate().map(normal).collect();
    let tangent = |(vertex, &[x, y, z, sign]): (usize, &[f32; 4])| {
        let linear = linear(vertex);
        let along = (linear * DVec3::new(x.into(), y.into(), z.into())).normalize_or_zero();
        // A mirrored space turns normal x tangent round.
        let turn = linear.determinant().signum() as f32;
        along.as_vec3().extend(sign * turn).to_array()
    };
    let tangents = tangents.iter().enumerate().map(tangent).collect();
    let position = |(vertex, &pos): (usize, &DVec3)| world_from_mesh(vertex).transform_point3(pos);
    WorldVertices {
        positions: positions.iter().enumerate().map(position).collect(),
        normals,
        tangents,
        mirrored,
    }
}

/// The matrix of each vertex of a skin: the mean of its joints' by their weights.
fn blended(
    primitive: &Primitive,
    numbers: &Numbers,
    joints: &[DMat4],
    count: usize,
) -> Result<Vec<DMat4>, String> {
    let mut sums = vec![(DMat4::ZERO, 0.0); count];
    for set in 0.. {
        let pair = attribute(primitive, &Semantic::Joints(set))
            .zip(attribute(primitive, &Semantic::Weights(set)));
        let Some((joint, weight)) = pair else { break };
        let places = numbers.integers::<4>(joint, &JOINTS)?;
        let weights = numbers.vectors::<4>(weight, &WEIGHTS)?;
        same_count("JOINTS", places.len(), count)?;
        same_count("WEIGHTS", weights.len(), count)?;
        for ((sum, places), weights) in sums.iter_mut().zip(&places).zip(&weights) {
            for (&place, &weight) in places
                .iter()
                .zip(weights)
                .filter(|(_, weight)| **weight > 0.0)
            {
                let joint = joints
                    .get(place as usize)
                    .ok_or_else(|| format!("joint {place} does not exist"))?;
                sum.0 += *joint * f64::from(weight);
                sum.1 += f64::from(weight);
            }
        }
    }
    // A vertex without any weight goes with the first joint, as if it had been meant.
    let first = joints.first().copied().unwrap_or(DMat4::IDENTITY);
    Ok(sums
        .into_iter()
        .map(|(sum, weight)| {
            if weight > 0.0 {
                sum * (1.0 / weight)
            } else {
                first
            }
        })
        .collect())
}
