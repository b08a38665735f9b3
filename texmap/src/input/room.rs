//! The memory that the pictures of a scene take when they are drawn, asked for before it is taken.
//!
//! A renderer keeps each picture in linear light with all its coarser levels, once for every way in which materials use it, beside the
//! scene itself.

use resample_io::Gate;

use crate::mip::{self, TexelUse};
use crate::scene::{AlphaMode, Material, Scene, TextureUse};

/// Asks for the memory of all pictures: as they are in the scene, and as they are drawn.
pub(super) fn ask(scene: &Scene, gate: &Gate) -> Result<(), String> {
    let held: u64 = scene.textures.iter().map(|texture| texture.bytes()).sum();
    let mut keys = Vec::new();
    let mut drawn = 0;
    for (used, usage) in scene.materials.iter().flat_map(uses) {
        let Some(used) = used else { continue };
        let key = (used.texture, usage, used.wrap, used.magnify);
        if !keys.contains(&key) {
            keys.push(key);
            drawn += mip::bytes_of_levels(&scene.textures[used.texture], usage);
        }
    }
    gate.ask(held + drawn, "all textures with their levels")
}

/// The pictures of a material, each with what becomes of its texels.
fn uses(material: &Material) -> [(Option<TextureUse>, TexelUse); 5] {
    let physical = material.physical.unwrap_or_default();
    let scale = physical.normal_scale;
    let colour = match material.alpha {
        AlphaMode::Opaque => TexelUse::Opaque,
        AlphaMode::Mask { .. } | AlphaMode::Blend => TexelUse::Weighted,
    };
    [
        (material.base_texture, colour),
        (material.emissive_texture, TexelUse::Opaque),
        (physical.metal_roughness_texture, TexelUse::Numbers),
        (physical.normal_texture, TexelUse::Normals { scale }),
        (physical.occlusion_texture, TexelUse::Numbers),
    ]
}
