//! Materials and textures: colour, alpha, emitted light, and metal and roughness with their maps.
//!
//! Takes the document and its buffers, gives materials and textures in the order in which meshes ask for them: what
//! nobody uses is not decoded. A picture that cannot be read is an error, or leaves its factor and a note, as is asked for.
//! Source: glTF 2.0, 3.8 and 3.9, with KHR_texture_transform, KHR_materials_unlit, KHR_materials_emissive_strength,
//! KHR_materials_pbrSpecularGlossiness (its gloss by the mean of a picture), EXT_texture_webp and KHR_texture_basisu; other layers in
//! `layers`. Limits: refraction, iridescence and anisotropy are left out.

use std::collections::HashMap;

use glam::{DMat2, DVec2};
use gltf::json::Root;
use gltf::json::material::AlphaMode as JsonAlpha;
use gltf::json::texture::{Info, MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use resample_core::narrow;
use resample_io::Gate;

use crate::input::files::Names;
use crate::input::gltf::accessor::Numbers;
use crate::input::gltf::images::Images;
use crate::input::gltf::layers;
use crate::input::options::{LightMaps, Notes, Unreadable};
use crate::input::pictures::{Decoded, Pictures};
use crate::scene::{
    AlphaMode, Dielectric, Lighting, Magnify, Material, Physical, Sides, TextureUse, Wrap,
};

/// Cutoff of masked materials that give none: glTF 2.0, 5.19.
const DEFAULT_CUTOFF: f32 = 0.5;

/// Extensions that name a picture of another format, in the order in which they are taken.
const PICTURE_EXTENSIONS: &[&str] = if cfg!(feature = "compressed") {
    &["EXT_texture_webp", "KHR_texture_basisu"]
} else {
    &["EXT_texture_webp"]
};

const FACTOR_ALONE: &str = "its factor stands alone";

const GLOSSINESS: &str =
    "KHR_materials_pbrSpecularGlossiness: gloss that a picture varies counts by its mean";

/// Where pictures come from.
enum Source {
    /// Materials get no pictures; the numbers of those that they use are listed.
    Listed(Vec<usize>),
    /// Materials get the pictures of the document, of which some are decoded already.
    Document(Decoded<usize>),
}

/// The materials of a file, read when they are asked for.
pub(super) struct Materials<'a> {
    root: &'a Root,
    images: Images<'a>,
    gate: &'a Gate,
    light_maps: LightMaps,
    source: Source,
    /// Materials read so far.
    pub materials: Vec<Material>,
    /// Textures read so far.
    pub textures: Pictures,
    by_index: HashMap<(Option<usize>, u32), usize>,
    by_image: HashMap<usize, Option<usize>>,
}

impl<'a> Materials<'a> {
    /// Nothing is read yet.
    pub(super) fn new(
        root: &'a Root,
        numbers: &'a Numbers<'a>,
        names: &'a Names<'a>,
        light_maps: LightMaps,
    ) -> Self {
        Self {
            root,
            images: Images::new(root, numbers, names),
            gate: names.gate,
            light_maps,
            source: Source::Document(Decoded::new()),
            materials: Vec::new(),
            textures: Pictures::default(),
            by_index: HashMap::new(),
            by_image: HashMap::new(),
        }
    }

