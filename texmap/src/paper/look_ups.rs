//! Look-ups of a texture at one pixel: filtered as renderers usually do, or its texels as plain points.
//!
//! Nearest, bilinear, trilinear as OpenGL specifies them; EWA in a mip pyramid as Heckbert (1989) describes it and
//! renderers carry it out: the ellipse of one pixel, widened by a texel, at most 16 times longer than wide, in the two
//! levels whose texels are beside the ellipse's shorter axis.

use resample_core::simd::Vectors;

use crate::options::Method;
use crate::texture::ellipse::TexelEllipse;
use crate::texture::ellipse::{Gathered, PixelOnTexture};
use crate::texture::lookup::{nearest, reconstructed, trilinear};
use crate::texture::points::{covariance_with, gather_by_pixel, gather_minified};
use crate::tile::pixel_textures::Gather;

/// How much longer than wide an ellipse may be.
const MAX_ANISOTROPY: f32 = 16.0;

/// The Gaussian of the ellipse is cut at two standard deviations (one pixel), where it is exp(-2).
const EWA_CUT: f32 = 2.0;

/// A renderer's ellipse is widened by one texel in each direction: two standard deviations, so a variance of 1/4.
const WIDENED: f32 = 0.25;

/// The look-up of a method.
pub(super) fn gather_of(method: Method) -> Gather {
    match method {
        Method::Hybrid => gather_minified,
        Method::Point => gather_points,
        Method::BackwardNearest => |pixel, _| Some(look_up_nearest(pixel)),
        Method::BackwardBilinear => |pixel, _| Some(look_up_bilinear(pixel)),
        Method::BackwardTrilinear => |pixel, _| Some(look_up_trilinear(pixel)),
        Method::BackwardEwa => |pixel, simd| Some(look_up_ewa(pixel, simd)),
    }
}

/// Texels as plain points, each with the pixel's Gaussian alone: `None` where no texel is near (a hole).
fn gather_points(pixel: &PixelOnTexture, simd: Vectors) -> Option<Gathered> {
    // A hole is a pixel that no texel reaches; minified textures have none, so that the same levels serve.
    gather_minified(pixel, simd).or_else(|| gather_by_pixel(pixel, simd))
}

/// The texel nearest to the pixel's centre.
fn look_up_nearest(pixel: &PixelOnTexture) -> Gathered {
    let pyramid = pixel.pyramid;
    Gathered {
        rgba: nearest(&pyramid.levels[0], pyramid.wrap, pixel.at.u, pixel.at.v),
        texels: 1,
    }
}

/// Bilinear, or nearest where the material says so.
fn look_up_bilinear(pixel: &PixelOnTexture) -> Gathered {
    Gathered {
        rgba: reconstructed(pixel.pyramid, pixel.at.u, pixel.at.v),
        texels: 4,
    }
}

/// Bilinear in two levels, mixed: the level follows the pixel's longer side.
fn look_up_trilinear(pixel: &PixelOnTexture) -> Gathered {
    let [ux, uy, vx, vy] = pixel.at.jacobian;
    let lod = ux.hypot(vx).max(uy.hypot(vy)).log2();
    if !(lod > 0.0) {
        return look_up_bilinear(pixel);
    }
    Gathered {
        rgba: trilinear(pixel.pyramid, lod, pixel.at.u, pixel.at.v),
        texels: 8,
    }
}

/// Elliptical weighted average.
fn look_up_ewa(pixel: &PixelOnTexture, simd: Vectors) -> Gathered {
    let pyramid = pixel.pyramid;
    let full = covariance_with(pixel, &pyramid.levels[0], [0.0; 2]);
    // Standard deviations are half a pixel, so that the axes of one pixel are twice as long.
    let [short, long] = full
        .eigenvalues()
        .map(|variance| 2.0 * variance.max(0.0).sqrt());
    let short = short.max(long / MAX_ANISOTROPY);
    if !(short > 0.0) {
        return look_up_bilinear(pixel);
    }
    let last = (pyramid.levels.len() - 1) as f32;
    let lod = short.log2().clamp(0.0, last);
    let (first, share) = (lod as usize, lod.fract());
    let mut out = ewa_in_level(pixel, first, simd);
    if share > 0.0 {
        let next = ewa_in_level(pixel, first + 1, simd);
        out.texels += next.texels;
        out.rgba = out.rgba.lerp(next.rgba, share);
    }
    out
}

fn ewa_in_level(pixel: &PixelOnTexture, index: usize, simd: Vectors) -> Gathered {
    let pyramid = pixel.pyramid;
    let level = &pyramid.levels[index];
    if level.size == [1, 1] {
        return Gathered {
            rgba: level.texels.at(0),
            texels: 1,
        };
    }
    let plain = covariance_with(pixel, level, [0.0; 2]);
    let [_, large] = plain.eigenvalues();
    let mut covariance = plain.widened(large / (MAX_ANISOTROPY * MAX_ANISOTROPY));
    covariance.0[0] += WIDENED;
    covariance.0[2] += WIDENED;
    let affine = PixelOnTexture {
        over_w_slope: [0.0; 2],
        ..*pixel
    };
    let gathered =
        TexelEllipse::new(&affine, level.scale, covariance, EWA_CUT).and_then(|mut ellipse| {
            ellipse.floor = (-0.5 * EWA_CUT * EWA_CUT).exp();
            ellipse.gather_level(level, pyramid.wrap, simd)
        });
    gathered.unwrap_or_else(|| look_up_bilinear(pixel))
}
