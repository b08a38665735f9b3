//! Several channels over one another, labels among them, and extinction that follows the gradient.
//!
//! The general rule of emission and absorption. At each sample every channel gives an extinction and a colour: a scalar
//! channel by its transfer function at the interpolated scalar, a label channel by the nearest voxel's look. Extinctions
//! add up, colours mix by extinction and are multiplied by the sum of the tints, and the whole is composited once.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::composite::{DepthRule, opacity};
use resample_core::tile::TILE_PX;

use crate::field::settings::TileContext;
use crate::field::walk::cell_sample::{Corners, Located, interpolated, nearest};
use crate::field::walk::gather::{GatherScratch, SampleRule, set_lanes};
use crate::field::walk::gradient::interpolated_gradient;
use crate::light::Lit;
use crate::slabs::settings::{ChannelSettings, Reading, Role, weights_of_tints};
use crate::slabs::view::{LANES, PlaneView};

/// Emission and absorption of all channels together.
pub(crate) struct Mixed;

/// The sums of the channels of half a row.
struct Sums {
    strengths: [f32; LANES],
    /// Colour times strength, lit.
    rgb: [[f32; 4]; LANES],
    /// The factor of each colour that is added; highlights have none.
    tints: [[f32; 4]; LANES],
}

impl SampleRule for Mixed {
    #[inline(always)]
    fn take<S: Simd>(
        simd: S,
        job: &TileContext,
        plane: &PlaneView,
        located: &Located<S>,
        scratch: &mut GatherScratch,
    ) -> bool {
        let zero = f32x8::splat(simd, 0.0);
        let mut sums = Sums {
            strengths: [0.0; LANES],
            rgb: [[0.0; 4]; LANES],
            tints: tints(simd, job, located),
        };
        for number in 0..job.settings.channels.len() {
            if job.settings.channels[number].role == Role::Extinction {
                add_channel(simd, job, number, located, &mut sums);
            }
        }
        let strength = f32x8::from_slice(simd, &sums.strengths);
        let seen = strength.simd_gt(zero);
        if seen.all_false() {
            return false;
        }
        scratch.work.contributed += set_lanes(seen & located.inside);
        let at = located.at;
        let range = at.first..at.first + LANES;
        let load = |plane: &[f32; TILE_PX]| f32x8::from_slice(simd, &plane[range.clone()]);
        let added = strength * load(&job.view.units_per_slab[at.row]);
        let before = load(&scratch.pixels.transmittance[at.row]);
        let weight = before * opacity(simd, job.settings.sheets.opacity, added);
        (before - weight).store_slice(&mut scratch.pixels.transmittance[at.row][range.clone()]);
        if job.settings.sheets.depth == DepthRule::Expected {
            let sum = weight.mul_add(
                f32x8::splat(simd, plane.camera_z),
                load(&scratch.pixels.depth[at.row]),
            );
            sum.store_slice(&mut scratch.pixels.depth[at.row][range.clone()]);
        }
        let shares = (weight / strength.max(f32x8::splat(simd, f32::MIN_POSITIVE))).to_array();
        for ((sum, mixed), share) in scratch.rgb[at.row][range]
            .iter_mut()
            .zip(sums.rgb)
            .zip(shares)
        {
            for (sum, value) in sum.iter_mut().zip(mixed) {
                *sum += share * value;
            }
        }
        true
    }
}

/// The sum of the tints; 1 where the scene has none.
#[inline(always)]
fn tints<S: Simd>(simd: S, job: &TileContext, located: &Located<S>) -> [[f32; 4]; LANES] {
    let is_tint = |channel: &ChannelSettings| channel.role == Role::Tint;
    if !job.settings.channels.iter().any(is_tint) {
        return [[1.0; 4]; LANES];
    }
    let corners = |number: usize| {
        Corners::new(
            simd,
            job.placed.brick.channel(number).scalars,
            &located.places,
        )
    };
    let weights = weights_of_tints(&job.settings.channels)
        .map(|(number, least)| corners(number).above(simd, least));
    let mut tints = [[0.0; 4]; LANES];
    for (number, channel) in job.settings.channels.iter().enumerate() {
        if !is_tint(channel) {
            continue;
        }
        let values = match &weights {
            Some(weights) => corners(number).weighted(simd, weights, located.share),
            None => corners(number).interpolated(located.share),
        };
        for (tint, place) in tints
            .iter_mut()
            .zip(channel.table.places(simd, values).to_array())
        {
            for (sum, value) in tint.iter_mut().zip(channel.table.entry(place)) {
                *sum += value;
            }
        }
    }
    tints
}

/// Adds what one channel gives.
#[inline(always)]
fn add_channel<S: Simd>(
    simd: S,
    job: &TileContext,
    number: usize,
    located: &Located<S>,
    sums: &mut Sums,
) {
    let channel = &job.settings.channels[number];
    let cells = job.placed.brick.channel(number);
    let zero = f32x8::splat(simd, 0.0);
    let values = match channel.reading {
        Reading::Trilinear => interpolated(simd, cells.scalars, &located.places, located.share),
        Reading::Nearest => nearest(simd, cells.scalars, located),
    };
    let places = channel.table.places(simd, values).to_array();
    let mut strengths = [0.0f32; LANES];
    for (strength, &place) in strengths.iter_mut().zip(&places) {
        *strength = channel.table.entry(place)[3];
    }
    let mut strength = located
        .inside
        .select(f32x8::from_slice(simd, &strengths), zero);
    if strength.simd_gt(zero).all_false() {
        return;
    }
    let mut lit = Lit {
        body: f32x8::splat(simd, 1.0),
        highlight: zero,
    };
    if let Some(gradients) = cells.gradients {
        let gradients = (gradients, &job.settings.from_differences);
        let gradient = interpolated_gradient(simd, gradients, located, strength);
        if let (Some(ramp), Reading::Trilinear) =
            (job.settings.sheets.gradient_ramp, channel.reading)
        {
            strength *= ramp.factor(simd, gradient);
        }
        if let Some(shade) = job.settings.sheets.shade.as_ref() {
            lit = shade.light(simd, gradient, job.view.rays(simd, located.at));
        }
    }
    let (strengths, bodies) = (strength.to_array(), (strength * lit.body).to_array());
    let highlights = (strength * lit.highlight).to_array();
    for lane in 0..LANES {
        sums.strengths[lane] += strengths[lane];
        let entry = channel.table.entry(places[lane]);
        for (k, sum) in sums.rgb[lane].iter_mut().enumerate() {
            *sum += bodies[lane] * (entry[k] * sums.tints[lane][k]) + highlights[lane];
        }
    }
}
