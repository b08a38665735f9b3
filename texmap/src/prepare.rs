//! What the renderer keeps of a scene: meshes with texture coordinates in texels, materials, pyramids.
//!
//! Takes a [`Scene`], once. A picture that several materials use in one way is decoded once.

use glam::{DVec2, DVec3, Vec3, Vec4};

use crate::adjacency::{Neighbour, neighbours};
use crate::charts::Charts;
use crate::mip::{AlphaUse, Pyramid};
use crate::options::{RenderOptions, Shade};
use crate::scene::{AlphaMode, Lighting, Magnify, Material, Mesh, Scene, Sides, TextureUse, Wrap};

/// A scene, ready to be drawn.
#[derive(Clone, Debug, Default)]
pub(crate) struct Prepared {
    pub(crate) meshes: Vec<PreparedMesh>,
    pub(crate) materials: Vec<PreparedMaterial>,
    pub(crate) pyramids: Vec<Pyramid>,
}

/// Triangles of one material.
#[derive(Clone, Debug)]
pub(crate) struct PreparedMesh {
    /// The point that positions count from.
    pub(crate) origin_in_world: DVec3,
    pub(crate) positions: Vec<[f32; 3]>,
    /// Empty: triangles are flat.
    pub(crate) normals: Vec<[f32; 3]>,
    /// Empty: white.
    pub(crate) colours: Vec<[f32; 4]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// By triangle and corner: what lies beyond the line opposite the corner.
    pub(crate) neighbours: Vec<[Option<Neighbour>; 3]>,
    /// Where charts of texture coordinates end.
    pub(crate) charts: Charts,
    /// Coordinates in the base texture, texels of the full texture; empty without one.
    pub(crate) base_uv: Vec<DVec2>,
    /// As `base_uv`, for the emissive texture.
    pub(crate) emissive_uv: Vec<DVec2>,
    pub(crate) material: usize,
}

/// What a surface looks like.
#[derive(Clone, Debug)]
pub(crate) struct PreparedMaterial {
    pub(crate) base_colour: Vec4,
    /// Index into the pyramids.
    pub(crate) base: Option<usize>,
    /// Red, green, blue; the fourth counts for nothing.
    pub(crate) emissive_colour: Vec4,
    /// Index into the pyramids.
    pub(crate) emissive: Option<usize>,
    /// Texels of the emissive texture per texel of the base texture, if both are laid in the same way.
    pub(crate) emissive_per_base: Option<[f32; 2]>,
    pub(crate) alpha: AlphaMode,
    pub(crate) sides: Sides,
    pub(crate) light: LightKind,
}

/// How one material is lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightKind {
    None,
    Headlight,
    Lambert,
}

/// What makes two uses of a picture the same pyramid.
type PyramidKey = (usize, AlphaUse, [Wrap; 2], Magnify);

impl Prepared {
    pub(crate) fn new(scene: &Scene, options: &RenderOptions) -> Self {
        let mut prepared = Self::default();
        let mut keys = Vec::new();
        for material in &scene.materials {
            let material = prepared.material(scene, material, options.shade, &mut keys);
            prepared.materials.push(material);
        }
        prepared.meshes = scene
            .meshes
            .iter()
            .map(|mesh| prepared_mesh(scene, mesh))
            .collect();
        prepared
    }

    fn material(
        &mut self,
        scene: &Scene,
        material: &Material,
        shade: Shade,
        keys: &mut Vec<PyramidKey>,
    ) -> PreparedMaterial {
        let alpha = match material.alpha {
            AlphaMode::Opaque => AlphaUse::Ignored,
            AlphaMode::Mask { .. } | AlphaMode::Blend => AlphaUse::Weights,
        };
        let mut pyramid = |texture: &Option<TextureUse>, alpha| {
            texture.as_ref().map(|t| {
                let key = (t.texture, alpha, t.wrap, t.magnify);
                keys.iter().position(|k| *k == key).unwrap_or_else(|| {
                    keys.push(key);
                    self.pyramids.push(Pyramid::new(
                        &scene.textures[t.texture],
                        alpha,
                        t.wrap,
                        t.magnify,
                    ));
                    keys.len() - 1
                })
            })
        };
        PreparedMaterial {
            base_colour: Vec4::from(material.base_colour),
            base: pyramid(&material.base_texture, alpha),
            emissive_colour: Vec3::from(material.emissive).extend(0.0),
            emissive: pyramid(&material.emissive_texture, AlphaUse::Ignored)
                .filter(|_| material.emissive != [0.0; 3]),
            emissive_per_base: emissive_per_base(scene, material),
            alpha: material.alpha,
            sides: material.sides,
            light: match (shade, material.lighting) {
                (Shade::Unlit, _) | (Shade::Auto, Lighting::Unlit) => LightKind::None,
                (Shade::Headlight, _) | (Shade::Auto, Lighting::Lit) => LightKind::Headlight,
                (Shade::Lambert, _) => LightKind::Lambert,
            },
        }
    }
}

/// See [`PreparedMaterial::emissive_per_base`].
fn emissive_per_base(scene: &Scene, material: &Material) -> Option<[f32; 2]> {
    let (base, emissive) = (material.base_texture?, material.emissive_texture?);
    let alike = TextureUse {
        texture: base.texture,
        wrap: base.wrap,
        magnify: base.magnify,
        ..emissive
    };
    let [of_base, of_emissive] = [base, emissive].map(|texture| &scene.textures[texture.texture]);
    (alike == base).then(|| {
        [
            of_emissive.width as f32 / of_base.width as f32,
            of_emissive.height as f32 / of_base.height as f32,
        ]
    })
}

fn prepared_mesh(scene: &Scene, mesh: &Mesh) -> PreparedMesh {
    let material = &scene.materials[mesh.material];
    let uv = |texture: &Option<TextureUse>| {
        texture.map_or_else(Vec::new, |t| texel_coordinates(scene, mesh, &t))
    };
    let (base_uv, emissive_uv) = (uv(&material.base_texture), uv(&material.emissive_texture));
    let neighbours = neighbours(&mesh.positions, &mesh.triangles);
    PreparedMesh {
        charts: Charts::new(mesh, &neighbours, [&base_uv, &emissive_uv]),
        origin_in_world: scene.origin_in_world,
        positions: mesh.positions.clone(),
        normals: mesh.normals.clone(),
        colours: mesh.colours.clone(),
        neighbours,
        triangles: mesh.triangles.clone(),
        base_uv,
        emissive_uv,
        material: mesh.material,
    }
}

fn texel_coordinates(scene: &Scene, mesh: &Mesh, texture: &TextureUse) -> Vec<DVec2> {
    let picture = &scene.textures[texture.texture];
    let size = DVec2::new(picture.width as f64, picture.height as f64);
    let Some(set) = mesh.uvs.get(texture.uv_set) else {
        return Vec::new();
    };
    set.iter()
        .map(|uv| (texture.uv_linear * DVec2::from(uv.map(f64::from)) + texture.uv_offset) * size)
        .collect()
}

impl PreparedMesh {
    /// The corners of a triangle, world units.
    #[inline]
    pub(crate) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|i| self.in_world(&self.positions[i as usize]))
    }

    /// A position, world units.
    #[inline]
    pub(crate) fn in_world(&self, pos: &[f32; 3]) -> DVec3 {
        self.origin_in_world + DVec3::from(pos.map(f64::from))
    }
}
