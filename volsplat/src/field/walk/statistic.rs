//! The greatest, the least or the mean scalar along each ray, classified at the end.
//!
//! Samples are those of the sheets; what becomes of them does not depend on their order. So bricks come with the greatest
//! first where the greatest is wanted, and a brick that cannot exceed what every pixel under it has already is passed over.
//! A pixel without a sample shows nothing; one with samples has the opacity of the transfer function over one opacity unit.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::OpacityMode;
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use crate::field::settings::FieldSettings;
use crate::field::settings::{PlacedBrick, TileContext};
use crate::field::settings::{RayValues, Statistic};
use crate::field::walk::cell_sample::{Located, interpolated};
use crate::field::walk::gather::{GatherScratch, SampleRule, Window, set_lanes};
use crate::slabs::settings::Role;
use crate::slabs::view::{LANES, PlaneView};

/// Gathers the statistic that the settings ask for.
pub(crate) struct Gathered;

impl SampleRule for Gathered {
    #[inline(always)]
    fn take<S: Simd>(
        simd: S,
        job: &TileContext,
        plane: &PlaneView,
        located: &Located<S>,
        scratch: &mut GatherScratch,
    ) -> bool {
        let constant = |v: f32| f32x8::splat(simd, v);
        let Some(statistic) = job.settings.statistic else {
            return false;
        };
        let at = located.at;
        let range = at.first..at.first + LANES;
        let mut contributed = constant(0.0).simd_gt(constant(0.0));
        for (number, rays) in scratch.rays.iter_mut().enumerate() {
            let cells = job.placed.brick.channel(number);
            let load = |plane: &TilePlane| f32x8::from_slice(simd, &plane[at.row][range.clone()]);
            // Where the brick cannot exceed what a ray has, the ray has met a sample already.
            let [least, greatest] = cells.range;
            let may_change = match statistic {
                Statistic::Greatest => {
                    located.inside & load(&rays.values).simd_lt(constant(greatest))
                }
                Statistic::Least => located.inside & load(&rays.values).simd_gt(constant(least)),
                Statistic::Mean => located.inside,
            };
            if may_change.all_false() {
                continue;
            }
            let scalar = interpolated(simd, cells.scalars, &located.places, located.share);
            let (value, depth, met) = (load(&rays.values), load(&rays.depths), load(&rays.counts));
            let z = constant(plane.camera_z);
            let (taken, new_value, new_depth) = match statistic {
                Statistic::Greatest => (located.inside & scalar.simd_gt(value), scalar, z),
                Statistic::Least => (located.inside & scalar.simd_lt(value), scalar, z),
                Statistic::Mean => (located.inside, value + scalar, depth + z),
            };
            contributed |= taken;
            taken
                .select(new_value, value)
                .store_slice(&mut rays.values[at.row][range.clone()]);
            taken
                .select(new_depth, depth)
                .store_slice(&mut rays.depths[at.row][range.clone()]);
            let met = located.inside.select(met + constant(1.0), met);
            met.store_slice(&mut rays.counts[at.row][range.clone()]);
        }
        scratch.work.contributed += set_lanes(contributed);
        false
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

/// Classifies what the rays of a tile have met.
pub(crate) fn classify(
    settings: &FieldSettings,
    statistic: Statistic,
    scratch: &mut GatherScratch,
) {
    for y in 0..TILE_PX {
        for x in 0..TILE_PX {
            let mut sum = [0.0f32; 4];
            let mut tint: Option<[f32; 3]> = None;
            let mut depth = 0.0;
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
                for (sum, value) in sum.iter_mut().zip([r, g, b, 1.0]) {
                    *sum += strength * value;
                }
                depth += strength * z;
            }
            for (sum, factor) in sum.iter_mut().zip(tint.unwrap_or([1.0; 3])) {
                *sum *= factor;
            }
            if !(sum[3] > 0.0) {
                continue;
            }
            let opacity = match settings.sheets.opacity {
                OpacityMode::Extinction => -(-sum[3]).exp_m1(),
                OpacityMode::Linear => sum[3].min(1.0),
            };
            let share = opacity / sum[3];
            scratch.pixels.transmittance[y][x] = 1.0 - opacity;
            scratch.pixels.depth[y][x] = share * depth;
            scratch.rgb[y][x] = [share * sum[0], share * sum[1], share * sum[2], 0.0];
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