    /// Decodes the pictures of the materials of these meshes on all threads. Faults come up when a material is placed.
    pub(super) fn decode_ahead<'m>(&mut self, meshes: impl Iterator<Item = &'m gltf::json::Mesh>) {
        let mut listing = Self {
            source: Source::Listed(Vec::new()),
            materials: Vec::new(),
            textures: Pictures::default(),
            by_index: HashMap::new(),
            by_image: HashMap::new(),
            ..*self
        };
        let mut notes = Notes::new(Unreadable::Noted);
        for primitive in meshes.flat_map(|mesh| &mesh.primitives) {
            let index = primitive.material.map(|material| material.value());
            // A material that cannot be read names no more pictures.
            let _ = listing.place(index, 1.0, &mut notes);
        }
        if let Source::Listed(asked) = listing.source {
            self.source = Source::Document(self.images.decode_all(&asked));
        }
    }

    /// The place of a material of the file, or of the default one, in `materials`; `scale` is that of the mesh in the world.
    pub(super) fn place(
        &mut self,
        index: Option<usize>,
        scale: f32,
        notes: &mut Notes,
    ) -> Result<usize, String> {
        // Only the thickness of a body depends on the scale of its mesh.
        let scale = if self.has_volume(index) { scale } else { 1.0 };
        let key = (index, scale.to_bits());
        if let Some(&place) = self.by_index.get(&key) {
            return Ok(place);
        }
        let material = match index {
            None => Material::default(),
            Some(index) => self.material(index, scale, notes)?,
        };
        self.materials.push(material);
        self.by_index.insert(key, self.materials.len() - 1);
        Ok(self.materials.len() - 1)
    }

    fn has_volume(&self, index: Option<usize>) -> bool {
        let material = index.and_then(|index| self.root.materials.get(index));
        let extensions = material.and_then(|material| material.extensions.as_ref());
        extensions.is_some_and(|all| all.others.contains_key(layers::VOLUME))
    }

    fn material(
        &mut self,
        index: usize,
        scale: f32,
        notes: &mut Notes,
    ) -> Result<Material, String> {
        let json = self
            .root
            .materials
            .get(index)
            .ok_or_else(|| format!("material {index} does not exist"))?;
        let extensions = json.extensions.as_ref();
        let glossiness =
            extensions.and_then(|e| e.others.get("KHR_materials_pbrSpecularGlossiness"));
        let (base_colour, base_info) = match glossiness {
            Some(value) => diffuse_of(value, index)?,
            None => {
                let pbr = &json.pbr_metallic_roughness;
                (pbr.base_color_factor.0, pbr.base_color_texture.clone())
            }
        };
        let strength = extensions
            .and_then(|e| e.emissive_strength.as_ref())
            .map_or(1.0, |e| e.emissive_strength.0);
        let Checked::Valid(alpha) = json.alpha_mode else {
            return Err(format!(
                "material {index}: alphaMode must be OPAQUE, MASK or BLEND"
            ));
        };
        let cutoff = json.alpha_cutoff.map_or(DEFAULT_CUTOFF, |cutoff| cutoff.0);
        let physical = match glossiness {
            Some(value) => self.glossy(value, index, notes)?,
            None => self.physical(json, scale, notes)?,
        };
        let material = Material {
            name: json
                .name
                .clone()
                .unwrap_or_else(|| format!("material {index}")),
            base_colour,
            base_texture: self.texture_use(base_info.as_ref(), notes)?,
            emissive: json.emissive_factor.0.map(|factor| factor * strength),
            emissive_texture: self.texture_use(json.emissive_texture.as_ref(), notes)?,
            alpha: match alpha {
                _ if physical.glass.is_some() => AlphaMode::Blend,
                JsonAlpha::Opaque => AlphaMode::Opaque,
                JsonAlpha::Mask => AlphaMode::Mask { cutoff },
                JsonAlpha::Blend => AlphaMode::Blend,
            },
            sides: if json.double_sided {
                Sides::Both
            } else {
                Sides::Front
            },
            lighting: match extensions.and_then(|e| e.unlit.as_ref()) {
                Some(_) => Lighting::Unlit,
                None => Lighting::Lit,
            },
            physical: Some(physical),
        };
        let numbers = material.base_colour.iter().chain(&material.emissive);
        let of_light = material.physical.iter().flat_map(factors_of);
        let mut all = numbers.copied().chain([cutoff]).chain(of_light);
        if !all.all(f32::is_finite) {
            return Err(format!("material {index}: a factor is not finite"));
        }
        Ok(material)
    }

    /// Metal, roughness and the maps of light.
    fn physical(
        &mut self,
        json: &gltf::json::Material,
        scale: f32,
        notes: &mut Notes,
    ) -> Result<Physical, String> {
        let pbr = &json.pbr_metallic_roughness;
        let none = serde_json::Map::new();
        let others = json.extensions.as_ref().map_or(&none, |all| &all.others);
        if self.light_maps == LightMaps::LeftOut {
            return Ok(Physical {
                metal: pbr.metallic_factor.0,
                roughness: pbr.roughness_factor.0,
                glass: layers::glass(others, scale, &mut |_| Ok(None))?,
                ..Physical::default()
            });
        }
        let normal = json.normal_texture.as_ref();
        let normal_info = normal.map(|normal| Info {
            index: normal.index,
            tex_coord: normal.tex_coord,
            extensions: normal
                .extensions
                .as_ref()
                .and_then(|e| transformed(&e.others)),
            extras: normal.extras.clone(),
        });
        let occlusion = json.occlusion_texture.as_ref();
        let occlusion_info = occlusion.map(|occlusion| Info {
            index: occlusion.index,
            tex_coord: occlusion.tex_coord,
            extensions: occlusion
                .extensions
                .as_ref()
                .and_then(|e| transformed(&e.others)),
            extras: occlusion.extras.clone(),
        });
        let metal_roughness = pbr.metallic_roughness_texture.as_ref();
        let metal_roughness_texture = self.texture_use(metal_roughness, notes)?;
        let normal_texture = self.texture_use(normal_info.as_ref(), notes)?;
        let mut find = |info: &Info| self.texture_use(Some(info), notes);
        let dielectric = layers::dielectric(others, &mut find)?;
        let (coat, lacks_normals) = layers::coat(others, normal_texture, &mut find)?;
        let sheen = layers::sheen(others, &mut find)?;
        let glass = layers::glass(others, scale, &mut find)?;
        if glass.is_some() {
            notes.say(layers::STRAIGHT.to_owned());
        }
        if lacks_normals {
            notes.say(layers::OTHER_NORMALS.to_owned());
        }
        Ok(Physical {
            metal: pbr.metallic_factor.0,
            roughness: pbr.roughness_factor.0,
            metal_roughness_texture,
            normal_texture,
            dielectric,
            coat,
            sheen,
            glass,
            normal_scale: normal.map_or(1.0, |normal| normal.scale),
            occlusion_texture: self.texture_use(occlusion_info.as_ref(), notes)?,
            occlusion_strength: occlusion.map_or(1.0, |occlusion| occlusion.strength.0),
        })
    }

    /// The light of KHR_materials_pbrSpecularGlossiness: a dielectric that reflects in any colour.
    fn glossy(
        &mut self,
        value: &serde_json::Value,
        index: usize,
        notes: &mut Notes,
    ) -> Result<Physical, String> {
        let broken =
            |error| format!("material {index}: KHR_materials_pbrSpecularGlossiness: {error}");
        let read = |key: &str| value.get(key).cloned();
        let colour = read("specularFactor").map(serde_json::from_value);
        let colour: Option<[f32; 3]> = colour.transpose().map_err(broken)?;
        let gloss = read("glossinessFactor").map(serde_json::from_value);
        let gloss: Option<f32> = gloss.transpose().map_err(broken)?;
        let info = read("specularGlossinessTexture").map(serde_json::from_value);
        let info: Option<Info> = info.transpose().map_err(broken)?;
        let wanted = info.filter(|_| self.light_maps != LightMaps::LeftOut);
        let colour_texture = self.texture_use(wanted.as_ref(), notes)?;
        let mean = colour_texture.map(|used| self.textures.get(used.texture).mean(3));
        if mean.is_some() {
            notes.say(GLOSSINESS.to_owned());
        }
        Ok(Physical {
            roughness: 1.0 - gloss.unwrap_or(1.0) * mean.unwrap_or(1.0),
            dielectric: Dielectric {
                // Reflects all light, in the colour that is given.
                ior: 0.0,
                colour: colour.unwrap_or([1.0; 3]),
                colour_texture,
                ..Dielectric::default()
            },
            ..Physical::default()
        })
    }

    fn texture_use(
        &mut self,
        info: Option<&Info>,
        notes: &mut Notes,
    ) -> Result<Option<TextureUse>, String> {
        let Some(info) = info else { return Ok(None) };
        let index = info.index.value();
        let json = self
            .root
            .textures
            .get(index)
            .ok_or_else(|| format!("texture {index} does not exist"))?;
        let extensions = json.extensions.as_ref();
        let mut others = PICTURE_EXTENSIONS
            .iter()
            .filter_map(|name| extensions?.others.get(*name)?.get("source")?.as_u64());
        let other = others.next().map(narrow::count);
        // The crate gives the largest index where the file gives none.
        let source = Some(json.source.value()).filter(|&source| source != u32::MAX as usize);
        let Some(image) = other.or(source) else {
            let what = format!("texture {index} has no picture of a known kind");
            notes.unreadable(&what, FACTOR_ALONE)?;
            return Ok(None);
        };
        let Some(texture) = self.image(image, notes)? else {
            return Ok(None);
        };
        let sampler = match json.sampler.map(|sampler| sampler.value()) {
            None => gltf::json::texture::Sampler::default(),
            Some(at) => {
                let sampler = self.root.samplers.get(at);
                sampler
                    .ok_or_else(|| format!("texture {index}: sampler {at} does not exist"))?
                    .clone()
            }
        };
        let transform = info
            .extensions
            .as_ref()
            .and_then(|e| e.texture_transform.as_ref());
        let (uv_linear, uv_offset) = transform.map_or((DMat2::IDENTITY, DVec2::ZERO), uv_transform);
        if !uv_linear.is_finite() || !uv_offset.is_finite() {
            return Err(format!("texture {index}: its transform is not finite"));
        }
        let uv_set = transform
            .and_then(|transform| transform.tex_coord)
            .unwrap_or(info.tex_coord) as usize;
        let wrap = [wrap(sampler.wrap_s, index)?, wrap(sampler.wrap_t, index)?];
        let magnify = match sampler.mag_filter {
            Some(Checked::Valid(MagFilter::Nearest)) => Magnify::Nearest,
            _ => Magnify::Linear,
        };
        Ok(Some(TextureUse {
            texture,
            uv_set,
            uv_linear,
            uv_offset,
            wrap,
            magnify,
        }))
    }

    /// The place of a picture in `textures`; none if it cannot be had, which a note says.
    fn image(&mut self, index: usize, notes: &mut Notes) -> Result<Option<usize>, String> {
        if let Some(&place) = self.by_image.get(&index) {
            return Ok(place);
        }
        let label = self.images.label(index)?;
        let decoded = match &mut self.source {
            Source::Listed(asked) => {
                asked.push(index);
                self.by_image.insert(index, None);
                return Ok(None);
            }
            Source::Document(ahead) => ahead.remove(&index),
        };
        let place = decoded
            .unwrap_or_else(|| self.images.decode(index))
            .and_then(|texture| self.textures.add(texture, self.gate));
        if let Err(what) = &place {
            notes.unreadable(&format!("texture {label}: {what}"), FACTOR_ALONE)?;
        }
        self.by_image.insert(index, place.as_ref().ok().copied());
        Ok(place.ok())
    }
}

