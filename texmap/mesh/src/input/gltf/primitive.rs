//! Primitives: attributes and indices to triangles of one material.
//!
//! Takes a primitive of the document and its place, gives a [`Mesh`] in the world, or nothing where it is made of points
//! or lines. Strips and fans become lists; triangles of mirrored nodes turn round, so that their front stays in front.
//! Source: glTF 2.0, 3.7.2.

use glam::DVec3;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::super::notes::Notes;
use super::accessor::Numbers;
use super::attribute::{COLOUR, INDICES, TEXCOORD, attribute, same_count};
use crate::input::gltf::pose::deform;
use crate::input::gltf::pose::deform::{MeshTransform, WorldVertices};
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
    } = deform::deformed(primitive, numbers, place, weights)?;
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
