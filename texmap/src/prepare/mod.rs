//! A scene as the renderer keeps it: meshes with texture coordinates in texels, materials, pyramids.
//!
//! Takes a [`Scene`], once. A picture that several materials use in one way is decoded once. In the order of use: pictures that
//! replace those of the file (`textures`), the use of pictures in materials and maps of light (`maps`), layers above metal and paint (`layers`), mip
//! levels (`level`, `mip`), triangles that share an edge and borders of charts (`charts`), and triangles whose emission is
//! black (`no_emission`).

pub(crate) mod textures;
pub(crate) mod texel_use;
pub(crate) mod maps;
pub(crate) mod layers;
pub(crate) mod level;
pub(crate) mod mip;
pub(crate) mod charts;
pub(crate) mod no_emission;

use std::borrow::Cow;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3, Vec4};

use crate::light::Environment;
use crate::light::tangents::{self, Tangents};
use crate::options::{RenderOptions, Shade, Shadows};
use crate::prepare::charts::{Charts, Neighbour, neighbours};
use crate::prepare::layers::{LayerPicture, Layers};
pub(crate) use crate::prepare::maps::{
    COAT, GLASS, MAPS, METALS, NORMALS, REFLECTION, ROUGHNESS, SHEEN,
};
use crate::prepare::maps::{Pictures, VaryingMetals, per_base};
use crate::prepare::mip::Pyramid;
use crate::prepare::no_emission::black_around;
use crate::prepare::texel_use::{TexelUse, Used};
use resample_mesh::scene::{
    AlphaMode, Glass, Lighting, Magnify, Material, Mesh, Scene, Sides, TextureUse, Wrap,
};

/// A scene, ready to be drawn.
#[derive(Clone, Debug, Default)]
pub(crate) struct Prepared {
    pub(crate) meshes: Vec<PreparedMesh>,
    pub(crate) materials: Vec<PreparedMaterial>,
    pub(crate) pyramids: Vec<Pyramid>,
    /// True if light passes through a material in its colour.
    pub(crate) has_glass: bool,
    /// Light from all around, where a material reflects it.
    pub(crate) environment: Option<Arc<Environment>>,
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
    /// By triangle: how far around it the emissive texture is black, its texels; empty where that is nowhere.
    pub(crate) black_around: Vec<f32>,
    /// As `base_uv`, for the maps of light that are not laid as the base texture is.
    pub(crate) map_uv: [Vec<DVec2>; MAPS],
    /// By triangle and corner; empty without a normal map.
    pub(crate) tangents: Vec<Tangents>,
    pub(crate) material: usize,
}

/// The appearance of a surface.
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
    /// Where [`LightKind::Physical`].
    pub(crate) physical: Option<PreparedPhysical>,
}

impl PreparedMaterial {
    /// Returns true if light passes through in its colour.
    pub(crate) fn is_glass(&self) -> bool {
        let layers = self.physical.as_ref().and_then(|physical| physical.layers);
        layers.is_some_and(|layers| layers.glass > 0.0)
    }

    /// Returns true if every map of light is laid as the base texture is.
    pub(crate) fn maps_lie_as_base(&self) -> bool {
        let mut maps = self
            .physical
            .iter()
            .flat_map(|physical| physical.maps)
            .flatten();
        maps.all(|map| map.per_base.is_some())
    }
}

/// Metal, roughness, and the maps of light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedPhysical {
    pub(crate) metal: f32,
    pub(crate) roughness: f32,
    pub(crate) occlusion_strength: f32,
    /// The map that holds occlusion, if there is one.
    pub(crate) occlusion: Option<usize>,
    pub(crate) maps: [Option<LightMap>; MAPS],
    /// Where it has more than metal and paint.
    pub(crate) layers: Option<Layers>,
}

/// A map of light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightMap {
    /// Index into the pyramids.
    pub(crate) pyramid: usize,
    /// Its texels per texel of the base texture, if both are laid in the same way.
    pub(crate) per_base: Option<[f32; 2]>,
}

/// How one material is lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightKind {
    None,
    Headlight,
    Lambert,
    Physical,
}

/// The pictures so far.
#[derive(Default)]
struct Keys {
    pyramids: Vec<PyramidKey>,
    varying: VaryingMetals,
}

/// The key of a pyramid: uses of a picture with equal keys share it.
type PyramidKey = (usize, TexelUse, [Wrap; 2], Magnify);