/// The factors of what reflects light.
fn factors_of(physical: &Physical) -> Vec<f32> {
    let dielectric = &physical.dielectric;
    let mut factors = vec![
        physical.metal,
        physical.roughness,
        physical.normal_scale,
        physical.occlusion_strength,
        dielectric.ior,
        dielectric.specular,
    ];
    factors.extend(dielectric.colour);
    factors.extend(
        physical
            .coat
            .iter()
            .flat_map(|coat| [coat.amount, coat.roughness]),
    );
    if let Some(glass) = &physical.glass {
        factors.extend([glass.amount, glass.thickness]);
        factors.extend(glass.attenuation_colour);
    }
    if let Some(sheen) = &physical.sheen {
        factors.extend(sheen.colour);
        factors.push(sheen.roughness);
    }
    factors
}

/// The extensions of a normal or an occlusion map, which the crate leaves undecoded.
fn transformed(
    others: &serde_json::Map<String, serde_json::Value>,
) -> Option<gltf::json::extensions::texture::Info> {
    serde_json::from_value(others.clone().into()).ok()
}

fn wrap(mode: Checked<WrappingMode>, index: usize) -> Result<Wrap, String> {
    match mode {
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
        Checked::Invalid => Err(format!("texture {index}: unknown wrap mode")),
    }
}

