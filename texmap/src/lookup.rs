//! Looking a texture up at a position: the splats of its texels, summed there.
//!
//! Each texel is a splat with the texture's own reconstruction kernel (tent or box) in its tangent plane. At a
//! position of the screen whose texture coordinates are known exactly, the splats that reach it are the two by two
//! texels around: their sum is the bilinear look-up. [`small_footprint`] serves a sub-pixel that holds several
//! texels: from a coarser level, or, near the border of a chart, from finer ones on this side of it.

use glam::Vec4;

use crate::charts::Borders;
use crate::mip::{Level, Pyramid};
use crate::scene::{Magnify, Wrap};
use crate::surface::UvAt;
use crate::wrapped::wrapped;

/// Most look-ups along the longer axis of a sub-pixel. Sub-pixels longer than that are sharpened no further.
pub(crate) const MAX_LOOKUPS: f32 = 8.0;

/// Texels of the level across a sub-pixel. With 1.4 dense meshes are drawn a twentieth faster and real ones lose up to
/// 0.3 dB; with 1 a hall of many columns loses 0.2 dB.
pub(crate) const TEXELS_ACROSS: f32 = 2.0;

/// The same along each axis where a border is near: up to 16 texels a sub-pixel, some 66 a pixel, single texels are
/// looked at. Beyond, look-ups in a coarser level keep a distance from the border that costs accuracy: 44.3 dB in place
/// of 46.0 on a helmet of 96 px, with 8 look-ups.
const MAX_LOOKUPS_AT_BORDERS: f32 = 16.0;

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

/// The mean over a sub-pixel of side `side_px`, of what lies within the borders of the chart.
#[inline(always)]
pub(crate) fn small_footprint(
    pyramid: &Pyramid,
    at: &UvAt,
    side_px: f32,
    borders: &Borders,
) -> Vec4 {
    let [ux, uy, vx, vy] = at.jacobian.map(|j| j * side_px);
    let (x2, y2) = (ux * ux + vx * vx, uy * uy + vy * vy);
    // A sub-pixel within a texel or so sees the reconstruction as it is; the sub-pixels' own filter does the rest.
    if x2.max(y2) <= 1.0 {
        return reconstructed(pyramid, at.u, at.v);
    }
    let (long2, along) = if x2 > y2 {
        (x2, [ux, vx])
    } else {
        (y2, [uy, vy])
    };
    let long = long2.sqrt();
    let short = (ux * vy - uy * vx).abs() / long;
    // As many texels of the level across the sub-pixel as are to be, or as many as the most look-ups leave.
    let texel = (short / TEXELS_ACROSS).max(long / MAX_LOOKUPS).max(1.0);
    // The coarser of the two levels has texels of up to twice this size.
    if borders.within([at.u, at.v], 0.5 * long + 2.0 * LEVEL_REACH * texel) {
        return within_borders(pyramid, (at.u, at.v), [[ux, vx], [uy, vy]], borders);
    }
    let count = (long / texel).ceil().clamp(1.0, MAX_LOOKUPS);
    let lod = texel.log2();
    let mut sum = Vec4::ZERO;
    for k in 0..count as usize {
        let t = (k as f32 + 0.5) / count - 0.5;
        sum += trilinear(pyramid, lod, at.u + t * along[0], at.v + t * along[1]);
    }
    sum / count
}

/// The mean over a parallelogram with the given sides, each look-up moved so far inside the borders that its level sees
/// nothing of what lies across.
#[inline(never)]
fn within_borders(
    pyramid: &Pyramid,
    (u, v): (f32, f32),
    sides: [[f32; 2]; 2],
    borders: &Borders,
) -> Vec4 {
    let lengths = sides.map(|[du, dv]| du.hypot(dv));
    // A bilinear look-up spans two texels: one for each of them leaves none out.
    let texel = (lengths[0].max(lengths[1]) / MAX_LOOKUPS_AT_BORDERS).max(1.0);
    let counts = lengths.map(|length| (length / texel).ceil().clamp(1.0, MAX_LOOKUPS_AT_BORDERS));
    let lod = texel.log2();
    let margin = LEVEL_REACH * (lod.ceil().exp2() - 1.0);
    let mut sum = Vec4::ZERO;
    for i in 0..counts[0] as usize {
        for j in 0..counts[1] as usize {
            let (s, t) = (
                (i as f32 + 0.5) / counts[0] - 0.5,
                (j as f32 + 0.5) / counts[1] - 0.5,
            );
            let place = [
                u + s * sides[0][0] + t * sides[1][0],
                v + s * sides[0][1] + t * sides[1][1],
            ];
            let [u, v] = borders.moved_inside([u, v], place, margin);
            sum += trilinear(pyramid, lod, u, v);
        }
    }
    sum / (counts[0] * counts[1])
}