impl Prepared {
    pub(crate) fn new(scene: &Scene, options: &RenderOptions) -> Self {
        let mut prepared = Self::default();
        let mut keys = Keys::default();
        for material in &scene.materials {
            let material = prepared.material(scene, material, options, &mut keys);
            prepared.has_glass |= material.is_glass();
            prepared.materials.push(material);
        }
        prepared.meshes = scene
            .meshes
            .iter()
            .map(|mesh| {
                let material = &prepared.materials[mesh.material];
                let mut made = prepared_mesh(scene, mesh, material);
                if let Some(emissive) = material.emissive {
                    let pyramid = &prepared.pyramids[emissive];
                    made.black_around = black_around(pyramid, &made.emissive_uv, &made.triangles);
                }
                made
            })
            .collect();
        let reflects = |material: &PreparedMaterial| material.light == LightKind::Physical;
        let is_lit = prepared.materials.iter().any(reflects) || options.shadows == Shadows::Ground;
        prepared.environment = is_lit.then(|| {
            let picture = scene.surroundings.as_deref();
            let turn_rad = options.environment_turn_deg.to_radians() as f32;
            let how = (options.shadows, options.simd.resolve());
            Environment::shared(picture, turn_rad, how)
        });
        prepared
    }

    /// Returns true if small bright lights shine on the scene.
    pub(crate) fn has_suns(&self) -> bool {
        let environment = self.environment.as_ref();
        environment.is_some_and(|environment| !environment.suns.is_empty())
    }

    /// Adds the meshes of another scene, which no light of surroundings falls on.
    pub(crate) fn append(&mut self, other: Self) {
        let (materials, pyramids) = (self.materials.len(), self.pyramids.len());
        self.meshes
            .extend(other.meshes.into_iter().map(|mesh| PreparedMesh {
                material: mesh.material + materials,
                ..mesh
            }));
        self.materials.extend(
            other
                .materials
                .into_iter()
                .map(|material| PreparedMaterial {
                    base: material.base.map(|base| base + pyramids),
                    ..material
                }),
        );
        self.pyramids.extend(other.pyramids);
    }

    fn material(
        &mut self,
        scene: &Scene,
        material: &Material,
        options: &RenderOptions,
        keys: &mut Keys,
    ) -> PreparedMaterial {
        let light = light_kind(options, material);
        let Keys {
            pyramids: keys,
            varying,
        } = keys;
        let pictures = Pictures::new(scene, material, varying);
        let mut pyramid = |used: Option<Used>| {
            used.map(|(picture, usage)| {
                let key = (picture.texture, usage, picture.wrap, picture.magnify);
                keys.iter().position(|k| *k == key).unwrap_or_else(|| {
                    keys.push(key);
                    let place = (&scene.textures[..], picture.texture);
                    let made = Pyramid::new(place, usage, picture.wrap, picture.magnify);
                    self.pyramids.push(made);
                    keys.len() - 1
                })
            })
        };
        let mut base_colour = Vec4::from(material.base_colour);
        if let (Some(glass), true) = (glass_of(material), light != LightKind::Physical) {
            base_colour.w *= 1.0 - MOST_TRANSMITTED * glass.amount.clamp(0.0, 1.0);
        }
        PreparedMaterial {
            base_colour,
            base: pyramid(pictures.base),
            emissive_colour: Vec3::from(material.emissive).extend(0.0),
            emissive: pyramid(pictures.emissive).filter(|_| material.emissive != [0.0; 3]),
            emissive_per_base: material
                .emissive_texture
                .and_then(|emissive| per_base(scene, material, emissive)),
            alpha: material.alpha,
            sides: material.sides,
            light,
            physical: (light == LightKind::Physical)
                .then(|| prepared_physical(scene, material, (&pictures, &mut pyramid))),
        }
    }
}

/// The part of the light that glass lets through where no surroundings are reflected in it, or nobody would see it. A guess.
pub(crate) const MOST_TRANSMITTED: f32 = 0.9;

fn glass_of(material: &Material) -> Option<Glass> {
    material.physical.and_then(|physical| physical.glass)
}

fn light_kind(options: &RenderOptions, material: &Material) -> LightKind {
    let is_physical = material.physical.is_some() || options.shadows != Shadows::None;
    match (options.shade, material.lighting) {
        (Shade::Unlit, _) | (Shade::Auto | Shade::Pbr, Lighting::Unlit) => LightKind::None,
        (Shade::Pbr, Lighting::Lit) => LightKind::Physical,
        (Shade::Auto, Lighting::Lit) if is_physical => LightKind::Physical,
        (Shade::Headlight, _) | (Shade::Auto, Lighting::Lit) => LightKind::Headlight,
        (Shade::Lambert, _) => LightKind::Lambert,
    }
}