/// Scale first, then rotation, then offset. Positive angles turn the coordinates counter-clockwise as seen in the
/// picture, where v points down, so the picture on the surface turns clockwise.
fn uv_transform(transform: &gltf::json::extensions::texture::TextureTransform) -> (DMat2, DVec2) {
    let (sin, cos) = f64::from(transform.rotation.0).sin_cos();
    let rotation = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    let scale = DMat2::from_diagonal(DVec2::from_array(transform.scale.0.map(f64::from)));
    (
        rotation * scale,
        DVec2::from_array(transform.offset.0.map(f64::from)),
    )
}

// KHR_materials_pbrSpecularGlossiness: its substitute for the base colour, and its light.

/// The diffuse colour and picture of KHR_materials_pbrSpecularGlossiness, which stand for the base colour's.
fn diffuse_of(value: &serde_json::Value, index: usize) -> Result<([f32; 4], Option<Info>), String> {
    let broken = |error| format!("material {index}: KHR_materials_pbrSpecularGlossiness: {error}");
    let factor = value
        .get("diffuseFactor")
        .cloned()
        .map(serde_json::from_value)
        .transpose()
        .map_err(broken)?;
    let info = value
        .get("diffuseTexture")
        .cloned()
        .map(serde_json::from_value)
        .transpose()
        .map_err(broken)?;
    Ok((factor.unwrap_or([1.0; 4]), info))
}
