//! The pictures of a material, the use of their texels, and the maps of light as texels.
//!
//! Takes a scene and a material; gives the pictures of its colours and of its maps of light. Two things follow from more than one picture:
//! occlusion that is laid as roughness and metal are, and as large, becomes the red of that map, which is looked up anyway; and where
//! metal varies, a further map holds base colour times metal and roughness times metal. Without it a footprint would know two
//! means, but not which of the colours is the metal's.

use std::collections::HashMap;
use std::ops::Range;

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

/// Fills some rows of texels, by their numbers.
pub(crate) type Rows<'a> = Box<dyn Fn(Range<usize>, &mut [Vec4]) + Sync + 'a>;

/// Red, green, blue as in the file, 0..=1, and the square of green.
pub(crate) fn numbers(texture: &Texture) -> Rows<'_> {
    Box::new(|rows, out| {
        each_texel(texture, rows, |at, rgb| out[at] = rgb.extend(rgb.y * rgb.y));
    })
}

/// As [`numbers`], with the red of another picture of the same size.
pub(crate) fn numbers_with<'a>(texture: &'a Texture, occlusion: &'a Texture) -> Rows<'a> {
    let numbers = numbers(texture);
    Box::new(move |rows, out| {
        numbers(rows.clone(), out);
        each_texel(occlusion, rows, |at, rgb| out[at].x = rgb.x);
    })
}

/// Linear colour, and the alpha of another picture of the same size.
pub(crate) fn colour_with<'a>(texture: &'a Texture, alpha: &'a Texture) -> Rows<'a> {
    Box::new(|rows, out| {
        let texels = rows.start * texture.width..rows.end * texture.width;
        linear_colours(texture, rows, Weighting::Even, out);
        match &alpha.texels {
            Texels::Srgb8(of_alpha) => {
                for (colour, texel) in out.iter_mut().zip(&of_alpha[texels]) {
                    colour.w = f32::from(texel[3]) * (1.0 / 255.0);
                }
            }
            Texels::LinearF32(of_alpha) => {
                for (colour, texel) in out.iter_mut().zip(&of_alpha[texels]) {
                    colour.w = texel[3];
                }
            }
        }
    })
}

