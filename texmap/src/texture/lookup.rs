//! Looking a texture up at a position: the splats of its texels, summed there.
//!
//! Each texel is a splat with the texture's own reconstruction kernel (tent or box) in its tangent plane. At a
//! position of the screen whose texture coordinates are known exactly, the splats that reach it are the two by two
//! texels around: their sum is the bilinear look-up. A sub-pixel that holds several texels looks coarser levels up
//! (`lookup_plan`), or, near the border of a chart, finer ones on this side of it (`at_borders`).

use glam::Vec4;
use resample_mesh::scene::{Magnify, Wrap};

use crate::prepare::level::wrapped;
use crate::prepare::mip::{Level, Pyramid};

/// Most look-ups along the longer axis of a sub-pixel. Sub-pixels longer than that are sharpened no further.
pub(crate) const MAX_LOOKUPS: f32 = 8.0;

/// Texels of the level across a sub-pixel. With 1.4 dense meshes are drawn a twentieth faster and real ones lose up to
/// 0.3 dB; with 1 a hall of many columns loses 0.2 dB.
pub(crate) const TEXELS_ACROSS: f32 = 2.0;

/// How far a mix of levels sees beyond a bilinear look-up, in texels of the coarser one less one: three texels of the
/// next finer level on either side of each texel's own half, level by level, and the bilinear look-up's own reach.
pub(crate) const LEVEL_REACH: f32 = 2.5;

/// The texture's own reconstruction of the full texture at (u, v) (texels).
#[inline(always)]
pub(crate) fn reconstructed(pyramid: &Pyramid, u: f32, v: f32) -> Vec4 {
    match pyramid.magnify {
        Magnify::Nearest => nearest(&pyramid.levels[0], pyramid.wrap, u, v),
        Magnify::Linear => bilinear(&pyramid.levels[0], pyramid.wrap, u, v),
    }
}

/// The texel that holds (u, v) (texels of this level).
#[inline(always)]
pub(crate) fn nearest(level: &Level, wrap: [Wrap; 2], u: f32, v: f32) -> Vec4 {
    // Saturating casts: what lies beyond every integer is at the border.
    level.texel(u.floor() as i32, v.floor() as i32, wrap)
}

/// The mix of the four texels around (u, v) (texels of this level).
#[inline(always)]
pub(crate) fn bilinear(level: &Level, wrap: [Wrap; 2], u: f32, v: f32) -> Vec4 {
    let (u, v) = (u - 0.5, v - 0.5);
    let (u0, v0) = (u.floor(), v.floor());
    let (fu, fv) = (u - u0, v - v0);
    let (i, j) = (u0 as i32, v0 as i32);
    let [width, height] = level.size;
    // Saturated or wrapped only where the four texels are not all inside.
    let inside = (i as usize) < width - 1 && (j as usize) < height - 1;
    let (columns, rows) = if inside {
        (
            [i as usize, i as usize + 1],
            [j as usize * level.stride, (j as usize + 1) * level.stride],
        )
    } else {
        let column = |i: i32| wrapped(i, width, wrap[0]);
        (
            [column(i), column(i.saturating_add(1))],
            [
                level.row_start(j, wrap[1]),
                level.row_start(j.saturating_add(1), wrap[1]),
            ],
        )
    };
    let along = |row: usize| {
        let [left, right] = [columns[0], columns[1]].map(|column| level.texels.at(row + column));
        left.lerp(right, fu)
    };
    along(rows[0]).lerp(along(rows[1]), fv)
}

/// The mix of the bilinear look-ups in the two levels beside `lod` (0 is the full texture).
#[inline(always)]
pub(crate) fn trilinear(pyramid: &Pyramid, lod: f32, u: f32, v: f32) -> Vec4 {
    let last = pyramid.levels.len() - 1;
    let lod = lod.clamp(0.0, last as f32);
    let first = lod as usize;
    let share = lod - first as f32;
    let at = |level: usize| {
        let level = &pyramid.levels[level.min(last)];
        bilinear(level, pyramid.wrap, u * level.scale[0], v * level.scale[1])
    };
    let mut out = at(first);
    if share > 0.0 {
        out = out.lerp(at(first + 1), share);
    }
    out
}
