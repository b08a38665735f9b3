//! Several channels over one another, labels among them, and extinction that follows the gradient.
//!
//! The general rule of emission and absorption. At each sample every channel gives an extinction and a colour: a scalar
//! channel by its transfer function at the interpolated scalar, a label channel by the nearest voxel's look. Extinctions
//! add up, colours mix by extinction and are multiplied by the sum of the tints, and the whole is composited once.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, mask32x16};
use resample_core::composite::{DepthRule, opacity};

use super::PackedRule;
use super::classify::{
    classify_channel, find_gradients, interpolate, nearest, shade, shares, take_parts,
};
use super::composite::not_opaque;
use crate::field::settings::TileContext;
use crate::field::walk::corners::Corners;
use crate::field::walk::lists::{CELL_MASK, ChannelSums, LANES, PIXEL_SHIFT, PackedSamples};
use crate::field::walk::scratch::FieldScratch;
use crate::slabs::settings::{ChannelSettings, Reading, Role, weights_of_tints};

/// Emission and absorption of all channels together.
pub(crate) struct Mixed;

impl PackedRule for Mixed {
    const HIDES: bool = true;

    #[inline(always)]
    fn open<S: Simd>(
        simd: S,
        job: &TileContext,
        scratch: &FieldScratch,
        row: usize,
    ) -> mask32x16<S> {
        not_opaque(simd, job, scratch, row)
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, job: &TileContext, scratch: &mut FieldScratch) {
        let samples = &mut scratch.samples;
        let with_tints = add_tints(simd, job, samples);
        let count = samples.len().next_multiple_of(LANES);
        samples.sums.strength[..count].fill(0.0);
        samples.sums.rgb[..count].fill([0.0; 4]);
        if !with_tints {
            samples.sums.tint[..count].fill([1.0; 4]);
        }
        for (number, channel) in job.settings.channels.iter().enumerate() {
            if channel.role == Role::Extinction {
                add_channel(simd, job, (number, channel), samples);
            }
        }
        composite(simd, job, scratch);
    }
}

/// Sums the tints; returns false where the scene has none.
#[inline(always)]
fn add_tints<S: Simd>(simd: S, job: &TileContext, samples: &mut PackedSamples) -> bool {
    let is_tint = |channel: &ChannelSettings| channel.role == Role::Tint;
    if !job.settings.channels.iter().any(is_tint) {
        return false;
    }
    for first in (0..samples.len()).step_by(LANES) {
        let (place, share) = (&samples.place, shares(simd, &samples.share, first));
        let corners = |number: usize| {
            let scalars = job.placed.brick.channel(number).scalars;
            Corners::new(simd, scalars, |lane| place[first + lane] & CELL_MASK)
        };
        let weights = weights_of_tints(&job.settings.channels)
            .map(|(number, least)| corners(number).above(simd, least));
        let tints = &mut samples.sums.tint[first..first + LANES];
        tints.fill([0.0; 4]);
        let channels = job.settings.channels.iter().enumerate();
        for (number, channel) in channels.filter(|(_, channel)| is_tint(channel)) {
            let values = match &weights {
                Some(weights) => corners(number).weighted(simd, weights, share),
                None => corners(number).interpolated(share),
            };
            let places = channel.table.places16(simd, values).to_array();
            for (tint, place) in tints.iter_mut().zip(places) {
                for (sum, value) in tint.iter_mut().zip(channel.table.entry(place)) {
                    *sum += value;
                }
            }
        }
    }
    true
}

/// Adds the extinction and the colour of one channel.
#[inline(always)]
fn add_channel<S: Simd>(
    simd: S,
    job: &TileContext,
    (number, channel): (usize, &ChannelSettings),
    samples: &mut PackedSamples,
) {
    let cells = job.placed.brick.channel(number);
    match channel.reading {
        Reading::Trilinear => interpolate(simd, cells.scalars, samples),
        Reading::Nearest => nearest(cells.scalars, samples),
    }
    let with_share = cells.gradients.is_some() || !job.settings.gains.is_none();
    classify_channel(simd, &channel.table, samples, with_share);
    if samples.shown.count == 0 {
        return;
    }
    if let Some(gradients) = cells.gradients {
        find_gradients(simd, job, gradients, samples);
        if channel.reading == Reading::Trilinear {
            follow_gradient(simd, job, samples);
        }
    }
    shade(simd, job, cells.gradients.is_some(), samples);
    let PackedSamples { shown, sums, .. } = samples;
    for k in 0..shown.count {
        let number = shown.number[k] as usize;
        let four = |v: f32| f32x4::splat(simd, v);
        let strength = shown.opacity[k];
        sums.strength[number] += strength;
        let entry = channel.table.entry(shown.entry[k] as i32);
        let tint = f32x4::from_slice(simd, &sums.tint[number]);
        let colour = f32x4::from_slice(simd, &entry) * tint;
        let sum = &mut sums.rgb[number];
        let lit = four(strength * shown.body[k]) * colour + four(strength * shown.highlight[k]);
        (f32x4::from_slice(simd, sum) + lit).store_slice(sum);
    }
}

/// Multiplies extinctions by the ramp over the length of the gradient, where the options have one.
#[inline(always)]
fn follow_gradient<S: Simd>(simd: S, job: &TileContext, samples: &mut PackedSamples) {
    let Some(ramp) = job.settings.sheets.gradient_curve else {
        return;
    };
    for first in (0..samples.shown.count).step_by(LANES) {
        let factor = ramp.factor(simd, shares(simd, &samples.between.gradient, first));
        let strength = &mut samples.shown.opacity[first..first + LANES];
        (f32x16::from_slice(simd, strength) * factor).store_slice(strength);
    }
}

/// Composites the sums.
#[inline(always)]
fn composite<S: Simd>(simd: S, job: &TileContext, scratch: &mut FieldScratch) {
    let FieldScratch {
        samples,
        pixels,
        work,
        ..
    } = scratch;
    let sheets = &job.settings.sheets;
    let with_depth = sheets.depth == DepthRule::Expected;
    let ChannelSums { strength, rgb, .. } = &samples.sums;
    let units_per_slab = job.view.units_per_slab.as_flattened();
    for first in (0..samples.len()).step_by(LANES) {
        let mut units = [0.0; LANES];
        for (units, place) in units.iter_mut().zip(&samples.place[first..]) {
            *units = units_per_slab[(place >> PIXEL_SHIFT) as usize % units_per_slab.len()];
        }
        if job.spans.is_some() {
            take_parts(&mut units, &samples.part[first..]);
        }
        let added = f32x16::from_slice(simd, &strength[first..first + LANES]);
        let added = added * f32x16::from_slice(simd, &units);
        let opacities = opacity(simd, sheets.opacity, added).to_array();
        let waiting = samples.len() - first;
        for (lane, &opacity) in opacities.iter().enumerate().take(waiting) {
            let k = first + lane;
            if !(strength[k] > 0.0) {
                continue;
            }
            let colour = |weight: f32| {
                let share = weight / strength[k].max(f32::MIN_POSITIVE);
                f32x4::splat(simd, share) * f32x4::from_slice(simd, &rgb[k])
            };
            let pixel = (samples.place[k] >> PIXEL_SHIFT) as usize;
            let z = with_depth.then_some(samples.camera_z[k]);
            let opacity = (opacity, sheets.min_transmittance);
            work.contributed += usize::from(pixels.add(simd, pixel, opacity, z, colour));
        }
    }
}
