//! The indices of a scene that a program made: each points at something that is there.
//!
//! Readers of files check theirs where they read them, and can name the place in the file.

use crate::scene::{Material, Mesh, Scene, Texels, TextureUse};

/// Checks a scene.
pub(crate) fn check(scene: &Scene) -> Result<(), String> {
    for mesh in &scene.meshes {
        of_mesh(mesh, scene.materials.len()).map_err(|what| match mesh.name.as_str() {
            "" => what,
            name => format!("mesh '{name}': {what}"),
        })?;
    }
    let used = scene.materials.iter().flat_map(textures);
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

fn of_mesh(mesh: &Mesh, materials: usize) -> Result<(), String> {
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

fn textures(material: &Material) -> [Option<TextureUse>; 5] {
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
        assert_eq!(check(&triangle()), Ok(()));
        let mut wrong = triangle();
        wrong.meshes[0].triangles[0][2] = 3;
        let what = check(&wrong).expect_err("there is no vertex 3");
        assert!(what.contains("corner 3"), "{what}");
        let mut wrong = triangle();
        wrong.meshes[0].uvs = vec![vec![[0.0; 2]; 2]];
        let what = check(&wrong).expect_err("one is missing");
        assert!(
            what.contains("2 texture coordinates for 3 vertices"),
            "{what}"
        );
        let mut wrong = triangle();
        wrong.meshes[0].material = 1;
        assert!(check(&wrong).is_err());
    }
}
