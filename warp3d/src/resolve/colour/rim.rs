//! The cubic spline where samples are missing or lie on another surface.
//!
//! A missing sample is continued from those of its row that count: a spline with natural ends goes on straight. That is
//! linear in the samples, so only the weights change.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f64x4};
use fearless_simd_macros::simd;
use glam::DVec2;

use super::{Lookup, Taps};
use crate::surfaces::surface::{BELOW, RIGHT};

/// By how much of the range of its samples a colour may go on beyond them. Without a bound, limbs had colours out of the
/// reference's range by 0.26, with 0.25 by 0.11; with 0.1 smooth patterns lose 0.1 dB.
const BEYOND: f32 = 0.15;

impl Lookup<'_> {
    /// The sum over sixteen samples around `base`, those that do not count continued from the others.
    #[simd]
    pub(crate) fn cubic_at_rim<S: Simd>(&self, simd: S, base: DVec2, taps: &Taps) -> f32x4<S> {
        let (wx, wy) = (
            [taps[0], taps[1], taps[2], taps[3]],
            [taps[4], taps[5], taps[6], taps[7]],
        );
        // A surface seen edge-on is met anywhere: far outside the picture, all places are alike.
        let size = DVec2::from(self.surfaces.size.map(|n| n as f64));
        let base = base.clamp(DVec2::splat(-4.0), size + 4.0);
        let width = self.surfaces.size[0] as i64;
        let (left, top) = (base.x as i64 - 1, base.y as i64 - 1);
        let taps = self.taps(simd, left, top);
        if taps == 0 {
            return self.sample(simd, self.nearest(base));
        }
        let mut row_bits = 0;
        let mut range = [f32::INFINITY, f32::NEG_INFINITY].map(|v| f32x4::splat(simd, v));
        let mut widen = |sample: f32x4<S>| range = [range[0].min(sample), range[1].max(sample)];
        let mut rows = [f32x4::splat(simd, 0.0); 4];
        for (j, sum) in rows.iter_mut().enumerate() {
            let bits = taps >> (4 * j) & 0xf;
            if bits == 0 {
                continue;
            }
            row_bits |= 1 << j;
            let first = (top + j as i64) * width + left;
            let weights = folded(simd, bits, wx);
            if first >= 0 && first as usize + 4 <= self.colours.coefficients.len() {
                // A sample that does not count has no weight.
                let samples = self.colours.coefficients.sixteen(first as usize);
                for i in 0..4 {
                    let sample = f32x4::from_slice(simd, &samples[3 * i..3 * i + 4]);
                    if bits >> i & 1 != 0 {
                        widen(sample);
                    }
                    *sum = sample.mul_add(f32x4::splat(simd, weights[i]), *sum);
                }
                continue;
            }
            // A sample that does not count may lie outside the picture.
            let counting = (0..).zip(weights).filter(|(i, _)| bits >> i & 1 != 0);
            for (i, weight) in counting {
                let sample = self.colours.coefficients.four((first + i) as usize);
                let sample = f32x4::from_slice(simd, sample);
                widen(sample);
                *sum = sample.mul_add(f32x4::splat(simd, weight), *sum);
            }
        }
        let mut sum = f32x4::splat(simd, 0.0);
        let weights = folded(simd, row_bits, wy);
        for j in 0..4 {
            sum = rows[j].mul_add(f32x4::splat(simd, weights[j]), sum);
        }
        let [least, most] = range;
        let beyond = (most - least) * f32x4::splat(simd, BEYOND);
        sum.max(least - beyond).min(most + beyond)
    }

    /// The samples, of sixteen, that count, one bit each: those on the patch's plane, and those that are linked to one.
    #[inline(always)]
    fn taps<S: Simd>(&self, simd: S, left: i64, top: i64) -> u32 {
        let [width, height] = self.surfaces.size;
        let whole = left >= 0 && top >= 0 && left + 4 <= width as i64 && top + 4 <= height as i64;
        let [mut taps, right, below] = if whole {
            self.whole_block(simd, left as usize, top as usize)
        } else {
            self.cut_block(left, top)
        };
        // Where a surface bends away from its plane, as at a limb, its samples still are its own: along a row as far as
        // it is linked, and in a row without any, from the row before or after. Not around corners: two surfaces that
        // touch are linked there.
        let (down, up) = ((taps & below) << 4, taps >> 4 & below);
        let some = (taps | taps >> 1 | taps >> 2 | taps >> 3) & 0x1111;
        taps |= (down | up) & !(some * 0xf);
        for _ in 0..3 {
            taps |= (taps & right) << 1 | (taps >> 1 & right);
        }
        taps
    }

    /// Of sixteen samples in the picture: which lie on the patch's plane, and which are linked with the next one of
    /// them to the right and below.
    #[inline(always)]
    fn whole_block<S: Simd>(&self, simd: S, left: usize, top: usize) -> [u32; 3] {
        let width = self.surfaces.size[0];
        let (mut taps, mut right, mut below) = (0u32, 0u32, 0u32);
        for j in 0..4 {
            let from = (top + j) * width + left;
            let disparity = f32x4::from_slice(simd, &self.surfaces.disparity[from..from + 4]);
            taps |= self.four_count(simd, left, top + j, disparity) << (4 * j);
            let links = &self.surfaces.links[from..from + 4];
            let links = u32::from_le_bytes([links[0], links[1], links[2], links[3]]);
            right |= lowest_bits(links / u32::from(RIGHT)) << (4 * j);
            below |= lowest_bits(links / u32::from(BELOW)) << (4 * j);
        }
        [taps, right & 0x7777, below & 0xfff]
    }

    /// As [`Self::whole_block`], where the picture ends among them.
    fn cut_block(&self, left: i64, top: i64) -> [u32; 3] {
        let [width, height] = self.surfaces.size;
        let (mut taps, mut right, mut below) = (0u32, 0u32, 0u32);
        for j in 0..4 {
            for i in 0..4 {
                let (x, y) = (left + i, top + j);
                if x < 0 || y < 0 || x >= width as i64 || y >= height as i64 {
                    continue;
                }
                let (index, bit) = ((y * width as i64 + x) as usize, 4 * j + i);
                taps |= u32::from(self.counts(x as usize, y as usize, index)) << bit;
                right |= u32::from(self.surfaces.links[index] & RIGHT != 0) << bit;
                below |= u32::from(self.surfaces.links[index] & BELOW != 0) << bit;
            }
        }
        [taps, right & 0x7777, below & 0xfff]
    }

    /// As [`Lookup::counts`], for four samples of a row from (x, y) on, one bit each.
    #[inline(always)]
    fn four_count<S: Simd>(&self, simd: S, x: usize, y: usize, disparity: f32x4<S>) -> u32 {
        let constant = |v: f64| f64x4::splat(simd, v);
        let steps = f64x4::simd_from(simd, [0.0, 1.0, 2.0, 3.0]);
        let dx = constant(x as f64 + 0.5 - self.patch.place.x) + steps;
        let dy = y as f64 + 0.5 - self.patch.place.y;
        let here = constant(self.patch.disparity + self.patch.slope.y * dy);
        let expected = here + constant(self.patch.slope.x) * dx;
        let (found, _) = disparity.combine(disparity).widen();
        let distance = dx.abs().max(constant(dy.abs()));
        let allowed = constant(f64::from(self.surfaces.tolerance)) * (constant(2.0) + distance);
        let counts = (found - expected).abs().simd_le(allowed * found.abs());
        counts.to_bitmask() as u32
    }

    /// The patch's own sample, where nothing else is near.
    fn nearest(&self, base: DVec2) -> usize {
        let [width, height] = self.surfaces.size;
        let clamp = |v: f64, size: usize| v.clamp(0.0, size as f64 - 1.0) as usize;
        let index = |place: DVec2| clamp(place.y, height) * width + clamp(place.x, width);
        let place = if base.distance(self.patch.place) < 4.0 {
            base
        } else {
            self.patch.place - 0.5
        };
        let own = index(self.patch.place - 0.5);
        let known = !self.surfaces.disparity[own].is_nan();
        if known { own } else { index(place) }
    }
}

