//! The greatest, the least or the mean scalar along each ray, classified at the end.
//!
//! The effect of a sample does not depend on the order. So bricks come with the greatest
//! first where the greatest is wanted, and a brick that cannot exceed the values of all pixels under it is skipped.
//! A pixel without a sample shows nothing; one with samples has the opacity of the transfer function over one opacity unit.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use resample_core::OpacityMode;
use resample_core::tile::TILE_PX;

use super::PackedRule;
use super::classify::interpolate;
use crate::field::settings::{FieldSettings, PlacedBrick, RayValues, Statistic, TileContext};
use crate::field::walk::lists::PIXEL_SHIFT;
use crate::field::walk::scratch::{FieldScratch, Window};
use crate::slabs::settings::Role;

/// A statistic of each channel.
pub(crate) struct Statistics;

impl PackedRule for Statistics {
    const HIDES: bool = false;

    #[inline(always)]
    fn open<S: Simd>(
        simd: S,
        job: &TileContext,
        scratch: &FieldScratch,
        row: usize,
    ) -> mask32x16<S> {
        let zero = f32x16::splat(simd, 0.0);
        let mut open = zero.simd_gt(zero);
        for (number, rays) in scratch.rays.iter().enumerate() {
            let values = f32x16::from_slice(simd, &rays.values[row]);
            // Where the brick cannot exceed the value of a ray, the ray has met a sample already.
            let [least, greatest] = job.placed.brick.channel(number).range;
            open |= match job.settings.statistic {
                Some(Statistic::Greatest) => values.simd_lt(f32x16::splat(simd, greatest)),
                Some(Statistic::Least) => values.simd_gt(f32x16::splat(simd, least)),
                Some(Statistic::Mean) | None => values.simd_eq(values),
            };
        }
        open
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, job: &TileContext, scratch: &mut FieldScratch) {
        let mut contributed = 0;
        for (number, rays) in scratch.rays.iter_mut().enumerate() {
            let scalars = job.placed.brick.channel(number).scalars;
            interpolate(simd, scalars, &mut scratch.samples);
            let samples = &scratch.samples;
            let values = rays.values.as_flattened_mut();
            let depths = rays.depths.as_flattened_mut();
            let counts = rays.counts.as_flattened_mut();
            let mut changed = 0;
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
                    changed += 1;
                }
            }
            // A sample counts once, whatever channels it changes: the channel that changed most is close to that.
            contributed = contributed.max(changed);
        }
        scratch.work.contributed += contributed;
    }
}

/// Puts bricks in the order in which most of them can be passed over; stable, so that ties keep theirs.
pub(crate) fn in_best_order(statistic: Statistic, bricks: &mut [&PlacedBrick]) {
    match statistic {
        Statistic::Greatest => bricks.sort_by(|a, b| b.brick.range[1].total_cmp(&a.brick.range[1])),
        Statistic::Least => bricks.sort_by(|a, b| a.brick.range[0].total_cmp(&b.brick.range[0])),
        Statistic::Mean => {}
    }
}

/// Returns true if no sample of the brick can change what the pixels under it have.
pub(crate) fn is_idle(
    statistic: Statistic,
    placed: &PlacedBrick,
    window: &Window,
    rays: &[RayValues],
) -> bool {
    let all = |number: usize, holds: &dyn Fn(f32, [f32; 2]) -> bool| {
        let range = placed.brick.channel(number).range;
        let rows = &rays[number].values[window.rows[0]..window.rows[1].max(window.rows[0])];
        let columns = window.columns[0]..window.columns[1].max(window.columns[0]);
        rows.iter().all(|row| {
            row[columns.clone()]
                .iter()
                .all(|&value| holds(value, range))
        })
    };
    // A mix of a cell's corners may exceed them by its rounding, three steps of f32; that much is not looked for.
    (0..rays.len()).all(|number| match statistic {
        Statistic::Greatest => all(number, &|value, range| value >= range[1]),
        Statistic::Least => all(number, &|value, range| value <= range[0]),
        Statistic::Mean => false,
    })
}

/// Classifies the values of a tile's rays. Channels add up, as light on a display: each adds its colour times its opacity. The opacity of the pixel
/// is that of the channels composited in a row, or the brightest component if that is greater.
pub(crate) fn classify(settings: &FieldSettings, statistic: Statistic, scratch: &mut FieldScratch) {
    for y in 0..TILE_PX {
        for x in 0..TILE_PX {
            let mut sum = [0.0f32; 3];
            let mut tint: Option<[f32; 3]> = None;
            let (mut transmittance, mut weight, mut depth) = (1.0f32, 0.0f32, 0.0f32);
            for (channel, rays) in settings.channels.iter().zip(&scratch.rays) {
                let Some((value, z)) = met(statistic, rays, [x, y]) else {
                    continue;
                };
                let [r, g, b, strength] = channel.table.at(value);
                if channel.role == Role::Tint {
                    let [red, green, blue] = tint.unwrap_or_default();
                    tint = Some([red + r, green + g, blue + b]);
                    continue;
                }
                let opacity = match settings.sheets.opacity {
                    OpacityMode::Extinction => -(-strength).exp_m1(),
                    OpacityMode::Linear => strength.min(1.0),
                };
                for (sum, value) in sum.iter_mut().zip([r, g, b]) {
                    *sum += opacity * value;
                }
                transmittance *= 1.0 - opacity;
                weight += opacity;
                depth += opacity * z;
            }
            if !(weight > 0.0) {
                continue;
            }
            for (sum, factor) in sum.iter_mut().zip(tint.unwrap_or([1.0; 3])) {
                *sum *= factor;
            }
            let brightest = sum.into_iter().fold(0.0, f32::max);
            let opacity = (1.0 - transmittance).max(brightest).min(1.0);
            let [red, green, blue] = sum;
            scratch.pixels.transmittance[y][x] = 1.0 - opacity;
            scratch.pixels.depth[y][x] = opacity * (depth / weight);
            scratch.pixels.rgb[y][x] = [red, green, blue, 0.0];
        }
    }
}

/// The scalar that a ray shows, and its camera z; `None` where the ray met no sample.
fn met(statistic: Statistic, rays: &RayValues, [x, y]: [usize; 2]) -> Option<(f32, f32)> {
    let count = rays.counts[y][x];
    let share = if statistic == Statistic::Mean {
        count.recip()
    } else {
        1.0
    };
    (count > 0.0).then(|| (share * rays.values[y][x], share * rays.depths[y][x]))
}
