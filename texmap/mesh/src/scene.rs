//! The scene: triangles in world space, materials and textures, as every input format leaves them.
//!
//! Node transforms are applied, so that only triangles remain: there is no scene graph. After input, every
//! index is in range and every number finite; later stages do not check again.

use std::sync::Arc;

use glam::{DAffine3, DMat2, DVec2, DVec3};
use resample_core::image::srgb_from_linear;
use resample_core::{Image, narrow};

/// Everything that a file shows.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Triangle lists, one material each.
    pub meshes: Vec<Mesh>,
    /// The point of the world that positions count from: zero, or near a scene that is far away.
    pub origin_in_world: DVec3,
    /// Materials of the meshes; meshes point here.
    pub materials: Vec<Material>,
    /// Pictures; materials point here.
    pub textures: Vec<Texture>,
    /// Cameras of the file.
    pub cameras: Vec<SceneCamera>,
    /// The light around the scene; `None` is the built-in studio.
    pub surroundings: Option<Arc<Surroundings>>,
}

impl Scene {
    /// A flat convex polygon with a picture, seen from both sides and without light. `corners` go around it; `uvs` are their places in the picture, 0
    /// to 1 from its left and from its top.
    ///
    /// ```
    /// use glam::DVec3;
    /// use resample_core::Image;
    /// use resample_mesh::Scene;
    ///
    /// let corners = [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y];
    /// let uvs = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    /// let square = Scene::polygon(&corners, uvs, Image::transparent(4, 4));
    /// assert_eq!(square.meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
    /// ```
    pub fn polygon(corners: &[DVec3], uvs: Vec<[f32; 2]>, picture: Image) -> Self {
        let origin = corners.first().copied().unwrap_or_default();
        let position = |at: &DVec3| (*at - origin).as_vec3().to_array();
        let triangle = |corner: usize| [0, corner, corner + 1].map(narrow::index32);
        let mesh = Mesh {
            positions: corners.iter().map(position).collect(),
            uvs: vec![uvs],
            triangles: (1..corners.len().saturating_sub(1)).map(triangle).collect(),
            ..Mesh::default()
        };
        let material = Material {
            base_texture: Some(TextureUse {
                wrap: [Wrap::Clamp; 2],
                ..TextureUse::whole(0)
            }),
            sides: Sides::Both,
            lighting: Lighting::Unlit,
            ..Material::default()
        };
        let texture = Texture {
            name: "picture".to_owned(),
            width: picture.width,
            height: picture.height,
            texels: Texels::LinearF32(picture.rgba),
        };
        Self {
            meshes: vec![mesh],
            origin_in_world: origin,
            materials: vec![material],
            textures: vec![texture],
            ..Self::default()
        }
    }
}

/// Light from all directions: an equirectangular picture, whose middle lies towards -z and whose top is +y.
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    /// Width in px, above 0.
    pub width: usize,
    /// Height in px, above 0.
    pub height: usize,
    /// Linear radiance, finite and not negative, rows from the top.
    pub rgb: Vec<[f32; 3]>,
}

/// Triangles of one material, along the axes of the world.
///
/// ```
/// use resample_mesh::scene::Mesh;
///
/// let mesh = Mesh {
///     positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
///     triangles: vec![[0, 1, 2]],
///     ..Mesh::default()
/// };
/// assert!(mesh.normals.is_empty(), "the triangle is flat");
/// ```
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name in the file, for messages; may be empty.
    pub name: String,
    /// Positions, from [`Scene::origin_in_world`] on.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one per position; empty where the file has none: triangles are then flat.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates: sets of one (u, v) per position. (0, 0) is the corner of the picture's first texel, v down.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Linear red, green, blue and alpha per position; empty means white.
    pub colours: Vec<[f32; 4]>,
    /// Corners, counter-clockwise seen from the front in a right-handed world.
    pub triangles: Vec<[u32; 3]>,
    /// Unit tangents by position, for normal maps, and the sign of normal x tangent in the direction of v upwards; empty
    /// where the file has none: they are then made by MikkTSpace's rules.
    pub tangents: Vec<[f32; 4]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// The appearance of a surface.