/// The lowest bit of each of four bytes: the product brings them side by side, and no other two meet.
#[inline(always)]
fn lowest_bits(bytes: u32) -> u32 {
    (bytes & 0x0101_0101).wrapping_mul(0x0102_0408) >> 24 & 0xf
}

/// The weights of four samples of which only those in `bits` are there, at least one: what a missing one would be is
/// made of the others.
#[inline(always)]
fn folded<S: Simd>(simd: S, bits: u32, w: [f32; 4]) -> [f32; 4] {
    let rows = &FOLDED[bits as usize];
    let mut sum = f32x4::from_slice(simd, &rows[0]) * f32x4::splat(simd, w[0]);
    for i in 1..4 {
        sum = f32x4::from_slice(simd, &rows[i]).mul_add(f32x4::splat(simd, w[i]), sum);
    }
    sum.to_array()
}

/// The contribution of each of four samples' weights to the weights of those in some bits.
const FOLDED: [[[f32; 4]; 4]; 16] = {
    let mut table = [[[0.0; 4]; 4]; 16];
    let mut bits = 1;
    while bits < 16 {
        let mut i = 0;
        while i < 4 {
            let mut w = [0.0; 4];
            w[i] = 1.0;
            table[bits][i] = folded_weights(bits, w);
            i += 1;
        }
        bits += 1;
    }
    table
};

