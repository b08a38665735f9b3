//! The layers of a material beside metal and paint: how its dielectric reflects, a clear coat, sheen, and glass.
//!
//! Takes the extensions of a material; gives their numbers, and their pictures by a function that finds a use of a picture.
//! Source: `KHR_materials_ior`, `KHR_materials_specular`, `KHR_materials_clearcoat`, `KHR_materials_sheen`, `KHR_materials_transmission` and
//! `KHR_materials_volume`, Khronos Group. Limits: of a coat's own map of normals only the one that the surface has, too; glass bends
//! and blurs nothing.

use gltf::json::texture::Info;
use serde_json::{Map, Value};

use crate::scene::{Coat, CoatNormals, Dielectric, Glass, Sheen, TextureUse};

/// The names of the extensions.
pub(super) const IOR: &str = "KHR_materials_ior";
pub(super) const SPECULAR: &str = "KHR_materials_specular";
pub(super) const CLEARCOAT: &str = "KHR_materials_clearcoat";
pub(super) const SHEEN: &str = "KHR_materials_sheen";

pub(super) const TRANSMISSION: &str = "KHR_materials_transmission";
pub(super) const VOLUME: &str = "KHR_materials_volume";

/// The note on glass.
pub(super) const STRAIGHT: &str = "KHR_materials_transmission: glass tints and dims what lies behind, but neither bends nor blurs it";

/// The note on a map of normals of a coat.
pub(super) const OTHER_NORMALS: &str = "KHR_materials_clearcoat: a coat's own map of normals is left out: reflections of it are smoother";

/// Finds the use of a picture.
pub(super) type Find<'f> = dyn FnMut(&Info) -> Result<Option<TextureUse>, String> + 'f;

/// An extension of a material.
struct Extension<'a> {
    name: &'static str,
    value: &'a Value,
}

impl Extension<'_> {
    fn number(&self, key: &str, default: f32) -> Result<f32, String> {
        self.read(key).map(|number| number.unwrap_or(default))
    }

    fn colour(&self, key: &str, default: f32) -> Result<[f32; 3], String> {
        self.read(key).map(|colour| colour.unwrap_or([default; 3]))
    }

    fn picture(&self, key: &str, find: &mut Find) -> Result<Option<TextureUse>, String> {
        match self.read::<Info>(key)? {
            Some(info) => find(&info),
            None => Ok(None),
        }
    }

    fn read<T: serde::de::DeserializeOwned>(&self, key: &str) -> Result<Option<T>, String> {
        let value = self.value.get(key).cloned();
        let read = value.map(serde_json::from_value).transpose();
        read.map_err(|error| format!("{}: {key}: {error}", self.name))
    }
}

/// An extension by its name.
fn extension<'a>(all: &'a Map<String, Value>, name: &'static str) -> Option<Extension<'a>> {
    let value = all.get(name)?;
    Some(Extension { name, value })
}

/// How the dielectric of a material reflects.
pub(super) fn dielectric(all: &Map<String, Value>, find: &mut Find) -> Result<Dielectric, String> {
    let mut dielectric = Dielectric::default();
    if let Some(ior) = extension(all, IOR) {
        dielectric.ior = ior.number("ior", dielectric.ior)?;
    }
    if let Some(specular) = extension(all, SPECULAR) {
        dielectric.specular = specular.number("specularFactor", 1.0)?;
        dielectric.colour = specular.colour("specularColorFactor", 1.0)?;
        dielectric.specular_texture = specular.picture("specularTexture", find)?;
        dielectric.colour_texture = specular.picture("specularColorTexture", find)?;
    }
    Ok(dielectric)
}

/// The coat of a material, and whether it has a map of normals that is left out; `below` is the surface's.
pub(super) fn coat(
    all: &Map<String, Value>,
    below: Option<TextureUse>,
    find: &mut Find,
) -> Result<(Option<Coat>, bool), String> {
    let Some(coat) = extension(all, CLEARCOAT) else {
        return Ok((None, false));
    };
    let amount = coat.number("clearcoatFactor", 0.0)?;
    if amount == 0.0 {
        return Ok((None, false));
    }
    let normals = coat.picture("clearcoatNormalTexture", find)?;
    let as_below = normals.is_some() && normals == below;
    let coat = Coat {
        amount,
        roughness: coat.number("clearcoatRoughnessFactor", 0.0)?,
        amount_texture: coat.picture("clearcoatTexture", find)?,
        roughness_texture: coat.picture("clearcoatRoughnessTexture", find)?,
        normals: match as_below {
            true => CoatNormals::AsBelow,
            false => CoatNormals::Smooth,
        },
    };
    Ok((Some(coat), normals.is_some() && !as_below))
}

/// The sheen of a material.
pub(super) fn sheen(all: &Map<String, Value>, find: &mut Find) -> Result<Option<Sheen>, String> {
    let Some(sheen) = extension(all, SHEEN) else {
        return Ok(None);
    };
    let colour = sheen.colour("sheenColorFactor", 0.0)?;
    if colour == [0.0; 3] {
        return Ok(None);
    }
    Ok(Some(Sheen {
        colour,
        roughness: sheen.number("sheenRoughnessFactor", 0.0)?,
        colour_texture: sheen.picture("sheenColorTexture", find)?,
        roughness_texture: sheen.picture("sheenRoughnessTexture", find)?,
    }))
}

/// The glass of a material; `scale` is that of its mesh in the world.
pub(super) fn glass(
    all: &Map<String, Value>,
    scale: f32,
    find: &mut Find,
) -> Result<Option<Glass>, String> {
    let Some(transmission) = extension(all, TRANSMISSION) else {
        return Ok(None);
    };
    let amount = transmission.number("transmissionFactor", 0.0)?;
    if amount == 0.0 {
        return Ok(None);
    }
    let mut glass = Glass {
        amount,
        amount_texture: transmission.picture("transmissionTexture", find)?,
        thickness: 0.0,
        thickness_texture: None,
        attenuation_colour: [1.0; 3],
        attenuation_distance: f32::INFINITY,
    };
    if let Some(volume) = extension(all, VOLUME) {
        glass.thickness = scale * volume.number("thicknessFactor", 0.0)?;
        glass.thickness_texture = volume.picture("thicknessTexture", find)?;
        glass.attenuation_colour = volume.colour("attenuationColor", 1.0)?;
        glass.attenuation_distance = volume.number("attenuationDistance", f32::INFINITY)?;
    }
    Ok(Some(glass))
}
