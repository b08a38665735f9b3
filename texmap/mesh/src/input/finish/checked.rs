//! The last check of a scene, the same for every format.
//!
//! Takes what a format reader gives and makes the promises of [`Scene`] true: numbers that are not finite are an error,
//! and a texture whose coordinates a mesh lacks is taken away from that mesh. Empty meshes go.

use std::collections::HashMap;

use glam::{DMat2, DVec2, DVec3};

use crate::input::files::excerpt;
use crate::input::notes::Notes;
use crate::scene::{Magnify, Material, Mesh, Scene, Texels, Texture, TextureUse, Wrap};

/// Largest world coordinate. Squares of distances then stay far from the end of single precision.
const MAX_COORDINATE: f64 = 1e15;

/// Largest texture coordinate: beyond 2^24 neighbouring numbers of a file are whole textures apart.
const MAX_UV: f32 = 16_777_216.0;

/// Checks a scene.
pub(crate) fn scene(mut scene: Scene, notes: &mut Notes) -> Result<Scene, String> {
    scene.meshes.retain(|mesh| !mesh.triangles.is_empty());
    if scene.meshes.is_empty() {
        return Err("holds no triangles: there is nothing to draw".into());
    }
    for mesh in &scene.meshes {
        check_numbers(mesh, scene.origin_in_world)
            .map_err(|what| format!("mesh '{}': {what}", excerpt(&mesh.name)))?;
    }
    drop_unusable_textures(&mut scene, notes);
    Ok(scene)
}

/// Gives a picture to every material without one, as far as its meshes have texture coordinates.
pub(crate) fn bind_texture(scene: &mut Scene, texture: Texture) -> Result<(), String> {
    let has_uvs = |mesh: &Mesh| !mesh.uvs.is_empty() && !mesh.triangles.is_empty();
    if !scene.meshes.iter().any(has_uvs) {
        return Err("no mesh has texture coordinates, so that no texture can be laid on it".into());
    }
    let wants =
        |mesh: &Mesh| has_uvs(mesh) && scene.materials[mesh.material].base_texture.is_none();
    if !scene.meshes.iter().any(wants) {
        return Err("every mesh that can have a texture has one already: leave it out".into());
    }
    scene.textures.push(texture);
    let bound = TextureUse {
        texture: scene.textures.len() - 1,
        uv_set: 0,
        uv_linear: DMat2::IDENTITY,
        uv_offset: DVec2::ZERO,
        wrap: [Wrap::Repeat; 2],
        magnify: Magnify::Linear,
    };
    for material in scene
        .materials
        .iter_mut()
        .filter(|material| material.base_texture.is_none())
    {
        material.base_texture = Some(bound);
    }
    Ok(())
}

fn check_numbers(mesh: &Mesh, origin: DVec3) -> Result<(), String> {
    let in_world = |pos: &[f32; 3]| origin + DVec3::from(pos.map(f64::from));
    let far = mesh.positions.iter().position(|pos| {
        !in_world(pos)
            .to_array()
            .iter()
            .all(|x| x.abs() <= MAX_COORDINATE)
    });
    if let Some(at) = far {
        let pos = in_world(&mesh.positions[at]).to_array();
        return Err(format!(
            "vertex {at} lies at {pos:?} in the world: expected finite numbers up to {MAX_COORDINATE:e}"
        ));
    }
    let uvs = mesh.uvs.iter().flatten();
    if let Some(uv) = uvs.clone().find(|uv| !uv.iter().all(|x| x.abs() <= MAX_UV)) {
        return Err(format!(
            "a texture coordinate is {uv:?}: expected finite numbers up to {MAX_UV}"
        ));
    }
    if !mesh
        .normals
        .iter()
        .flatten()
        .all(|number| number.is_finite())
    {
        return Err("a normal is not finite".into());
    }
    if !mesh
        .colours
        .iter()
        .flatten()
        .all(|number| number.is_finite())
    {
        return Err("a vertex colour is not finite".into());
    }
    Ok(())
}

