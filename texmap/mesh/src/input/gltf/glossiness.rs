//! KHR_materials_pbrSpecularGlossiness: its substitute for the base colour, and its light.

use gltf::json::texture::Info;

use crate::scene::Physical;

/// The reflectance of a dielectric along its normal, used in place of the specular colour.
const DIELECTRIC: f64 = 0.04;

/// The diffuse colour and picture of KHR_materials_pbrSpecularGlossiness, which stand for the base colour's; of a metal its
/// specular colour.
pub(super) fn diffuse(
    value: &serde_json::Value,
    index: usize,
) -> Result<([f32; 4], Option<Info>), String> {
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
    let [r, g, b, a] = factor.unwrap_or([1.0; 4]);
    if [r, g, b] != [0.0; 3] || info.is_some() {
        return Ok(([r, g, b, a], info));
    }
    // A metal scatters nothing: its colour is that of its reflection.
    let specular = value.get("specularFactor").cloned();
    let specular = specular.map(serde_json::from_value).transpose();
    let [r, g, b] = specular.map_err(broken)?.unwrap_or([1.0; 3]);
    Ok(([r, g, b, a], info))
}

/// Returns true if it says more than is drawn: a picture of specular colour and gloss, or a reflection that is neither a dielectric's nor that of a metal.
pub(super) fn is_simplified(value: &serde_json::Value) -> bool {
    let is_metal = light(value).metal == 1.0;
    // Without a factor it is white, which no dielectric has.
    let specular = value.get("specularFactor").and_then(|v| v.as_array());
    let near = |factor: &serde_json::Value| {
        factor
            .as_f64()
            .is_some_and(|f| (f - DIELECTRIC).abs() < 0.02)
    };
    let is_dielectric = specular.is_some_and(|factors| factors.iter().all(near));
    value.get("specularGlossinessTexture").is_some() || !is_metal && !is_dielectric
}

/// The light of KHR_materials_pbrSpecularGlossiness: a dielectric, or a metal where nothing scatters.
pub(super) fn light(value: &serde_json::Value) -> Physical {
    let number =
        |name: &str, default: f64| value.get(name).and_then(|v| v.as_f64()).unwrap_or(default);
    let is_metal = value.get("diffuseTexture").is_none()
        && value
            .get("diffuseFactor")
            .and_then(|v| v.as_array())
            .is_some_and(|factors| {
                factors
                    .iter()
                    .take(3)
                    .all(|factor| factor.as_f64() == Some(0.0))
            });
    Physical {
        metal: f32::from(u8::from(is_metal)),
        roughness: 1.0 - number("glossinessFactor", 1.0) as f32,
        ..Physical::default()
    }
}