///
/// ```
/// use resample_mesh::scene::{Lighting, Material, Physical};
///
/// let brass = Material {
///     base_colour: [0.8, 0.6, 0.2, 1.0],
///     physical: Some(Physical { metal: 1.0, roughness: 0.3, ..Physical::default() }),
///     ..Material::default()
/// };
/// assert_eq!(brass.lighting, Lighting::Lit);
/// ```
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file, for messages; may be empty.
    pub name: String,
    /// Linear red, green, blue and alpha: a factor of the texture's and the vertices' colour.
    pub base_colour: [f32; 4],
    /// Picture of the base colour.
    pub base_texture: Option<TextureUse>,
    /// Linear light that the surface emits, a factor of the emissive texture's.
    pub emissive: [f32; 3],
    /// Picture of the emitted light.
    pub emissive_texture: Option<TextureUse>,
    /// The meaning of alpha.
    pub alpha: AlphaMode,
    /// The visible sides.
    pub sides: Sides,
    /// Lit or unlit.
    pub lighting: Lighting,
    /// Metal, roughness and maps for the light of surroundings; `None` where the file has none of it.
    pub physical: Option<Physical>,
}

impl Material {
    /// The uses of pictures, in an order that is always the same; a material that lacks a layer has no place for its pictures.
    pub fn textures_mut(&mut self) -> Vec<&mut Option<TextureUse>> {
        let mut all = vec![&mut self.base_texture, &mut self.emissive_texture];
        if let Some(physical) = &mut self.physical {
            all.extend([
                &mut physical.metal_roughness_texture,
                &mut physical.normal_texture,
                &mut physical.occlusion_texture,
                &mut physical.dielectric.specular_texture,
                &mut physical.dielectric.colour_texture,
            ]);
            if let Some(coat) = &mut physical.coat {
                all.extend([&mut coat.amount_texture, &mut coat.roughness_texture]);
            }
            if let Some(glass) = &mut physical.glass {
                all.extend([&mut glass.amount_texture, &mut glass.thickness_texture]);
            }
            if let Some(sheen) = &mut physical.sheen {
                all.extend([&mut sheen.colour_texture, &mut sheen.roughness_texture]);
            }
        }
        all
    }

    /// As [`Material::textures_mut`], to read.
    pub fn textures(&self) -> Vec<Option<TextureUse>> {
        let mut own = self.clone();
        own.textures_mut().into_iter().map(|used| *used).collect()
    }
}

/// Metal, roughness, and the maps of light.
///
/// ```
/// use resample_mesh::scene::Physical;
///
/// let matt = Physical::default();
/// assert_eq!((matt.metal, matt.roughness), (0.0, 1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physical {
    /// 0 for a dielectric, 1 for a metal; a factor of the map's blue.
    pub metal: f32,
    /// Perceptual roughness, 0 to 1; a factor of the map's green.
    pub roughness: f32,
    /// Picture of roughness (green) and metal (blue).
    pub metal_roughness_texture: Option<TextureUse>,
    /// Picture of normals in tangent space.
    pub normal_texture: Option<TextureUse>,
    /// Factor of the normal map's x and y.
    pub normal_scale: f32,
    /// Picture of occlusion (red).
    pub occlusion_texture: Option<TextureUse>,
    /// How much of the occlusion counts, 0 to 1.
    pub occlusion_strength: f32,
    /// How the part that is no metal reflects.
    pub dielectric: Dielectric,
    /// A clear layer above all.
    pub coat: Option<Coat>,
    /// Fibres on the surface.
    pub sheen: Option<Sheen>,
    /// Light that passes through it; its material is [`AlphaMode::Blend`].
    pub glass: Option<Glass>,
}

impl Default for Physical {
    /// A matt dielectric.
    fn default() -> Self {
        Self {
            metal: 0.0,
            roughness: 1.0,
            metal_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            dielectric: Dielectric::default(),
            coat: None,
            sheen: None,
            glass: None,
        }
    }
}