/// Where a mesh lacks the coordinates that its material's texture wants, it gets a material without that texture.
fn drop_unusable_textures(scene: &mut Scene, notes: &mut Notes) {
    let mut without: HashMap<(usize, [bool; 5]), usize> = HashMap::new();
    for mesh in &mut scene.meshes {
        let material = &scene.materials[mesh.material];
        let lacks = |texture: &Option<TextureUse>| {
            texture.is_some_and(|used| used.uv_set >= mesh.uvs.len())
        };
        let physical = material.physical.unwrap_or_default();
        let lacking = [
            lacks(&material.base_texture),
            lacks(&material.emissive_texture),
            lacks(&physical.metal_roughness_texture),
            lacks(&physical.normal_texture),
            lacks(&physical.occlusion_texture),
        ];
        if lacking == [false; 5] {
            continue;
        }
        notes.say(format!(
            "mesh '{}' has no coordinates for the texture of material '{}': it shows the plain colour",
            excerpt(&mesh.name),
            excerpt(&material.name)
        ));
        let place = *without.entry((mesh.material, lacking)).or_insert_with(|| {
            scene
                .materials
                .push(without_textures(&scene.materials[mesh.material], lacking));
            scene.materials.len() - 1
        });
        mesh.material = place;
    }
}

fn without_textures(material: &Material, lacking: [bool; 5]) -> Material {
    let [base, emissive, roughness, normal, occlusion] = lacking;
    let mut material = material.clone();
    material.base_texture = material.base_texture.filter(|_| !base);
    material.emissive_texture = material.emissive_texture.filter(|_| !emissive);
    if let Some(physical) = &mut material.physical {
        let texture = &mut physical.metal_roughness_texture;
        *texture = texture.filter(|_| !roughness);
        physical.normal_texture = physical.normal_texture.filter(|_| !normal);
        physical.occlusion_texture = physical.occlusion_texture.filter(|_| !occlusion);
    }
    material
}

/// Checks the indices of a scene that a program made: each points at something that is there.
///
/// Readers of files check theirs where they read them, and can name the place in the file.
pub(crate) fn indices(scene: &Scene) -> Result<(), String> {
    for mesh in &scene.meshes {
        mesh_indices(mesh, scene.materials.len()).map_err(|what| match mesh.name.as_str() {
            "" => what,
            name => format!("mesh '{name}': {what}"),
        })?;
    }
    let used = scene.materials.iter().flat_map(textures_of);
    if let Some(used) = used
        .flatten()
        .find(|used| used.texture >= scene.textures.len())
    {
        return Err(format!("there is no texture {}", used.texture));
    }
    for texture in &scene.textures {
        let count = match &texture.texels {
            Texels::Srgb8(texels) => texels.len(),
            Texels::LinearF32(texels) => texels.len(),
        };
        let expected = texture.width * texture.height;
        if count == 0 || count != expected {
            return Err(format!(
                "a texture of {}x{} texels holds {count}",
                texture.width, texture.height
            ));
        }
    }
    Ok(())
}

fn mesh_indices(mesh: &Mesh, materials: usize) -> Result<(), String> {
    let vertices = mesh.positions.len();
    let corners = mesh.triangles.iter().flatten();
    if let Some(corner) = corners.max().filter(|&&corner| corner as usize >= vertices) {
        return Err(format!(
            "a triangle has the corner {corner}, but there are {vertices} vertices"
        ));
    }
    if mesh.material >= materials {
        return Err(format!("there is no material {}", mesh.material));
    }
    let lists = [
        ("normals", mesh.normals.len()),
        ("colours", mesh.colours.len()),
        ("tangents", mesh.tangents.len()),
    ];
    let coordinates = mesh
        .uvs
        .iter()
        .map(|set| ("texture coordinates", set.len()));
    let mut given = lists
        .into_iter()
        .filter(|(_, count)| *count > 0)
        .chain(coordinates);
    match given.find(|(_, count)| *count != vertices) {
        None => Ok(()),
        Some((what, count)) => Err(format!(
            "there are {count} {what} for {vertices} vertices: expected one for each"
        )),
    }
}

fn textures_of(material: &Material) -> [Option<TextureUse>; 5] {
    let physical = material.physical.unwrap_or_default();
    [
        material.base_texture,
        material.emissive_texture,
        physical.metal_roughness_texture,
        physical.normal_texture,
        physical.occlusion_texture,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Scene {
        Scene {
            meshes: vec![Mesh {
                positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn indices_point_at_what_is_there() {
        assert_eq!(indices(&triangle()), Ok(()));
        let mut wrong = triangle();
        wrong.meshes[0].triangles[0][2] = 3;
        let what = indices(&wrong).expect_err("there is no vertex 3");
        assert!(what.contains("corner 3"), "{what}");
        let mut wrong = triangle();
        wrong.meshes[0].uvs = vec![vec![[0.0; 2]; 2]];
        let what = indices(&wrong).expect_err("one is missing");
        assert!(
            what.contains("2 texture coordinates for 3 vertices"),
            "{what}"
        );
        let mut wrong = triangle();
        wrong.meshes[0].material = 1;
        assert!(indices(&wrong).is_err());
    }
}
