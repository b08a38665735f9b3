//! The pictures of a material, the use of their texels, and the maps of light as texels.
//!
//! Takes a scene and a material; gives the pictures of its colours and of its maps of light. Two things follow from more than one picture:
//! occlusion that is laid as roughness and metal are, and as large, becomes the red of that map, which is looked up anyway; and where
//! metal varies, a further map holds base colour times metal and roughness times metal. Without it a footprint would know two
//! means, but not which of the colours is the metal's.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;
use resample_core::image::srgb_from_linear;
use resample_mesh::scene::{AlphaMode, Material, Scene, Texels, Texture, TextureUse, Wrap};

use crate::prepare::layers;
use crate::prepare::level::{LINEAR, wrapped};
use crate::prepare::texel_use::{TexelUse, Used, Weighting};

/// The maps of light: roughness with metal, normals, occlusion where it has a picture of its own, what is metal of the base colour, and
/// those of layers: a coat's amount and roughness, the colour and the roughness of sheen, those of a dielectric's reflection, and
/// how much light passes through how thick a body.
pub(crate) const MAPS: usize = 8;

/// The maps' places.
pub(crate) const ROUGHNESS: usize = 0;
pub(crate) const NORMALS: usize = 1;
pub(crate) const OCCLUSION: usize = 2;
pub(crate) const METALS: usize = 3;
pub(crate) const COAT: usize = 4;
pub(crate) const SHEEN: usize = 5;
pub(crate) const REFLECTION: usize = 6;
pub(crate) const GLASS: usize = 7;

/// Metal that varies by no more codes than this is the same all over: what is lost is at most a quarter of it, 0.3 % of the light, and
/// compressed pictures of one number vary by as much.
const LEAST_CODES: u8 = 3;

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
            layers::coat(scene, &physical).map(|layer| layer.used),
            layers::sheen(scene, &physical).map(|layer| layer.used),
            layers::reflection(scene, &physical).map(|layer| layer.used),
            layers::glass(scene, &physical).map(|layer| layer.used),
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

// The maps of light as texels: numbers as they are in the file, and normals with what their means forget.
//
// Roughness comes with its square, so that a footprint knows its variance. A normal map is reconstructed between its
// texels and then made one long; its mean over a footprint is shorter than one by the variance of its normals, and by what
// reconstruction itself takes away. So a fourth number holds how long the reconstructed normal is around the texel, mean square: the
// variance is that number's mean less the square of the mean normal (Toksvig 2005, without his bias).

/// Rounding of means of normals kept in 16 bits: variances below count as none.
const ROUNDING: f32 = 1e-4;

/// Red, green, blue as in the file, 0..=1, and the square of green.
pub(crate) fn numbers(texture: &Texture) -> Vec<Vec4> {
    each_texel(texture, |rgb| rgb.extend(rgb.y * rgb.y))
}

/// As [`numbers`], with the red of another picture of the same size.
pub(crate) fn numbers_with(texture: &Texture, occlusion: &Texture) -> Vec<Vec4> {
    let mut numbers = numbers(texture);
    let red = each_texel(occlusion, |rgb| rgb.x);
    numbers
        .par_iter_mut()
        .zip(red)
        .for_each(|(texel, red)| texel.x = red);
    numbers
}

/// Linear colour, and the alpha of another picture of the same size.
pub(crate) fn colour_with(texture: &Texture, alpha: &Texture) -> Vec<Vec4> {
    let mut colours = linear_colours(texture, Weighting::Even);
    match &alpha.texels {
        Texels::Srgb8(texels) => (colours.par_iter_mut().zip(texels.par_iter()))
            .for_each(|(colour, texel)| colour.w = f32::from(texel[3]) * (1.0 / 255.0)),
        Texels::LinearF32(texels) => {
            (colours.par_iter_mut().zip(texels)).for_each(|(colour, texel)| colour.w = texel[3]);
        }
    }
    colours
}