/// The reflection of a dielectric: `KHR_materials_ior` and `KHR_materials_specular`.
///
/// ```
/// use resample_mesh::scene::Dielectric;
///
/// let diamond = Dielectric { ior: 2.42, ..Dielectric::default() };
/// assert!((diamond.reflectance()[0] - 0.172).abs() < 1e-3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction, from 1 on; 0 reflects all light.
    pub ior: f32,
    /// How much of the reflection counts, 0 to 1; a factor of the picture's alpha.
    pub specular: f32,
    /// Linear colour of the reflection along the normal; a factor of the picture's.
    pub colour: [f32; 3],
    /// Picture of how much counts (alpha).
    pub specular_texture: Option<TextureUse>,
    /// Picture of the colour.
    pub colour_texture: Option<TextureUse>,
}

impl Default for Dielectric {
    /// White reflections of glass or plastic.
    fn default() -> Self {
        Self {
            ior: 1.5,
            specular: 1.0,
            colour: [1.0; 3],
            specular_texture: None,
            colour_texture: None,
        }
    }
}

impl Dielectric {
    /// The share of light along the normal that comes back, before pictures and `specular`: red, green, blue.
    pub fn reflectance(&self) -> [f32; 3] {
        let ratio = (self.ior - 1.0) / (self.ior + 1.0);
        self.colour.map(|part| ratio * ratio * part)
    }
}

/// A clear coat, as of lacquer: `KHR_materials_clearcoat`. Its index of refraction is 1.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// How much of the surface it covers, 0 to 1; a factor of the picture's red.
    pub amount: f32,
    /// Perceptual roughness, 0 to 1; a factor of the picture's green.
    pub roughness: f32,
    /// Picture of the amount (red).
    pub amount_texture: Option<TextureUse>,
    /// Picture of the roughness (green).
    pub roughness_texture: Option<TextureUse>,
    /// The normals of its surface.
    pub normals: CoatNormals,
}

/// Light that passes through a surface: `KHR_materials_transmission` and `KHR_materials_volume`.
///
/// It takes the base colour of the surface, and fades on its way through the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass {
    /// How much of the light that is not reflected passes, 0 to 1; a factor of the picture's red.
    pub amount: f32,
    /// Picture of the amount (red).
    pub amount_texture: Option<TextureUse>,
    /// Thickness of the body, world units; 0 for a thin sheet; a factor of the picture's green.
    pub thickness: f32,
    /// Picture of the thickness (green).
    pub thickness_texture: Option<TextureUse>,
    /// Linear colour of white light after [`Glass::attenuation_distance`].
    pub attenuation_colour: [f32; 3],
    /// World units; infinite where the body is clear.
    pub attenuation_distance: f32,
}

/// The normals of a coat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoatNormals {
    /// Those of the mesh.
    Smooth,
    /// Those of the surface below.
    AsBelow,
}

/// Fibres, as of cloth: `KHR_materials_sheen`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Linear colour; a factor of the picture's.
    pub colour: [f32; 3],
    /// Perceptual roughness, 0 to 1; a factor of the picture's alpha.
    pub roughness: f32,
    /// Picture of the colour.
    pub colour_texture: Option<TextureUse>,
    /// Picture of the roughness (alpha).
    pub roughness_texture: Option<TextureUse>,
}

impl Default for Material {
    /// White, opaque, lit, seen from its front.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_colour: [1.0; 4],
            base_texture: None,
            emissive: [0.0; 3],
            emissive_texture: None,
            alpha: AlphaMode::Opaque,
            sides: Sides::Front,
            lighting: Lighting::Lit,
            physical: None,
        }
    }
}

/// The meaning of a surface's alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// Seen where alpha reaches the cutoff, 0..=1.
    Mask {
        /// Least alpha that is seen.
        cutoff: f32,
    },
    /// Composited over what lies behind.
    Blend,
}

/// The visible sides of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The front only.
    Front,
    /// Both.
    Both,
}

/// Lit or unlit surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lighting {
    /// It shows its colour as it is.
    Unlit,
    /// It is lit.
    Lit,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into [`Scene::textures`].
    pub texture: usize,
    /// Index into [`Mesh::uvs`].
    pub uv_set: usize,
    /// From the mesh's coordinates to the picture's: `linear * uv + offset`.
    pub uv_linear: DMat2,
    /// See `uv_linear`.
    pub uv_offset: DVec2,
    /// Wrapping beyond the picture, along u and v.
    pub wrap: [Wrap; 2],
    /// How the picture is reconstructed where it is magnified.
    pub magnify: Magnify,
}

