//! Where the sub-pixels of a batch lie in a texture, and which look-ups each of them needs.
//!
//! A sub-pixel within a texel or so sees the texture's own reconstruction; a longer one takes the mean of several
//! look-ups along its longer axis, in the two levels whose texels are beside half its width.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16};

use crate::prepare::mip::Pyramid;
use crate::project::batch::Batch;
use crate::project::surface::{Surface, UvPlanes};
use crate::screen::lanes::{LANES, Lanes};
use crate::texture::lookup::{LEVEL_REACH, MAX_LOOKUPS, TEXELS_ACROSS};

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
