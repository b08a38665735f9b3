//! Texture mapping by one look-up a triangle and pixel: the paper's points, and backward methods for comparison.
//!
//! Textures are looked up once for each triangle of a pixel, which counts by its coverage. Pixels with something translucent are left to
//! sub-pixels. The default method uses nothing of this.

use glam::Vec4;
use resample_core::simd::Vectors;

use crate::options::Method;
use crate::screen::TILE_WIDTH;
use crate::texture::ellipse::{Gathered, Laid, PixelOnTexture, TexelEllipse};
use crate::texture::lookup::{nearest, reconstructed, trilinear};
use crate::texture::points::{covariance_with, gather_by_pixel, gather_minified};
use crate::tile::light::{LightBatch, Normals};
use crate::tile::points::{DirectPixels, Gather, PixelLookUps, pixel_colour, pixel_sample};
use crate::tile::task::{Tile, centre_px};
use crate::tile::visible::{Cell, Cells, Visible};
use crate::visibility::edges::Edges;
use crate::visibility::fragments::{Fragment, Fragments};

/// The stage that takes the place of points in a method; `None` in the default one.
pub(crate) fn pixel_look_ups(method: Method) -> Option<PixelLookUps> {
    (method != Method::Hybrid).then_some(look_up)
}

/// Looks the texture up for each triangle of each pixel; leaves pixels with something translucent to sub-pixels.
fn look_up<'a>(
    tile: &Tile,
    (visible, cells, edges): (&Visible, &Cells, &Edges),
    direct: &'a mut DirectPixels,
) -> &'a DirectPixels {
    let method = tile.frame.options.method;
    let gather = gather_of(method);
    let seen_by = (tile.frame.filter, tile.frame.simd);
    let mut laid = Laid::default();
    let mut light = LightBatch::default();
    let (mut by_row, mut fragments) = (Fragments::default(), Vec::new());
    direct.fill(cells, |rgba, pixel, cell| {
        match cell {
            Cell::Layered => return false,
            Cell::Plane(id) => {
                fragments.clear();
                fragments.push(Fragment {
                    id,
                    weight: 1.0,
                    at: centre_px(pixel),
                });
            }
            _ => {
                let shown = (&visible.subpixels.ids[..], edges);
                by_row.collect(seen_by, shown, pixel, &mut fragments);
            }
        }
        let place = pixel[1] * TILE_WIDTH + pixel[0];
        let mut sum = Vec4::ZERO;
        for fragment in &fragments {
            let Some(surface) = &visible.surfaces[fragment.id as usize] else {
                continue;
            };
            if let Some(maps) = &surface.maps {
                let gather = (tile, Some(gather));
                if let Some(sample) = pixel_sample(gather, surface, fragment.at, &mut laid) {
                    let normals = Normals::new(&sample, maps);
                    let weighted = (place, fragment.weight);
                    light.add(tile, weighted, (&sample, &normals), rgba);
                }
                continue;
            }
            // Where no texel is near, as between the points of a magnified texture, nothing is seen.
            let colour =
                pixel_colour((tile, gather), surface, fragment.at, &mut laid).unwrap_or(Vec4::ZERO);
            sum += fragment.weight * colour;
        }
        rgba[place] = (Vec4::from(rgba[place]) + sum).to_array();
        true
    });
    light.finish(tile, &mut direct.rgba);
    match method {
        Method::Point => direct.laid = laid,
        _ => direct.looked_up = laid.points,
    }
    direct
}

// Look-ups of a texture at one pixel: filtered as renderers usually do, or its texels as plain points.
//
// Nearest, bilinear, trilinear as OpenGL specifies them; EWA in a mip pyramid as Heckbert (1989) describes it and
// renderers carry it out: the ellipse of one pixel, widened by a texel, at most 16 times longer than wide, in the two
// levels whose texels are beside the ellipse's shorter axis.

/// How much longer than wide an ellipse may be.
const MAX_ANISOTROPY: f32 = 16.0;

/// The Gaussian of the ellipse is cut at two standard deviations (one pixel), where it is exp(-2).
const EWA_CUT: f32 = 2.0;

/// A renderer's ellipse is widened by one texel in each direction: two standard deviations, so a variance of 1/4.
const WIDENED: f32 = 0.25;

/// The look-up of a method.
fn gather_of(method: Method) -> Gather {
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
    Gathered::of_points(
        nearest(&pyramid.levels[0], pyramid.wrap, pixel.at.u, pixel.at.v),
        1,
    )
}

/// Bilinear, or nearest where the material says so.
fn look_up_bilinear(pixel: &PixelOnTexture) -> Gathered {
    Gathered::of_points(reconstructed(pixel.pyramid, pixel.at.u, pixel.at.v), 4)
}

/// Bilinear in two levels, mixed: the level follows the pixel's longer side.
fn look_up_trilinear(pixel: &PixelOnTexture) -> Gathered {
    let [ux, uy, vx, vy] = pixel.at.jacobian;
    let lod = ux.hypot(vx).max(uy.hypot(vy)).log2();
    if !(lod > 0.0) {
        return look_up_bilinear(pixel);
    }
    Gathered::of_points(trilinear(pixel.pyramid, lod, pixel.at.u, pixel.at.v), 8)
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
        out.laid += next.laid;
        out.rgba = out.rgba.lerp(next.rgba, share);
    }
    out
}

fn ewa_in_level(pixel: &PixelOnTexture, index: usize, simd: Vectors) -> Gathered {
    let pyramid = pixel.pyramid;
    let level = &pyramid.levels[index];
    if level.size == [1, 1] {
        return Gathered::of_points(level.texels.at(0), 1);
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
