//! Minified texels as points: the texels of one surface around a pixel, gathered by the pixel's Gaussian.
//!
//! The picture is the pixel's Gaussian applied to the texture as its own kernel (a tent, say) reconstructs it. So a
//! texel at offset d from the pixel counts by Gaussian * kernel at d, times the area of the screen that it stands for.
//! That product is taken as a Gaussian whose covariance is the sum of the two (in texels: J J^T / 4 plus the
//! kernel's variance), corrected in fourth order for what a tent is not a Gaussian: an Edgeworth series. A coarser
//! level counts the same way, with the variance and the fourth cumulant of its own filter taken off.
//!
//! Limits: a single plane; the Gaussian is cut at [`CUT`] standard deviations.

use glam::Vec4;
use resample_core::simd::Vectors;
use resample_mesh::scene::Magnify;

use crate::prepare::mip::{Level, Pyramid};
use crate::texture::ellipse::{
    Covariance, Gathered, Laid, MOST_TOGETHER, PIXEL_VARIANCE, PixelOnTexture, TexelEllipse,
};
use crate::texture::magnified;

/// Where the Gaussian is cut, standard deviations. The covariance is widened before by what the cut takes away.
const CUT: f32 = 3.25;

/// Variance of a plane Gaussian that is cut there, over its variance before: 1 - t / (e^t - 1) with t = CUT^2 / 2.
const KEPT: f32 = 0.973_0;

/// A level is coarse enough only while the texels' Gaussian keeps this variance (texels of that level) along its
/// shorter axis: the lattice of texels then shows through by 2 exp(-2 pi^2 / 2) = 1e-4.
const LEAST_VARIANCE: f32 = 0.5;

/// Most texels that one pixel gathers from one surface. A coarser level is taken where it would be more, at a loss of
/// sharpness across the direction of strong foreshortening.
const MAX_TEXELS: f32 = 1024.0;

/// Gathers the texels around a pixel; `None` where they are many and magnified along one axis.
pub(crate) fn gather(pixel: &PixelOnTexture, simd: Vectors) -> Option<Gathered> {
    if is_minified(pixel) {
        return gather_minified(pixel, simd);
    }
    let mut colours = [Vec4::ZERO];
    let laid = magnified::gather(pixel, &[pixel.pyramid], simd, &mut colours)?;
    let [rgba] = colours;
    Some(Gathered { rgba, laid })
}

/// Returns true if the texture is minified at a pixel, by more than points need.
pub(crate) fn is_minified(pixel: &PixelOnTexture) -> bool {
    let of_full = covariance(pixel, &pixel.pyramid.levels[0]);
    of_full.eigenvalues()[0] >= LEAST_VARIANCE
}

/// The texels around a pixel by its Gaussian alone, without the texture's kernel: `None` where no texel is near.
pub(crate) fn gather_by_pixel(pixel: &PixelOnTexture, simd: Vectors) -> Option<Gathered> {
    let level = &pixel.pyramid.levels[0];
    let plain = covariance_with(pixel, level, [0.0; 2]);
    TexelEllipse::new(pixel, level.scale, plain.scaled(1.0 / KEPT), CUT)?.gather_level(
        level,
        pixel.pyramid.wrap,
        simd,
    )
}

/// Gathers the texels around a pixel; `None` where the texture is magnified, or nearly: its texels are splats there.
pub(crate) fn gather_minified(pixel: &PixelOnTexture, simd: Vectors) -> Option<Gathered> {
    let pyramid = pixel.pyramid;
    let (index, covariance) = coarsest(pixel)?;
    let level = &pyramid.levels[index];
    if level.size == [1, 1] {
        return Some(Gathered::of_points(level.texels.at(0), 1));
    }
    ellipse(pixel, level, covariance)?.gather_level(level, pyramid.wrap, simd)
}

/// As [`gather`], of textures that are [alike](Pyramid::is_alike) and lie as the pixel's own does: their colours, and
/// how many texels were looked at.
pub(crate) fn gather_together(
    pixel: &PixelOnTexture,
    pyramids: &[&Pyramid],
    simd: Vectors,
    colours: &mut [Vec4],
) -> Option<Laid> {
    let Some((index, covariance)) = coarsest(pixel) else {
        return magnified::gather(pixel, pyramids, simd, colours);
    };
    let own = &pixel.pyramid.levels[index];
    let mut levels = [own; MOST_TOGETHER];
    let levels = &mut levels[..pyramids.len()];
    for (level, pyramid) in levels.iter_mut().zip(pyramids) {
        *level = &pyramid.levels[index];
    }
    let count = levels.len() as u64;
    let points = |points| Laid { points, splats: 0 };
    if own.size == [1, 1] {
        for (colour, level) in colours.iter_mut().zip(levels) {
            *colour = level.texels.at(0);
        }
        return Some(points(count));
    }
    let ellipse = ellipse(pixel, own, covariance)?;
    let texels = ellipse.gather_levels(levels, pixel.pyramid.wrap, simd, colours)?;
    Some(points(count * u64::from(texels)))
}

/// The footprint in a level.
fn ellipse(pixel: &PixelOnTexture, level: &Level, covariance: Covariance) -> Option<TexelEllipse> {
    let kernel = kernel(pixel.pyramid)[1];
    let fourth = |k: usize| (kernel * level.scale[k].powi(4) - level.kappa[k]) / 24.0;
    let mut ellipse = TexelEllipse::new(pixel, level.scale, covariance.scaled(1.0 / KEPT), CUT)?;
    ellipse.kappa = [fourth(0), fourth(1)];
    Some(ellipse)
}

