//! Radiance seen through the lobe of a rough surface that is looked at along its normal, for every direction.
//!
//! Samples of a lobe are the same for every direction, turned. Each looks at the copy of the map that is as coarse as samples are apart.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16};
use fearless_simd_macros::simd;
use glam::{Vec3, Vec4};
use resample_core::dispatch;
use resample_core::narrow::cell;
use resample_core::simd::Vectors;

use crate::light::around::{Blurred, LEVELS, add_from_level, roughness_of_level};
use crate::light::environment::map::{
    Map, blocks, blurred_of, centre, centres, directions_on_square,
};
use crate::light::reflectance::{half_vector, visibility};
use crate::screen::LANES;

/// Texels along the sides of the maps: a lobe spans a few texels of its own.
pub(super) const SIDES: [usize; LEVELS] =
    [256, 256, 256, 256, 128, 128, 64, 64, 32, 32, 32, 32, 32];

/// Samples of a lobe: narrow lobes are covered by few.
const SAMPLES: [usize; LEVELS] = [0, 12, 24, 48, 64, 96, 128, 128, 128, 128, 128, 128, 128];

/// A map and its coarser copies, for looks of every size.
pub(super) struct Pyramid {
    levels: Blurred,
    /// Texels along the side of the sharpest.
    side: usize,
    count: usize,
}

/// A sample of a lobe.
struct Sample {
    /// Where light comes from, around a normal of +z.
    light: Vec3,
    /// The copy of the map to look at, beside the next one.
    level: usize,
    /// Of both: parts of what reaches the eye along the normal, over the samples' density. The sum over the lobe is 1.
    weights: [f32; 2],
}

impl Pyramid {
    pub(super) fn new(coarser: &[Map]) -> Self {
        let maps: Vec<&Map> = coarser.iter().collect();
        Self {
            levels: blurred_of(&maps),
            side: coarser[0].side,
            count: coarser.len(),
        }
    }

    /// The radiance that a lobe of a level's roughness sees.
    pub(super) fn blurred(&self, level: usize, vectors: Vectors) -> Map {
        let lobe = self.lobe(level);
        let mut map = Map::black(SIDES[level]);
        map.for_each_row(|y, row| {
            dispatch!(vectors, simd => blur(simd, (&self.levels, &lobe), y, row));
        });
        map
    }

    fn lobe(&self, level: usize) -> Vec<Sample> {
        let roughness = roughness_of_level(level as f32);
        let alpha = roughness * roughness;
        let count = SAMPLES[level];
        // Solid angle of a texel of the sharpest map, on the mean.
        let texel = 4.0 * std::f32::consts::PI / (self.side * self.side) as f32;
        let last = (self.count - 1) as f32;
        let (mut lobe, mut whole) = (Vec::new(), 0.0);
        for k in 0..count {
            let half = half_vector(k, count, alpha);
            let light = 2.0 * half.z * half - Vec3::Z;
            if light.z <= 0.0 {
                continue;
            }
            let spread = 1.0 + half.z * half.z * (alpha * alpha - 1.0);
            let density = alpha * alpha / (4.0 * std::f32::consts::PI * spread * spread);
            let apart = 1.0 / (count as f32 * density);
            let lod = (0.5 * (apart / texel).log2()).clamp(0.0, last);
            let first = cell(lod).min(self.count - 2);
            let weight = 4.0 * visibility(light.z, 1.0, alpha) * light.z;
            let share = lod - first as f32;
            whole += weight;
            lobe.push(Sample {
                light,
                level: first,
                weights: [weight * (1.0 - share), weight * share],
            });
        }
        for sample in &mut lobe {
            sample.weights = sample.weights.map(|weight| weight / whole);
        }
        lobe
    }
}

/// Fills a row of a map.
#[simd]
fn blur<S: Simd>(simd: S, (maps, lobe): (&Blurred, &[Sample]), y: usize, row: &mut [Vec4]) {
    let side_texels = row.len();
    for (texels, out) in blocks(row) {
        let x = centres(simd, texels.start, side_texels);
        let normal = directions_on_square(simd, x, centre(y, side_texels));
        let length2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        let per_length = f32x16::splat(simd, 1.0) / length2.sqrt();
        let normal = [
            normal[0] * per_length,
            normal[1] * per_length,
            normal[2] * per_length,
        ];
        let (side, above) = orthonormal_pair(simd, &normal);
        let mut sums = [f32x4::splat(simd, 0.0); LANES];
        for sample in lobe {
            let [x, y, z] = sample.light.to_array().map(|v| f32x16::splat(simd, v));
            let towards = [
                side[0] * x + above[0] * y + normal[0] * z,
                side[1] * x + above[1] * y + normal[1] * z,
                side[2] * x + above[2] * y + normal[2] * z,
            ];
            let map = (maps, sample.level);
            add_from_level(simd, map, &towards, sample.weights, &mut sums);
        }
        for (sum, texel) in sums.iter().zip(out) {
            *texel = Vec4::new(sum[0], sum[1], sum[2], 0.0);
        }
    }
}

/// Two directions that stand on unit normals and on one another (Duff and others 2017).
#[inline(always)]
fn orthonormal_pair<S: Simd>(
    simd: S,
    [x, y, z]: &[f32x16<S>; 3],
) -> ([f32x16<S>; 3], [f32x16<S>; 3]) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (zero, one) = (splat(0.0), splat(1.0));
    let sign = z.simd_ge(zero).select(one, splat(-1.0));
    let a = zero - one / (sign + *z);
    let b = *x * *y * a;
    (
        [one + sign * *x * *x * a, sign * b, zero - sign * *x],
        [b, sign + *y * *y * a, zero - *y],
    )
}
