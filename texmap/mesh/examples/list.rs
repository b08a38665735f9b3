//! Lists the meshes, materials and textures of a file: `cargo run -p resample-mesh --example list -- model.glb`.

use std::path::Path;

use resample_mesh::{LoadOptions, load};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected a mesh file")?;
    let loaded = load(Path::new(&path), &LoadOptions::default())?;
    let scene = &loaded.scene;
    for mesh in &scene.meshes {
        let material = &scene.materials[mesh.material];
        println!(
            "mesh '{}': {} triangles, material '{}'",
            mesh.name,
            mesh.triangles.len(),
            material.name
        );
    }
    for texture in &scene.textures {
        println!("texture of {}x{} pixels", texture.width, texture.height);
    }
    for note in &loaded.notes {
        println!("note: {note}");
    }
    Ok(())
}