impl TextureUse {
    /// A texture as files use it that say no more: whole, by the first coordinates, repeated.
    pub const fn whole(texture: usize) -> Self {
        Self {
            texture,
            uv_set: 0,
            uv_linear: DMat2::IDENTITY,
            uv_offset: DVec2::ZERO,
            wrap: [Wrap::Repeat; 2],
            magnify: Magnify::Linear,
        }
    }
}

/// Wrapping beyond the border of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    Repeat,
    /// The picture mirrored, then again.
    Mirror,
    /// The texel at the border.
    Clamp,
}

/// How a picture is reconstructed where it is magnified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Magnify {
    /// The nearest texel.
    Nearest,
    /// A mix of the neighbours.
    Linear,
}

/// A picture.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Name or path, for messages.
    pub name: String,
    /// Width in texels, above 0.
    pub width: usize,
    /// Height in texels, above 0.
    pub height: usize,
    /// The texels, rows from the top.
    pub texels: Texels,
}

impl Texture {
    /// The mean of a channel, 0 to 3, in the numbers of the file: codes of red, green and blue, straight alpha, 0 to 1.
    ///
    /// ```
    /// use resample_mesh::scene::{Texels, Texture};
    ///
    /// let texture = Texture {
    ///     name: "half".to_owned(),
    ///     width: 2,
    ///     height: 1,
    ///     texels: Texels::Srgb8(vec![[0, 255, 51, 255], [0, 0, 51, 255]].into()),
    /// };
    /// assert_eq!([0, 1, 2, 3].map(|channel| texture.mean(channel)), [0.0, 0.5, 0.2, 1.0]);
    /// ```
    pub fn mean(&self, channel: usize) -> f32 {
        let sum: f64 = match &self.texels {
            Texels::Srgb8(texels) => {
                let codes: u64 = texels.iter().map(|texel| u64::from(texel[channel])).sum();
                codes as f64 / 255.0
            }
            // Pictures of 16 bits were taken for sRGB when they were read; alpha never is.
            Texels::LinearF32(texels) if channel < 3 => {
                let code = |texel: &[f32; 4]| f64::from(srgb_from_linear(texel[channel]));
                texels.iter().map(code).sum()
            }
            Texels::LinearF32(texels) => texels.iter().map(|texel| f64::from(texel[3])).sum(),
        };
        narrow::single(sum / (self.width * self.height) as f64)
    }

    /// The memory that its texels take, bytes.
    ///
    /// ```
    /// use resample_mesh::scene::{Texels, Texture};
    ///
    /// let texture = Texture {
    ///     name: "grey".to_owned(),
    ///     width: 2,
    ///     height: 2,
    ///     texels: Texels::Srgb8(vec![[128; 4]; 4].into()),
    /// };
    /// assert_eq!(texture.bytes(), 16);
    /// ```
    pub fn bytes(&self) -> u64 {
        match &self.texels {
            Texels::Srgb8(texels) => size_of_val(texels.as_slice()) as u64,
            Texels::LinearF32(texels) => size_of_val(texels.as_slice()) as u64,
        }
    }
}

/// Texels as they are kept: what the file has, decoded where it is used.
#[derive(Clone, Debug)]
pub enum Texels {
    /// 8 bits, sRGB colour, straight linear alpha.
    Srgb8(Arc<Vec<[u8; 4]>>),
    /// Linear light, straight alpha: 16-bit and floating-point pictures.
    LinearF32(Vec<[f32; 4]>),
}

/// A camera of the file.
#[derive(Clone, Debug)]
pub struct SceneCamera {
    /// Name in the file; may be empty.
    pub name: String,
    /// From the camera's space (x right, y up, looking along -z, as in glTF) to the world.
    pub world_from_camera: DAffine3,
    /// How it projects.
    pub lens: SceneLens,
}

/// How a scene's camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SceneLens {
    /// Perspective: vertical field of view in radians, and width over height where the file fixes it.
    Perspective {
        /// Vertical field of view, radians.
        fov_y_rad: f64,
        /// Width over height, if the file gives one.
        aspect: Option<f64>,
    },
    /// Parallel rays: the width and the height of the view, world units.
    Orthographic {
        /// Width and height, world units.
        size: DVec2,
    },
}
