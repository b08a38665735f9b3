//! The greatest, the least or the mean scalar of rays, from packed samples.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use resample_core::tile::TILE_PX;

use super::interpolate::interpolate;
use super::rule::PackedRule;
use crate::field::settings::Statistic;
use crate::field::settings::TileContext;
use crate::field::walk::gather::GatherScratch;
use crate::field::walk::lists::PIXEL_SHIFT;

/// A statistic of one channel.
pub(crate) struct Statistics;

impl PackedRule for Statistics {
    const HIDES: bool = false;

    #[inline(always)]
    fn open<S: Simd>(
        simd: S,
        job: &TileContext,
        scratch: &GatherScratch,
        row: usize,
    ) -> mask32x16<S> {
        let values = f32x16::from_slice(simd, &scratch.rays[0].values[row]);
        // Where the brick cannot exceed what a ray has, the ray has met a sample already.
        let [least, greatest] = job.placed.brick.range;
        match job.settings.statistic {
            Some(Statistic::Greatest) => values.simd_lt(f32x16::splat(simd, greatest)),
            Some(Statistic::Least) => values.simd_gt(f32x16::splat(simd, least)),
            Some(Statistic::Mean) | None => values.simd_eq(values),
        }
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, job: &TileContext, scratch: &mut GatherScratch) {
        interpolate(simd, job.placed.brick, &mut scratch.samples);
        let samples = &scratch.samples;
        let rays = &mut scratch.rays[0];
        let values = rays.values.as_flattened_mut();
        let depths = rays.depths.as_flattened_mut();
        let counts = rays.counts.as_flattened_mut();
        let mut contributed = 0;
        for k in 0..samples.len() {
            let pixel = (samples.place[k] >> PIXEL_SHIFT) as usize % (TILE_PX * TILE_PX);
            let (scalar, z) = (samples.scalar[k], samples.camera_z[k]);
            let value = values[pixel];
            counts[pixel] += 1.0;
            let (is_taken, new_value, new_depth) = match job.settings.statistic {
                Some(Statistic::Greatest) => (scalar > value, scalar, z),
                Some(Statistic::Least) => (scalar < value, scalar, z),
                Some(Statistic::Mean) | None => (true, value + scalar, depths[pixel] + z),
            };
            if is_taken {
                (values[pixel], depths[pixel]) = (new_value, new_depth);
                contributed += 1;
            }
        }
        scratch.work.contributed += contributed;
    }
}
