//! A block of 4x4 pixels: the discs of its visible surface, summed and blended.
//!
//! Takes the splats that touch the block and the front at its pixels, returns colour and depth. The sums are those of a line
//! fitted to the weighted colours.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::narrow::single;
use resample_core::point::PIXEL_SIGMA_PX;

use crate::draw::sizes::REACH_SIGMAS;
use crate::draw::splat::{Splat, form};
use crate::lanes::Lanes;
use crate::options::Blend;

/// A linear fit moves the colour by at most this many standard deviations of the offsets of the discs: beyond them it
/// extrapolates. A guess.
const MOST_SHIFT: f32 = 1.0;

/// Weights below this are rounding.
const LEAST_WEIGHT: f32 = 1e-12;

/// The pixels of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    /// Centres of the pixels, px from the tile's first corner.
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    /// The farthest depth of the visible surface; infinite where no disc is.
    pub(crate) front: Lanes,
}

/// The colours of a block and their depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blended {
    /// Linear colour, red, green and blue.
    pub(crate) rgb: [Lanes; 3],
    /// Camera z; infinite where nothing is.
    pub(crate) depth: Lanes,
}

/// The sums of each pixel: of each disc the weight, its colour and depth, and their moments with the offset.
struct Sums<S: Simd> {
    weight: f32x16<S>,
    /// Red, green, blue, depth less the front's.
    values: [f32x16<S>; 4],
    offset: [f32x16<S>; 2],
    /// xx, xy, yy.
    square: [f32x16<S>; 3],
    /// Values times the offset along x and along y.
    slopes: [[f32x16<S>; 4]; 2],
}

impl<S: Simd> Sums<S> {
    /// A function of its own: inside a greater one the sums do not stay in registers.
    #[simd]
    fn of(simd: S, block: &Block, splats: &[Splat], touching: &[u32]) -> Self {
        let splat = |value: f32| f32x16::splat(simd, value);
        let zero = splat(0.0);
        let farthest_q = single(REACH_SIGMAS * REACH_SIGMAS);
        let x = f32x16::from_slice(simd, &block.x);
        let y = f32x16::from_slice(simd, &block.y);
        let front = f32x16::from_slice(simd, &block.front);
        let from = front.simd_lt(splat(f32::INFINITY)).select(front, zero);
        let mut weights = zero;
        let (mut red, mut green, mut blue, mut deep) = (zero, zero, zero, zero);
        let (mut red_x, mut green_x, mut blue_x, mut deep_x) = (zero, zero, zero, zero);
        let (mut red_y, mut green_y, mut blue_y, mut deep_y) = (zero, zero, zero, zero);
        let (mut sum_x, mut sum_y) = (zero, zero);
        let (mut xx, mut xy, mut yy) = (zero, zero, zero);
        for &number in touching {
            let disc = &splats[number as usize];
            let (dx, dy) = (x - disc.at[0], y - disc.at[1]);
            let form = form(simd, &disc.gaussian, [dx, dy]);
            let met = disc.met(simd, [dx, dy]);
            let q = met.square * form;
            let belongs = q.simd_le(splat(farthest_q)) & met.z.simd_le(front);
            if !belongs.any_true() {
                continue;
            }
            let weight = exp_of_half(simd, q) * disc.weight;
            let weight = belongs.select(weight, zero);
            let depth = met.z - from;
            let (wx, wy) = (weight * dx, weight * dy);
            let [r, g, b] = [splat(disc.rgb[0]), splat(disc.rgb[1]), splat(disc.rgb[2])];
            weights += weight;
            red = r.mul_add(weight, red);
            green = g.mul_add(weight, green);
            blue = b.mul_add(weight, blue);
            deep = depth.mul_add(weight, deep);
            red_x = r.mul_add(wx, red_x);
            green_x = g.mul_add(wx, green_x);
            blue_x = b.mul_add(wx, blue_x);
            deep_x = depth.mul_add(wx, deep_x);
            red_y = r.mul_add(wy, red_y);
            green_y = g.mul_add(wy, green_y);
            blue_y = b.mul_add(wy, blue_y);
            deep_y = depth.mul_add(wy, deep_y);
            sum_x += wx;
            sum_y += wy;
            xx = wx.mul_add(dx, xx);
            xy = wx.mul_add(dy, xy);
            yy = wy.mul_add(dy, yy);
        }
        Self {
            weight: weights,
            values: [red, green, blue, deep],
            offset: [sum_x, sum_y],
            square: [xx, xy, yy],
            slopes: [
                [red_x, green_x, blue_x, deep_x],
                [red_y, green_y, blue_y, deep_y],
            ],
        }
    }