/// Variance, in squared texels, and fourth cumulant of the kernel that reconstructs the full texture.
fn kernel(pyramid: &Pyramid) -> [f32; 2] {
    match pyramid.magnify {
        // A box of one texel.
        Magnify::Nearest => [1.0 / 12.0, -1.0 / 120.0],
        // A tent is two boxes after one another, and cumulants add.
        Magnify::Linear => [1.0 / 6.0, -1.0 / 60.0],
    }
}

/// Pixel and kernel covariance in one level, less what its filter has done already.
fn covariance(pixel: &PixelOnTexture, level: &Level) -> Covariance {
    let variance = kernel(pixel.pyramid)[0];
    let rest = |k: usize| level.scale[k] * level.scale[k] * variance - level.variance[k];
    covariance_with(pixel, level, [rest(0), rest(1)])
}

/// The pixel's covariance in a level's texels, and more along u and v.
pub(crate) fn covariance_with(pixel: &PixelOnTexture, level: &Level, more: [f32; 2]) -> Covariance {
    let [su, sv] = level.scale;
    let [ux, uy, vx, vy] = pixel.at.jacobian;
    Covariance([
        su * su * PIXEL_VARIANCE * (ux * ux + uy * uy) + more[0],
        su * sv * PIXEL_VARIANCE * (ux * vx + uy * vy),
        sv * sv * PIXEL_VARIANCE * (vx * vx + vy * vy) + more[1],
    ])
}

/// The coarsest level whose texels still see the footprint as smooth, or a coarser one if that holds too many, and the
/// covariance there; `None` where the full texture is too coarse.
fn coarsest(pixel: &PixelOnTexture) -> Option<(usize, Covariance)> {
    let of_full = covariance(pixel, &pixel.pyramid.levels[0]);
    if !(of_full.eigenvalues()[0] >= LEAST_VARIANCE) {
        return None;
    }
    let mut chosen = (0, of_full);
    for (index, level) in pixel.pyramid.levels.iter().enumerate().skip(1) {
        let next = covariance(pixel, level);
        let texels = std::f32::consts::PI * CUT * CUT * chosen.1.determinant().max(0.0).sqrt();
        if !(next.eigenvalues()[0] >= LEAST_VARIANCE || texels > MAX_TEXELS) {
            break;
        }
        chosen = (index, next.widened(LEAST_VARIANCE));
    }
    Some(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::texel_use::TexelUse;
    use crate::project::surface::UvAt;
    use resample_core::simd::SimdLevel;
    use resample_mesh::scene::{Texels, Texture, Wrap};

    /// A texture of 128x64 numbers without order, in 8 bits or in floating point.
    fn noise(seed: u32, eight_bits: bool) -> Pyramid {
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let texels: Vec<[u8; 4]> = (0..128 * 64).map(|_| [(); 4].map(|()| random())).collect();
        let float = |texel: &[u8; 4]| texel.map(|v| f32::from(v) / 100.0);
        let texels = if eight_bits {
            Texels::Srgb8(texels.into())
        } else {
            Texels::LinearF32(texels.iter().map(float).collect())
        };
        let texture = Texture {
            name: String::new(),
            width: 128,
            height: 64,
            texels,
        };
        let wrap = [Wrap::Repeat, Wrap::Clamp];
        Pyramid::new((&[texture], 0), TexelUse::Numbers, wrap, Magnify::Linear)
    }

    #[test]
    fn textures_gathered_together_are_those_gathered_alone_to_the_bit() {
        let pyramids = [noise(1, true), noise(2, false), noise(3, true)];
        let together: Vec<&Pyramid> = pyramids.iter().collect();
        // Minified slightly, much, along one axis, beyond the last level; magnified, and too long for that.
        let jacobians = [
            [1.9, 0.3, -0.2, 1.7],
            [9.0, 2.0, 1.0, 7.0],
            [40.0, 3.0, 0.0, 1.8],
            [900.0, 0.0, 0.0, 900.0],
            [0.5, 0.0, 0.0, 0.5],
            [0.1, 0.0, 0.0, 9.0],
        ];
        for (case, jacobian) in jacobians.into_iter().enumerate() {
            for simd in SimdLevel::ALL.map(SimdLevel::resolve) {
                let on = |pyramid| PixelOnTexture {
                    pyramid,
                    at: UvAt {
                        u: 126.3,
                        v: 3.2,
                        jacobian,
                    },
                    over_w_slope: [0.001, -0.0015],
                };
                let mut colours = [Vec4::ZERO; 3];
                let found = gather_together(&on(together[0]), &together, simd, &mut colours);
                assert_eq!(found.is_some(), case < 5, "case {case}");
                let alone = together.iter().map(|p| gather(&on(p), simd));
                let mut texels = Laid::default();
                for (colour, alone) in colours.into_iter().zip(alone.flatten()) {
                    let bits = |colour: Vec4| colour.to_array().map(f32::to_bits);
                    assert_eq!(bits(colour), bits(alone.rgba), "case {case}");
                    texels += alone.laid;
                }
                let found = found.unwrap_or_default();
                assert_eq!(found.points, texels.points, "case {case}");
                assert_eq!(found.splats, texels.splats, "case {case}");
            }
        }
    }
}
