//! The pictures of a material, and the use of their texels.
//!
//! Takes a scene and a material; gives the pictures of its colours and of its maps of light. Two things follow from more than one picture:
//! occlusion that is laid as roughness and metal are, and as large, becomes the red of that map, which is looked up anyway; and where
//! metal varies, a further map holds base colour times metal and roughness times metal. Without it a footprint would know two
//! means, but not which of the colours is the metal's.

use std::collections::HashMap;

use rayon::prelude::*;

use resample_mesh::scene::{AlphaMode, Material, Scene, Texels, Texture, TextureUse, Wrap};

/// The use of a picture in a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TexelUse {
    /// Colour; alpha counts as 1.
    Opaque,
    /// Colour that is weighted by alpha: it is premultiplied before it is filtered.
    Weighted,
    /// Numbers as they are in the file; alpha is the square of green.
    Numbers,
    /// As [`TexelUse::Numbers`], with the red of another picture of the same size.
    WithOcclusion {
        /// Its place in the scene.
        picture: usize,
    },
    /// Base colour times metal, and in alpha roughness times metal: see [`crate::prepare::maps`].
    Metals {
        /// The place of the picture of roughness and metal in the scene.
        picture: usize,
        /// Wrapping beyond that picture's borders.
        wrap: [Wrap; 2],
        /// True if the colour is weighted by alpha.
        alpha: Weighting,
    },
    /// Normals in tangent space, whose x and y are scaled: see [`crate::prepare::maps`].
    Normals {
        /// Factor of x and y.
        scale: f32,
    },
}

/// Returns true if a colour is weighted by its alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Weighting {
    /// Alpha counts as 1.
    Even,
    /// Premultiplied.
    ByAlpha,
}

/// The maps of light: roughness with metal, normals, occlusion where it has a picture of its own, and what is metal of the base colour.
pub(crate) const MAPS: usize = 4;

/// The maps' places.
pub(crate) const ROUGHNESS: usize = 0;
pub(crate) const NORMALS: usize = 1;
pub(crate) const OCCLUSION: usize = 2;
pub(crate) const METALS: usize = 3;

/// Metal that varies by no more codes than this is the same all over: what is lost is at most a quarter of it, 0.3 % of the light, and
/// compressed pictures of one number vary by as much.
const LEAST_CODES: u8 = 3;

/// A picture as a material uses it, and what becomes of its texels.
pub(crate) type Used = (TextureUse, TexelUse);

/// The pictures of a material.
pub(crate) struct Pictures {
    pub(crate) base: Option<Used>,
    pub(crate) emissive: Option<Used>,
    pub(crate) maps: [Option<Used>; MAPS],
    /// The map whose red is occlusion.
    pub(crate) occlusion: Option<usize>,
}

/// Pictures of metal by their place in the scene, and whether theirs varies: many materials may share one.
#[derive(Default)]
pub(crate) struct VaryingMetals(HashMap<usize, bool>);

impl Pictures {
    pub(crate) fn new(scene: &Scene, material: &Material, varying: &mut VaryingMetals) -> Self {
        let physical = material.physical.unwrap_or_default();
        let colour = match material.alpha {
            AlphaMode::Opaque => TexelUse::Opaque,
            AlphaMode::Mask { .. } | AlphaMode::Blend => TexelUse::Weighted,
        };
        let used = |picture: Option<TextureUse>, usage| picture.map(|picture| (picture, usage));
        let (roughness, occlusion) = (physical.metal_roughness_texture, physical.occlusion_texture);
        let mut maps = [
            used(roughness, TexelUse::Numbers),
            used(
                physical.normal_texture,
                TexelUse::Normals {
                    scale: physical.normal_scale,
                },
            ),
            used(occlusion, TexelUse::Numbers),
            metals(scene, material, varying),
        ];
        let mut place = occlusion.map(|_| OCCLUSION);
        if let (Some(occlusion), Some(roughness)) = (occlusion, roughness)
            && let Some(usage) = shared(scene, roughness, occlusion)
        {
            maps[ROUGHNESS] = Some((roughness, usage));
            maps[OCCLUSION] = None;
            place = Some(ROUGHNESS);
        }
        Self {
            base: used(material.base_texture, colour),
            emissive: used(material.emissive_texture, TexelUse::Opaque),
            maps,
            occlusion: place,
        }
    }
}

/// The map of roughness and metal with occlusion in its red, if that is possible.
fn shared(scene: &Scene, roughness: TextureUse, occlusion: TextureUse) -> Option<TexelUse> {
    if roughness == occlusion {
        return Some(TexelUse::Numbers);
    }
    let is_alike = TextureUse {
        texture: roughness.texture,
        ..occlusion
    } == roughness;
    let [one, other] = [roughness, occlusion].map(|picture| &scene.textures[picture.texture]);
    let is_as_large = [one.width, one.height] == [other.width, other.height];
    (is_alike && is_as_large).then_some(TexelUse::WithOcclusion {
        picture: occlusion.texture,
    })
}

/// The metal's part of a material's base colour, if that varies and both lie in the same way.
fn metals(scene: &Scene, material: &Material, varying: &mut VaryingMetals) -> Option<Used> {
    let physical = material.physical?;
    let (base, map) = (material.base_texture?, physical.metal_roughness_texture?);
    per_base(scene, material, map).filter(|_| physical.metal > 0.0)?;
    let alpha = match material.alpha {
        AlphaMode::Opaque => Weighting::Even,
        AlphaMode::Mask { .. } | AlphaMode::Blend => Weighting::ByAlpha,
    };
    let usage = TexelUse::Metals {
        picture: map.texture,
        wrap: map.wrap,
        alpha,
    };
    let VaryingMetals(varying) = varying;
    let varies = || metal_varies(&scene.textures[map.texture]);
    let varies = *varying.entry(map.texture).or_insert_with(varies);
    varies.then_some((base, usage))
}

/// Returns true if the blue of a picture is not the same all over.
fn metal_varies(picture: &Texture) -> bool {
    match &picture.texels {
        Texels::Srgb8(texels) => {
            let ends = texels
                .par_chunks(1 << 16)
                .map(|part| {
                    let blue = |(least, most): (u8, u8), texel: &[u8; 4]| {
                        (least.min(texel[2]), most.max(texel[2]))
                    };
                    part.iter().fold((u8::MAX, u8::MIN), blue)
                })
                .reduce(|| (u8::MAX, u8::MIN), |a, b| (a.0.min(b.0), a.1.max(b.1)));
            ends.1.saturating_sub(ends.0) > LEAST_CODES
        }
        Texels::LinearF32(texels) => texels.iter().any(|texel| texel[2] != texels[0][2]),
    }
}

/// Texels of another texture per texel of the base texture, if both are laid in the same way.
pub(crate) fn per_base(scene: &Scene, material: &Material, other: TextureUse) -> Option<[f32; 2]> {
    let base = material.base_texture?;
    let alike = TextureUse {
        texture: base.texture,
        wrap: base.wrap,
        magnify: base.magnify,
        ..other
    };
    let [of_base, of_other] = [base, other].map(|texture| &scene.textures[texture.texture]);
    (alike == base).then(|| {
        [
            of_other.width as f32 / of_base.width as f32,
            of_other.height as f32 / of_base.height as f32,
        ]
    })
}
