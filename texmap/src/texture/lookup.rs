//! Looking a texture up at a position: the splats of its texels, summed there.
//!
//! Each texel is a splat with the texture's own reconstruction kernel (tent or box) in its tangent plane. At a
//! position of the screen whose texture coordinates are known exactly, the splats that reach it are the two by two
//! texels around: their sum is the bilinear look-up. A sub-pixel that holds several texels looks coarser levels up
//! ([`LookupPlan`]), or, near the border of a chart, finer ones on this side of it (`taps`).

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16};
use glam::Vec4;
use resample_mesh::scene::{Magnify, Wrap};

use crate::prepare::level::wrapped;
use crate::prepare::mip::{Level, Pyramid};
use crate::project::surface::{Batch, Surface, UvPlanes};
use crate::screen::{LANES, Lanes};

/// Most look-ups along the longer axis of a sub-pixel. Sub-pixels longer than that are sharpened no further.
pub(crate) const MAX_LOOKUPS: f32 = 8.0;

/// Texels of the level across a sub-pixel. With 1.4 dense meshes are drawn a twentieth faster and real ones lose up to
/// 0.3 dB; with 1 a hall of many columns loses 0.2 dB.
const TEXELS_ACROSS: f32 = 2.0;

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

// Where the sub-pixels of a batch lie in a texture, and which look-ups each of them needs.
//
// A sub-pixel within a texel or so sees the texture's own reconstruction; a longer one takes the mean of several
// look-ups along its longer axis, in the two levels whose texels are beside half its width.

/// Where the sub-pixels of a batch lie in a texture.
pub(crate) struct LookupPlan {
    /// Texels of the full texture.
    pub(crate) u: Lanes,
    pub(crate) v: Lanes,
    /// The sub-pixel's longer axis, texels.
    pub(crate) along: [Lanes; 2],
    /// How many look-ups there are along it.
    pub(crate) count: Lanes,
    /// The finer of the two levels, and the share of the coarser one.
    pub(crate) level: [i32; LANES],
    pub(crate) share: Lanes,
    /// Around the sub-pixel, what a look-up sees, texels of the full texture.
    reach: Lanes,
}

impl Default for LookupPlan {
    fn default() -> Self {
        Self {
            u: [0.0; LANES],
            v: [0.0; LANES],
            along: [[0.0; LANES]; 2],
            count: [0.0; LANES],
            level: [0; LANES],
            share: [0.0; LANES],
            reach: [0.0; LANES],
        }
    }
}

impl LookupPlan {
    /// Computes the places of a batch.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(
        &mut self,
        simd: S,
        (surface, planes): (&Surface, &UvPlanes),
        batch: &Batch,
        (pyramid, side_px): (&Pyramid, f32),
    ) {
        let splat = |x: f32| f32x16::splat(simd, x);
        let w = splat(1.0) / batch.on(simd, &surface.over_w);
        let (u, v) = (batch.on(simd, &planes.u) * w, batch.on(simd, &planes.v) * w);
        let scale = w * splat(side_px);
        let slope = |plane: &[f32; 3], at: f32x16<S>, axis: usize| {
            (splat(plane[axis]) - at * splat(surface.over_w[axis])) * scale
        };
        let (ux, uy) = (slope(&planes.u, u, 0), slope(&planes.u, u, 1));
        let (vx, vy) = (slope(&planes.v, v, 0), slope(&planes.v, v, 1));
        let (x2, y2) = (ux * ux + vx * vx, uy * uy + vy * vy);
        let upright = y2.simd_ge(x2);
        let long2 = x2.max(y2);
        let long = long2.sqrt();
        let area = ux * vy - uy * vx;
        let short = area.abs() / long;
        // As many texels of the level across the sub-pixel as are to be, or as many as the most look-ups leave.
        let texel = (short * splat(1.0 / TEXELS_ACROSS))
            .max(long * splat(1.0 / MAX_LOOKUPS))
            .max(splat(1.0));
        let plain = long2.simd_le(splat(1.0));
        let count = (long / texel)
            .ceil()
            .max(splat(1.0))
            .min(splat(MAX_LOOKUPS));
        let (level, share) = log2(simd, texel);
        let zero = splat(0.0);
        u.store_slice(&mut self.u);
        v.store_slice(&mut self.v);
        // Non-finite inputs still do exactly one look-up.
        let count = plain.select(splat(1.0), count);
        count.store_slice(&mut self.count);
        upright.select(uy, ux).store_slice(&mut self.along[0]);
        upright.select(vy, vx).store_slice(&mut self.along[1]);
        let reach = long * splat(0.5) + texel * splat(2.0 * LEVEL_REACH);
        plain.select(zero, reach).store_slice(&mut self.reach);
        // The coarsest level is mixed with nothing.
        let last = i32x16::splat(simd, (pyramid.levels.len() - 1) as i32);
        let unmixed = plain | level.simd_ge(last);
        unmixed.select(zero, share).store_slice(&mut self.share);
        level.min(last).store_slice(&mut self.level);
    }

    /// Returns true if the sub-pixel lies within a texel or so.
    #[inline(always)]
    pub(crate) fn is_plain(&self, at: usize) -> bool {
        self.reach[at] == 0.0
    }

    /// The longer axis of the sub-pixel, texels, squared.
    #[inline(always)]
    pub(crate) fn long2(&self, at: usize) -> f32 {
        let [u, v] = [self.along[0][at], self.along[1][at]];
        u * u + v * v
    }

    /// Returns true if look-ups of a sub-pixel see beyond a border of its chart.
    #[inline(always)]
    pub(crate) fn sees_border(&self, at: usize, planes: &UvPlanes) -> bool {
        !self.is_plain(at)
            && planes
                .borders
                .within([self.u[at], self.v[at]], self.reach[at])
    }
}

/// log2(1 + t) = t + t (1 - t) (c0 + c1 t + ... + c5 t^5) for 0 <= t <= 1, to 1.2e-6 and exactly at both ends.
const LOG2: [f32; 6] = [
    0.442_689_67,
    -0.278_24,
    0.196_956,
    -0.132_250_74,
    0.064_974_16,
    -0.015_480_56,
];

/// The whole part of log2(x) and the rest, for x >= 1.
#[inline(always)]
fn log2<S: Simd>(simd: S, x: f32x16<S>) -> (i32x16<S>, f32x16<S>) {
    let bits: i32x16<S> = x.bitcast();
    let one = i32x16::splat(simd, 1.0f32.to_bits() as i32);
    let whole = (bits >> 23) - i32x16::splat(simd, 127);
    let mantissa: f32x16<S> = ((bits & i32x16::splat(simd, 0x7f_ffff)) | one).bitcast();
    let t = mantissa - f32x16::splat(simd, 1.0);
    let mut poly = f32x16::splat(simd, LOG2[5]);
    poly = poly * t + f32x16::splat(simd, LOG2[4]);
    poly = poly * t + f32x16::splat(simd, LOG2[3]);
    poly = poly * t + f32x16::splat(simd, LOG2[2]);
    poly = poly * t + f32x16::splat(simd, LOG2[1]);
    poly = poly * t + f32x16::splat(simd, LOG2[0]);
    (whole, t + t * (f32x16::splat(simd, 1.0) - t) * poly)
}