fn prepared_physical(
    scene: &Scene,
    material: &Material,
    (pictures, pyramid): (&Pictures, &mut impl FnMut(Option<Used>) -> Option<usize>),
) -> PreparedPhysical {
    let physical = material.physical.unwrap_or_default();
    let map = |used: Option<Used>| {
        let per_base = used.and_then(|(map, _)| per_base(scene, material, map));
        pyramid(used).map(|pyramid| LightMap { pyramid, per_base })
    };
    PreparedPhysical {
        metal: physical.metal.clamp(0.0, 1.0),
        roughness: physical.roughness.clamp(0.0, 1.0),
        occlusion_strength: physical.occlusion_strength.clamp(0.0, 1.0),
        occlusion: pictures.occlusion,
        maps: pictures.maps.map(map),
        layers: Layers::new(scene, &physical),
    }
}

/// The mesh; where both sides are seen, with triangles that turn as their normals say, for the side that is seen turns normals round.
fn turned_as_normals(mesh: &Mesh, sides: Sides) -> Cow<'_, Mesh> {
    let is_turned = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|i| Vec3::from(mesh.positions[i as usize]));
        let normals = triangle.map(|i| Vec3::from(mesh.normals[i as usize]));
        let flat = (b - a).cross(c - a);
        normals.iter().all(|normal| normal.dot(flat) < 0.0)
    };
    if sides == Sides::Front || mesh.normals.is_empty() || !mesh.triangles.iter().any(is_turned) {
        return Cow::Borrowed(mesh);
    }
    let mut turned = mesh.clone();
    for triangle in &mut turned.triangles {
        if is_turned(triangle) {
            triangle.swap(1, 2);
        }
    }
    Cow::Owned(turned)
}

fn prepared_mesh(scene: &Scene, mesh: &Mesh, prepared: &PreparedMaterial) -> PreparedMesh {
    let material = &scene.materials[mesh.material];
    let mesh = &*turned_as_normals(mesh, material.sides);
    let uv = |texture: &Option<TextureUse>| {
        texture.map_or_else(Vec::new, |t| texel_coordinates(scene, mesh, &t))
    };
    let (base_uv, emissive_uv) = (uv(&material.base_texture), uv(&material.emissive_texture));
    let neighbours = neighbours(&mesh.positions, &mesh.triangles);
    let physical = material.physical.unwrap_or_default();
    let layer = |layer: Option<LayerPicture>| layer.map(|layer| layer.used.0);
    let used = [
        physical.metal_roughness_texture,
        physical.normal_texture,
        physical.occlusion_texture,
        material.base_texture,
        layer(layers::coat(scene, &physical)),
        layer(layers::sheen(scene, &physical)),
        layer(layers::reflection(scene, &physical)),
        layer(layers::glass(scene, &physical)),
    ];
    let map = |k: usize| prepared.physical.and_then(|physical| physical.maps[k]);
    let map_uv: [Vec<DVec2>; MAPS] = std::array::from_fn(|k| {
        let is_own = map(k).is_some_and(|map| map.per_base.is_none());
        if is_own { uv(&used[k]) } else { Vec::new() }
    });
    let of_maps = map_uv.iter().map(Vec::as_slice);
    let lists: Vec<&[DVec2]> = [&*base_uv, &*emissive_uv]
        .into_iter()
        .chain(of_maps)
        .collect();
    PreparedMesh {
        charts: Charts::new(mesh, &neighbours, &lists),
        origin_in_world: scene.origin_in_world,
        positions: mesh.positions.clone(),
        normals: mesh.normals.clone(),
        colours: mesh.colours.clone(),
        neighbours,
        triangles: mesh.triangles.clone(),
        base_uv,
        emissive_uv,
        black_around: Vec::new(),
        tangents: match used[NORMALS].filter(|_| map(NORMALS).is_some()) {
            Some(texture) => tangents(scene, mesh, &texture),
            None => Vec::new(),
        },
        map_uv,
        material: mesh.material,
    }
}

fn tangents(scene: &Scene, mesh: &Mesh, texture: &TextureUse) -> Vec<Tangents> {
    if !mesh.tangents.is_empty() {
        let of_corner = |corner: u32| mesh.tangents[corner as usize];
        return mesh.triangles.iter().map(|t| t.map(of_corner)).collect();
    }
    tangents::generate(tangents::Surface {
        positions: &mesh.positions,
        normals: &mesh.normals,
        triangles: &mesh.triangles,
        uv: &texel_coordinates(scene, mesh, texture),
    })
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
