//! Primitives: attributes and indices to triangles of one material.
//!
//! Takes a primitive of the document and its place, gives a [`Mesh`] in the world, or nothing where it is made of points
//! or lines. Strips and fans become lists; triangles of mirrored nodes turn round, so that their front stays in front.
//! Source: glTF 2.0, 3.7.2.

use glam::{DMat3, DMat4, DVec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use resample_core::narrow;

use crate::input::gltf::accessor::{
    COLOUR, INDICES, Integers, NORMAL, Numbers, POSITION, TANGENT, TEXCOORD, Use, attribute,
    same_count,
};
use crate::input::options::Notes;
use crate::scene::Mesh;

/// Most sets of texture coordinates that are kept. Files have one or two; materials use two at most.
const MAX_UV_SETS: u32 = 8;

/// The mesh of a primitive, and its positions in the world. Name and material are left to the caller.
pub(super) fn mesh(
    primitive: &Primitive,
    numbers: &Numbers,
    place: &MeshTransform,
    weights: &[f32],
    notes: &mut Notes,
) -> Result<Option<(Mesh, Vec<DVec3>)>, String> {
    let Checked::Valid(mode) = primitive.mode else {
        return Err("unknown primitive mode".into());
    };
    if !matches!(
        mode,
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
    ) {
        notes.say("points and lines are left out: only triangles are drawn".to_owned());
        return Ok(None);
    }
    let WorldVertices {
        positions,
        normals,
        tangents,
        mirrored,
    } = deformed(primitive, numbers, place, weights)?;
    let count = positions.len();
    let corners = corners(primitive, numbers, count)?;
    let triangles = triangles(mode, &corners, &mirrored);
    let colours = match attribute(primitive, &Semantic::Colors(0)) {
        Some(index) => numbers.vectors::<4>(index, &COLOUR)?,
        None => Vec::new(),
    };
    same_count("COLOR_0", colours.len(), count)?;
    let normals = unit_normals(&normals, notes);
    let uvs = uv_sets(primitive, numbers, count)?;
    let mesh = Mesh {
        normals,
        uvs,
        colours,
        triangles,
        tangents: if is_finite(&tangents) {
            tangents
        } else {
            Vec::new()
        },
        ..Mesh::default()
    };
    Ok(Some((mesh, positions)))
}

/// Tangents that are no numbers are made anew.
fn is_finite(tangents: &[[f32; 4]]) -> bool {
    tangents.iter().flatten().all(|number| number.is_finite())
}

/// The corners in the order of the file.
fn corners(primitive: &Primitive, numbers: &Numbers, count: usize) -> Result<Vec<u32>, String> {
    let Some(indices) = primitive.indices else {
        return Ok((0..u32::try_from(count)
            .map_err(|_| format!("{count} vertices are too many"))?)
            .collect());
    };
    let corners: Vec<u32> = numbers
        .integers::<1>(indices.value(), &INDICES)?
        .into_iter()
        .flatten()
        .collect();
    match corners.iter().find(|&&corner| corner as usize >= count) {
        Some(corner) => Err(format!(
            "index {corner} is out of range: there are {count} vertices"
        )),
        None => Ok(corners),
    }
}

/// Triangles of a list, strip or fan; those with a corner twice have no area and are left out.
fn triangles(mode: Mode, corners: &[u32], mirrored: &[bool]) -> Vec<[u32; 3]> {
    let last = corners.len().saturating_sub(2);
    let all: Vec<[u32; 3]> = match mode {
        Mode::TriangleStrip => {
            let at = |i: usize| [corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]];
            (0..last).map(at).collect()
        }
        Mode::TriangleFan => (0..last)
            .map(|i| [corners[i + 1], corners[i + 2], corners[0]])
            .collect(),
        _ => corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
    };
    let turned = |[a, b, c]: [u32; 3]| {
        if mirrored[a as usize] {
            [a, c, b]
        } else {
            [a, b, c]
        }
    };
    all.into_iter()
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .map(turned)
        .collect()
}

fn uv_sets(
    primitive: &Primitive,
    numbers: &Numbers,
    count: usize,
) -> Result<Vec<Vec<[f32; 2]>>, String> {
    let mut sets: Vec<Vec<[f32; 2]>> = Vec::new();
    for set in 0..MAX_UV_SETS {
        let Some(index) = attribute(primitive, &Semantic::TexCoords(set)) else {
            continue;
        };
        let uvs = numbers.vectors::<2>(index, &TEXCOORD)?;
        same_count("TEXCOORD", uvs.len(), count)?;
        // A gap in the numbers is filled, so that a set keeps its number.
        sets.resize(set as usize, vec![[0.0; 2]; count]);
        sets.push(uvs);
    }
    Ok(sets)
}

/// Normals of length 1, or none at all if one of them has no direction: the surface is then flat.
fn unit_normals(normals: &[DVec3], notes: &mut Notes) -> Vec<[f32; 3]> {
    let unit: Option<Vec<_>> = normals
        .iter()
        .map(|n| Some(n.try_normalize()?.as_vec3().to_array()))
        .collect();
    unit.unwrap_or_else(|| {
        notes.say("some normals have no direction: those meshes are shaded flat".to_owned());
        Vec::new()
    })
}

// Vertices into the world: morph targets by their weights, skins by their joints, else the node.
//
// Takes local positions and normals, gives world ones. Everything is composed in f64; normals go by the cofactors of
// the matrix, which need no inverse and keep their side when the matrix mirrors.
// Source: glTF 2.0, 3.7.2.2 and 3.7.3.

/// How a mesh gets into the world.
pub(crate) enum MeshTransform {
    /// By its node.
    Node(DMat4),
    /// By joints: from the mesh's space to the world, one per joint of the skin.
    Skin(Vec<DMat4>),
}

impl MeshTransform {
    /// The mean scale from the mesh to the world; of a skin, that of its first joint.
    pub(super) fn scale(&self) -> f32 {
        let matrix = match self {
            Self::Node(matrix) => *matrix,
            Self::Skin(joints) => joints.first().copied().unwrap_or(DMat4::IDENTITY),
        };
        narrow::single(DMat3::from_mat4(matrix).determinant().abs().cbrt())
    }
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
fn deformed(
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