/// Linear base colour times metal, and roughness times metal, by the texels of the base colour.
///
/// Metal comes from the blue of another picture, roughness from its green. Where its texels are smaller, each counts that lies in a
/// texel of the colour; where they are larger, they are mixed.
pub(crate) fn weighted_by_metal<'a>(
    (base, alpha): (&'a Texture, Weighting),
    (map, wrap): (&'a Texture, [Wrap; 2]),
) -> Rows<'a> {
    if [base.width, base.height] == [map.width, map.height] {
        return Box::new(move |rows, out| {
            linear_colours(base, rows.clone(), alpha, out);
            each_texel(map, rows, |at, rgb| {
                out[at] = (out[at].truncate() * rgb.z).extend(rgb.y * rgb.z);
            });
        });
    }
    let mut weighted_by_metal = vec![Vec2::ZERO; map.width * map.height];
    let of_row = |(y, row): (usize, &mut [Vec2])| {
        each_texel(map, y..y + 1, |at, rgb| {
            row[at] = Vec2::new(rgb.z, rgb.y * rgb.z)
        });
    };
    (weighted_by_metal.par_chunks_mut(map.width).enumerate()).for_each(of_row);
    let ratio = [
        map.width as f32 / base.width as f32,
        map.height as f32 / base.height as f32,
    ];
    let looks = ratio.map(|ratio| ratio.ceil().max(1.0) as usize);
    Box::new(move |rows, out| {
        linear_colours(base, rows.clone(), alpha, out);
        for (at, texel) in out.iter_mut().enumerate() {
            let [x, y] = [at % base.width, rows.start + at / base.width];
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
    })
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

/// Linear light of some rows, premultiplied if it is weighted by alpha.
fn linear_colours(texture: &Texture, rows: Range<usize>, alpha: Weighting, out: &mut [Vec4]) {
    let weighted = |[r, g, b, a]: [f32; 4]| match alpha {
        Weighting::Even => Vec4::new(r, g, b, 1.0),
        Weighting::ByAlpha => Vec4::new(r * a, g * a, b * a, a),
    };
    let texels = rows.start * texture.width..rows.end * texture.width;
    match &texture.texels {
        Texels::Srgb8(of_texture) => {
            let table = &*LINEAR;
            for (out, &[r, g, b, a]) in out.iter_mut().zip(&of_texture[texels]) {
                let at = |code: u8| table[usize::from(code)];
                *out = weighted([at(r), at(g), at(b), f32::from(a) / 255.0]);
            }
        }
        Texels::LinearF32(of_texture) => {
            for (out, &texel) in out.iter_mut().zip(&of_texture[texels]) {
                *out = weighted(texel);
            }
        }
    }
}

/// Normals of length 1, halved and moved to 0..=1, and around each the mean square length of the reconstructed normal.
pub(crate) fn normals(texture: &Texture, scale: f32, wrap: [Wrap; 2]) -> Rows<'_> {
    let (width, height) = (texture.width, texture.height);
    let columns = move |x: i32| wrapped(x, width, wrap[0]);
    Box::new(move |rows, out| {
        // From the row above the first to that below the last.
        let mut around = Vec::with_capacity((rows.len() + 2) * width);
        for y in rows.start as i32 - 1..=rows.end as i32 {
            let y = wrapped(y, height, wrap[1]);
            each_texel(texture, y..y + 1, |_, rgb| around.push(normal(rgb, scale)));
        }
        // From the column before the first on: the square between a texel, the next, and those below.
        let mut cells = Vec::with_capacity((rows.len() + 1) * (width + 1));
        for row in around
            .chunks_exact(width)
            .zip(around[width..].chunks_exact(width))
        {
            let (above, below) = row;
            cells.extend((-1..width as i32).map(|x| {
                let (left, right) = (columns(x), columns(x + 1));
                cell([above[left], above[right], below[left], below[right]])
            }));
        }
        for (y, row) in out.chunks_exact_mut(width).enumerate() {
            let own = &around[(y + 1) * width..];
            let [above, below] = [y, y + 1].map(|y| &cells[y * (width + 1)..][..=width]);
            for (texel, (normal, cells)) in row
                .iter_mut()
                .zip(own.iter().zip(above.windows(2).zip(below.windows(2))))
            {
                let sum = cells.0[0] + cells.0[1] + cells.1[0] + cells.1[1];
                *texel = (*normal * 0.5 + Vec3::splat(0.5)).extend(0.25 * sum);
            }
        }
    })
}

/// The normal of a texel, of length 1.
fn normal(rgb: Vec3, scale: f32) -> Vec3 {
    let [x, y, z] = (rgb * 2.0 - Vec3::ONE).to_array();
    // A texel that points nowhere, as in unused parts of an atlas, is flat.
    let normal = Vec3::new(x * scale, y * scale, z).try_normalize();
    normal.unwrap_or(Vec3::Z)
}

/// Mean square length of the bilinear mix of four normals of length 1.
fn cell([a, b, c, d]: [Vec3; 4]) -> f32 {
    // The first product is that of the four pairs of neighbours.
    (4.0 + (a + d).dot(b + c) + 0.5 * (a.dot(d) + b.dot(c))) * (1.0 / 9.0)
}

/// A mean normal of a map in tangent space, and the variance that belongs to it.
#[inline(always)]
pub(crate) fn mean_normal(texel: Vec4) -> (Vec3, f32) {
    let mean = texel.truncate() * 2.0 - Vec3::ONE;
    let length2 = texel.w.max(1e-6);
    let variance = ((texel.w - mean.length_squared() - ROUNDING) / length2).max(0.0);
    (mean, variance)
}

/// The part of the variance within a texel that widens the lobe at a single place. Single places vary as much as all normals do, so that a wider lobe blurs
/// twice; but a few places miss the rarest highlights. With 0.1 glossy random bumps are 26 to 33 dB from their truth, with 0 they are 26 to 32, with 0.2 25
/// to 33, and with 0.5 22 to 30.
const WITHIN: f32 = 0.1;

/// The variance to give a place that stands for a square of `side` texels, which is no larger than a texel.
#[inline(always)]
pub(crate) fn variance_within(texel: Vec4, side2: f32) -> f32 {
    WITHIN * (1.0 - texel.w - ROUNDING).max(0.0) * side2.min(1.0)
}

/// The variance under a pixel of `side` texels for which a magnified map is filtered.
///
/// Of normals that vary by V from texel to texel a bilinear map keeps 4/9 V, the rest is what `texel` lacks in length: 5/9 V. Along each axis its slope has the
/// mean square 4/3 V, and the pixel's Gaussian the variance side^2 / 4, so that 6/5 of the lack times side^2 vary under small pixels. Under one of a
/// whole texel the mean normal keeps 0.19 V, and 0.46 of the lack vary.
#[inline(always)]
pub(crate) fn variance_magnified(texel: Vec4, side2: f32) -> f32 {
    (1.0 - texel.w - ROUNDING).max(0.0) * 1.2 * side2 / (1.0 + 1.63 * side2)
}

/// Calls a function for every texel of some rows, with its number among them and its numbers as in the file, 0..=1.
fn each_texel(texture: &Texture, rows: Range<usize>, mut texel: impl FnMut(usize, Vec3)) {
    let texels = rows.start * texture.width..rows.end * texture.width;
    match &texture.texels {
        Texels::Srgb8(of_texture) => {
            for (at, &[r, g, b, _]) in of_texture[texels].iter().enumerate() {
                let rgb = Vec3::new(f32::from(r), f32::from(g), f32::from(b));
                texel(at, rgb * (1.0 / 255.0));
            }
        }
        // Pictures of 16 bits were taken for sRGB when they were read.
        Texels::LinearF32(of_texture) => {
            for (at, &[r, g, b, _]) in of_texture[texels].iter().enumerate() {
                texel(at, Vec3::from([r, g, b].map(srgb_from_linear)));
            }
        }
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