    /// The mean, or the fitted line at the pixel's centre, from which offsets count.
    #[inline(always)]
    fn values(&self, simd: S, blend: Blend) -> [f32x16<S>; 4] {
        let splat = |value: f32| f32x16::splat(simd, value);
        let scale = splat(1.0) / self.weight.max(splat(f32::MIN_POSITIVE));
        let [a, b, c, d] = self.values;
        let mut values = [a * scale, b * scale, c * scale, d * scale];
        if blend == Blend::Mean {
            return values;
        }
        let (x, y) = (self.offset[0] * scale, self.offset[1] * scale);
        // A tenth of a tenth of the pixel's own variance: discs in one place have no slope.
        let ridge = 0.01 * single(PIXEL_SIGMA_PX * PIXEL_SIGMA_PX);
        let xx = self.square[0] * scale - x * x + ridge;
        let xy = self.square[1] * scale - x * y;
        let yy = self.square[2] * scale - y * y + ridge;
        let over = splat(1.0) / (xx * yy - xy * xy);
        // The mean's place in standard deviations, and the weights of the slopes that lead from there to the pixel.
        let (ax, ay) = ((yy * x - xy * y) * over, (xx * y - xy * x) * over);
        let shift = ax.mul_add(x, ay * y).max(splat(0.0)).sqrt();
        let part = splat(MOST_SHIFT) / shift.max(splat(MOST_SHIFT));
        for (i, value) in values.iter_mut().enumerate() {
            let along_x = self.slopes[0][i] * scale - *value * x;
            let along_y = self.slopes[1][i] * scale - *value * y;
            *value -= part * ax.mul_add(along_x, ay * along_y);
        }
        values
    }
}

/// The mean of the normals of the discs that touch a block, times their weights: turned to the eye, camera space, of no certain length.
#[simd]
pub(crate) fn mean_normals<S: Simd>(
    simd: S,
    block: &Block,
    touching: impl Iterator<Item = (Splat, [f32; 3])>,
) -> [Lanes; 3] {
    let x = f32x16::from_slice(simd, &block.x);
    let y = f32x16::from_slice(simd, &block.y);
    let front = f32x16::from_slice(simd, &block.front);
    let farthest_q = f32x16::splat(simd, single(REACH_SIGMAS * REACH_SIGMAS));
    let zero = f32x16::splat(simd, 0.0);
    let mut sums = [zero; 3];
    for (disc, normal) in touching {
        let offset = [x - disc.at[0], y - disc.at[1]];
        let met = disc.met(simd, offset);
        let q = met.square * form(simd, &disc.gaussian, offset);
        let belongs = q.simd_le(farthest_q) & met.z.simd_le(front);
        let weight = belongs.select(exp_of_half(simd, q) * disc.weight, zero);
        for (sum, part) in sums.iter_mut().zip(normal) {
            *sum = weight.mul_add(f32x16::splat(simd, part), *sum);
        }
    }
    let mut lanes = [[0.0; 16]; 3];
    for (lanes, sum) in lanes.iter_mut().zip(sums) {
        sum.store_slice(lanes);
    }
    lanes
}

/// Blends the discs that touch a block.
#[simd]
pub(crate) fn blended<S: Simd>(
    simd: S,
    block: &Block,
    blend: Blend,
    splats: &[Splat],
    touching: &[u32],
) -> Blended {
    let sums = Sums::of(simd, block, splats, touching);
    let splat = |value: f32| f32x16::splat(simd, value);
    let [red, green, blue, depth] = sums.values(simd, blend);
    let front = f32x16::from_slice(simd, &block.front);
    let from = front
        .simd_lt(splat(f32::INFINITY))
        .select(front, splat(0.0));
    let is_seen = sums.weight.simd_gt(splat(LEAST_WEIGHT));
    let mut to = Blended {
        rgb: [[0.0; 16]; 3],
        depth: [0.0; 16],
    };
    for (lanes, colour) in to.rgb.iter_mut().zip([red, green, blue]) {
        colour.max(splat(0.0)).min(splat(1.0)).store_slice(lanes);
    }
    let depth = is_seen.select(from + depth, splat(f32::INFINITY));
    depth.store_slice(&mut to.depth);
    to
}

/// e^(-q/2) for 0 <= q <= 7.84, wrong by 6e-5 at most: the polynomial of least greatest error (found by iterated weights).
#[inline(always)]
fn exp_of_half<S: Simd>(simd: S, q: f32x16<S>) -> f32x16<S> {
    let splat = |value: f32| f32x16::splat(simd, value);
    let e = q.mul_add(splat(3.561_290_4e-6), splat(-1.267_328_3e-4));
    let e = e.mul_add(q, splat(2.024_195_9e-3));
    let e = e.mul_add(q, splat(-0.019_440_647));
    let e = e.mul_add(q, splat(0.123_348_504));
    let e = e.mul_add(q, splat(-0.499_252_86));
    e.mul_add(q, splat(0.999_944_5))
}