/// As [`folded`], step by step.
const fn folded_weights(bits: usize, mut w: [f32; 4]) -> [f32; 4] {
    // Outer ones go on straight from the two inner ones.
    let mut k = 0;
    while k < 2 {
        let [outer, near, far] = [[0, 1, 2], [3, 2, 1]][k];
        if bits >> outer & 1 == 0 {
            w[near] += 2.0 * w[outer];
            w[far] -= w[outer];
            w[outer] = 0.0;
        }
        k += 1;
    }
    // Inner ones go on straight from the other side, or are what is nearest.
    let mut k = 0;
    while k < 2 {
        let [here, next, after, other] = [[1, 2, 3, 0], [2, 1, 0, 3]][k];
        k += 1;
        if bits >> here & 1 != 0 {
            continue;
        }
        let weight = w[here];
        w[here] = 0.0;
        if bits >> next & 1 != 0 && bits >> after & 1 != 0 {
            w[next] += 2.0 * weight;
            w[after] -= weight;
        } else if bits >> next & 1 != 0 {
            w[next] += weight;
        } else if bits >> other & 1 != 0 {
            w[other] += weight;
        } else {
            w[after] += weight;
        }
    }
    w
}

#[cfg(test)]
mod tests {
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    use super::*;

    #[test]
    fn missing_samples_of_a_straight_line_are_not_missed() {
        let line = [1.0, 3.0, 5.0, 7.0];
        let weights = [0.1, 0.5, 0.3, 0.1];
        let expected: f32 = line.iter().zip(weights).map(|(v, w)| v * w).sum();
        // With two neighbours on one side the line is known.
        for bits in [0b1111, 0b0111, 0b1110, 0b0110, 0b0011, 0b1100] {
            let sum: f32 = line
                .iter()
                .zip(folded_weights(bits, weights))
                .map(|(v, w)| v * w)
                .sum();
            assert!(
                (sum - expected).abs() < 1e-6,
                "samples {bits:04b}: {sum} against {expected}"
            );
        }
        for bits in 1..16 {
            let w = folded_weights(bits, weights);
            let level = SimdLevel::Auto.resolve();
            let by_table = dispatch!(level, simd => folded(simd, bits as u32, weights));
            for (a, b) in w.iter().zip(by_table) {
                assert!(
                    (a - b).abs() < 1e-6,
                    "samples {bits:04b}: {w:?} against {by_table:?}"
                );
            }
            assert!(
                (w.iter().sum::<f32>() - 1.0).abs() < 1e-6,
                "samples {bits:04b}: a constant is kept"
            );
            assert!(
                (0..4).all(|i| bits >> i & 1 != 0 || w[i] == 0.0),
                "samples {bits:04b}: {w:?}"
            );
        }
    }
}
