//! Draws a mesh from triangles in memory to `triangles.ppm`.

use glam::DVec3;
use resample_core::image::srgb_from_linear;
use resample_core::{Camera, LookAt};
use texmap::scene::{Material, Mesh};
use texmap::{RenderOptions, Renderer, Scene};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A tetrahedron: counter-clockwise seen from outside, a colour for each corner.
    let positions = vec![[1., 1., 1.], [-1., -1., 1.], [-1., 1., -1.], [1., -1., -1.]];
    let colour = |p: &[f32; 3]| [0.5 + 0.5 * p[0], 0.5 + 0.5 * p[1], 0.5 + 0.5 * p[2], 1.0];
    let mesh = Mesh {
        colours: positions.iter().map(colour).collect(),
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        positions,
        ..Mesh::default()
    };
    let mut scene = Scene::default();
    scene.materials.push(Material::default());
    scene.meshes.push(mesh);

    let pose = LookAt {
        position: DVec3::new(1.0, 2.0, 5.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    let camera = Camera::perspective(&pose, 0.8, [400, 300])?;
    let mut renderer = Renderer::new(&scene, &RenderOptions::default())?;
    let image = renderer.render(&camera)?.image.over_background([0.05; 3]);

    let mut file = b"P6 400 300 255\n".to_vec();
    for pixel in &image.rgba {
        let code = |channel: f32| (255.0 * srgb_from_linear(channel) + 0.5) as u8;
        file.extend(pixel[..3].iter().map(|&channel| code(channel)));
    }
    Ok(std::fs::write("triangles.ppm", file)?)
}
