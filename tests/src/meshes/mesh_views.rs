//! Real meshes from viewpoints of our own, for comparison with brute force: unlit, opaque, seen from both sides.
//!
//! Gives scenes and cameras by name. Materials are reduced to what the brute-force reference knows: the base colour's
//! texture and factor. Where the data is absent a view gives `None`.

use glam::DVec3;
use resample_core::Camera;
use texmap::scene::{AlphaMode, Lighting, Sides};
use texmap::{LoadOptions, RenderOptions, Renderer, Scene};

use crate::data::data_file;
use crate::meshes::texture_scenes::looking_camera;

/// A mesh and where it is seen from.
#[derive(Clone, Copy, Debug)]
pub struct MeshView {
    /// For messages.
    pub name: &'static str,
    /// In the folder of meshes.
    file: &'static str,
    /// From the mesh's middle to the eye, any length.
    towards_eye: [f64; 3],
    /// Distance of the eye over the radius of the mesh's box.
    distance: f64,
}

/// A duck from behind, a helmet from below (dense: a triangle covers half a pixel), a cow from the front.
pub const MESH_VIEWS: [MeshView; 3] = [
    MeshView {
        name: "duck",
        file: "khronos/Duck/glTF/Duck.gltf",
        towards_eye: [-0.9, 0.5, -0.6],
        distance: 3.2,
    },
    MeshView {
        name: "helmet",
        file: "khronos/DamagedHelmet/glTF/DamagedHelmet.gltf",
        towards_eye: [0.7, -0.45, 0.8],
        distance: 3.0,
    },
    MeshView {
        name: "cow",
        file: "obj/pytorch3d/cow_mesh/cow.obj",
        towards_eye: [0.35, 0.25, -1.0],
        distance: 3.0,
    },
];

impl MeshView {
    /// The mesh; `None`, with a visible skip line for `test`, where it is absent.
    ///
    /// # Panics
    /// If the file is there and cannot be read.
    pub fn scene(&self, test: &str) -> Option<Scene> {
        let path = data_file(test, &format!("meshes/{}", self.file))?;
        let mut scene = texmap::load(&path, &LoadOptions::default())
            .expect("the mesh is readable")
            .scene;
        for material in &mut scene.materials {
            material.alpha = AlphaMode::Opaque;
            material.sides = Sides::Both;
            material.lighting = Lighting::Unlit;
            material.emissive = [0.0; 3];
        }
        Some(scene)
    }

    /// The camera, for pictures of `side_px` squared.
    ///
    /// # Panics
    /// If the scene has no triangles.
    pub fn camera(&self, scene: &Scene, side_px: u32) -> Camera {
        let renderer = Renderer::new(scene, &RenderOptions::default()).expect("default options");
        let [low, high] = renderer.bounds_in_world().expect("the mesh has triangles");
        let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        let eye = centre + self.distance * radius * DVec3::from(self.towards_eye).normalize();
        looking_camera(eye, centre, 42.0, [side_px; 2])
    }
}
