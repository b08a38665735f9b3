//! The maps of light as texels: numbers as they are in the file, and normals with what their means forget.
//!
//! Roughness comes with its square, so that a footprint knows its variance. A normal map is reconstructed between its
//! texels and then made one long; its mean over a footprint is shorter than one by the variance of its normals, and by what
//! reconstruction itself takes away. So a fourth number holds how long the reconstructed normal is around the texel, mean square: the
//! variance is that number's mean less the square of the mean normal (Toksvig 2005, without his bias).

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use resample_core::image::srgb_from_linear;
use resample_mesh::scene::{Texels, Texture, Wrap};

use crate::prepare::wrap::wrapped;

/// Rounding of means of normals kept in 16 bits: variances below count as none.
const ROUNDING: f32 = 1e-4;

/// Red, green, blue as in the file, 0..=1, and the square of green.
pub(crate) fn numbers(texture: &Texture) -> Vec<Vec4> {
    each_texel(texture, |rgb| rgb.extend(rgb.y * rgb.y))
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