/// Linear base colour times metal, and roughness times metal, by the texels of the base colour.
///
/// Metal comes from the blue of another picture, roughness from its green. Where its texels are smaller, each counts that lies in a
/// texel of the colour; where they are larger, they are mixed.
pub(crate) fn weighted_by_metal(
    (base, alpha): (&Texture, Weighting),
    (map, wrap): (&Texture, [Wrap; 2]),
) -> Vec<Vec4> {
    if let (Texels::Srgb8(colours), Texels::Srgb8(numbers)) = (&base.texels, &map.texels)
        && [base.width, base.height] == [map.width, map.height]
    {
        let texel = |(&[r, g, b, a], &[_, rough, metal, _]): (&[u8; 4], &[u8; 4])| {
            let alpha = match alpha {
                Weighting::Even => 1.0,
                Weighting::ByAlpha => f32::from(a) / 255.0,
            };
            let metal = f32::from(metal) * (1.0 / 255.0);
            let of = |code: u8| LINEAR[usize::from(code)] * alpha * metal;
            Vec4::new(
                of(r),
                of(g),
                of(b),
                f32::from(rough) * (1.0 / 255.0) * metal,
            )
        };
        return colours.par_iter().zip(&**numbers).map(texel).collect();
    }
    let weighted_by_metal: Vec<Vec2> = each_texel(map, |rgb| Vec2::new(rgb.z, rgb.y * rgb.z));
    let ratio = [
        map.width as f32 / base.width as f32,
        map.height as f32 / base.height as f32,
    ];
    let looks = ratio.map(|ratio| ratio.ceil().max(1.0) as usize);
    let mut texels = linear_colours(base, alpha);
    let of_row = |(y, row): (usize, &mut [Vec4])| {
        for (x, texel) in row.iter_mut().enumerate() {
            let mut sum = Vec2::ZERO;
            for look in 0..looks[0] * looks[1] {
                let part = [look % looks[0], look / looks[0]];
                let place = [0, 1].map(|k: usize| {
                    let within = (part[k] as f32 + 0.5) / looks[k] as f32;
                    ([x, y][k] as f32 + within) * ratio[k] - 0.5
                });
                sum += mixed(&weighted_by_metal, ([map.width, map.height], wrap), place);
            }
            let [metal, rough] = (sum / (looks[0] * looks[1]) as f32).to_array();
            *texel = (texel.truncate() * metal).extend(rough);
        }
    };
    texels
        .par_chunks_mut(base.width)
        .enumerate()
        .for_each(of_row);
    texels
}

/// The mix of the four texels around a place, which counts from the middle of the first.
fn mixed(texels: &[Vec2], (size, wrap): ([usize; 2], [Wrap; 2]), place: [f32; 2]) -> Vec2 {
    let first = place.map(f32::floor);
    let share = [place[0] - first[0], place[1] - first[1]];
    let at = |k: usize, next: i32| wrapped(first[k] as i32 + next, size[k], wrap[k]);
    let row = |next: i32| {
        let start = at(1, next) * size[0];
        let left = texels[start + at(0, 0)];
        if share[0] == 0.0 {
            return left;
        }
        left.lerp(texels[start + at(0, 1)], share[0])
    };
    if share[1] == 0.0 {
        return row(0);
    }
    row(0).lerp(row(1), share[1])
}

/// Linear light, premultiplied if it is weighted by alpha.
fn linear_colours(texture: &Texture, alpha: Weighting) -> Vec<Vec4> {
    let weighted = |[r, g, b, a]: [f32; 4]| match alpha {
        Weighting::Even => Vec4::new(r, g, b, 1.0),
        Weighting::ByAlpha => Vec4::new(r * a, g * a, b * a, a),
    };
    match &texture.texels {
        Texels::Srgb8(texels) => texels
            .par_iter()
            .map(|&[r, g, b, a]| {
                let at = |code: u8| LINEAR[usize::from(code)];
                weighted([at(r), at(g), at(b), f32::from(a) / 255.0])
            })
            .collect(),
        Texels::LinearF32(texels) => texels.par_iter().map(|&texel| weighted(texel)).collect(),
    }
}

/// Normals of length 1, halved and moved to 0..=1, and around each the mean square length of the reconstructed normal.
pub(crate) fn normals(texture: &Texture, scale: f32, wrap: [Wrap; 2]) -> Vec<Vec4> {
    let normals = each_texel(texture, |rgb| {
        let [x, y, z] = (rgb * 2.0 - Vec3::ONE).to_array();
        // A texel that points nowhere, as in unused parts of an atlas, is flat.
        Vec3::new(x * scale, y * scale, z)
            .try_normalize()
            .unwrap_or(Vec3::Z)
    });
    let (width, height) = (texture.width, texture.height);
    let mut texels = vec![Vec4::ZERO; normals.len()];
    texels
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, row)| {
            let rows = [y as i32 - 1, y as i32, y as i32 + 1].map(|y| wrapped(y, height, wrap[1]));
            for (x, texel) in row.iter_mut().enumerate() {
                let columns =
                    [x as i32 - 1, x as i32, x as i32 + 1].map(|x| wrapped(x, width, wrap[0]));
                let at = |i: usize, j: usize| normals[rows[j] * width + columns[i]];
                let cells = [(0, 0), (1, 0), (0, 1), (1, 1)];
                let sum: f32 = cells
                    .iter()
                    .map(|&(i, j)| cell([at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]))
                    .sum();
                *texel = (at(1, 1) * 0.5 + Vec3::splat(0.5)).extend(0.25 * sum);
            }
        });
    texels
}

/// Mean square length of the bilinear mix of four normals of length 1.
fn cell([a, b, c, d]: [Vec3; 4]) -> f32 {
    (4.0 + a.dot(b) + c.dot(d) + a.dot(c) + b.dot(d) + 0.5 * (a.dot(d) + b.dot(c))) / 9.0
}

/// A mean normal of a map in tangent space, and the variance that belongs to it.
#[inline(always)]
pub(crate) fn mean_normal(texel: Vec4) -> (Vec3, f32) {
    let mean = texel.truncate() * 2.0 - Vec3::ONE;
    let length2 = texel.w.max(1e-6);
    let variance = ((texel.w - mean.length_squared() - ROUNDING) / length2).max(0.0);
    (mean, variance)
}

/// The variance within a square of `side` texels where it is no larger than a texel: normals change evenly there.
#[inline(always)]
pub(crate) fn variance_within(texel: Vec4, side2: f32) -> f32 {
    0.5 * (1.0 - texel.w - ROUNDING).max(0.0) * side2.min(1.0)
}

fn each_texel<T: Send>(texture: &Texture, texel: impl Fn(Vec3) -> T + Sync) -> Vec<T> {
    match &texture.texels {
        Texels::Srgb8(texels) => texels
            .par_iter()
            .map(|&[r, g, b, _]| {
                texel(Vec3::new(f32::from(r), f32::from(g), f32::from(b)) * (1.0 / 255.0))
            })
            .collect(),
        // Pictures of 16 bits were taken for sRGB when they were read.
        Texels::LinearF32(texels) => texels
            .par_iter()
            .map(|&[r, g, b, _]| texel(Vec3::from([r, g, b].map(srgb_from_linear))))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_square_length_of_a_mix_is_its_integral() {
        let corners = [
            Vec3::X,
            Vec3::Y,
            Vec3::new(0.6, 0.0, 0.8),
            Vec3::new(0.0, -0.8, 0.6),
        ];
        let steps = 400;
        let mut sum = 0.0;
        for k in 0..steps * steps {
            let place = |k: usize| (k as f32 + 0.5) / steps as f32;
            let (s, t) = (place(k % steps), place(k / steps));
            let top = corners[0].lerp(corners[1], s);
            let low = corners[2].lerp(corners[3], s);
            sum += f64::from(top.lerp(low, t).length_squared());
        }
        let mean = sum / (steps * steps) as f64;
        assert!((f64::from(cell(corners)) - mean).abs() < 1e-5, "{mean}");
    }
}
