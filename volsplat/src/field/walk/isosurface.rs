//! The surface at one scalar: along each ray, brick by brick, where the trilinear field crosses it.
//!
//! Inside a brick a ray runs from face to face; it is sampled at both and between them at steps of at most a slab. Where
//! two neighbours lie on either side of the surface, the crossing is found by bisection in the field itself, to 1/1024 of a
//! step and a linear fit inside it: so the surface lies where the field has it, whatever the slabs. It is lit by the
//! gradient there. Bricks whose cells do not hold the scalar are not there at all.
//! Limits: a ray that goes in and out between two samples is not seen to do so.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8};
use fearless_simd_macros::simd;
use resample_core::maps::TilePlane;

use super::rays::Rays;
use crate::bricks::cells::FaceBytes;
use crate::field::settings::{AnchoredRays, IsoSettings, TileContext};
use crate::field::walk::cell_sample::{
    CellBox, Corners, Located, in_box_cells, interpolated, masked,
};
use crate::field::walk::gradient::interpolated_gradient;
use crate::field::walk::scratch::{FieldScratch, WeightedRow, Window, set_lanes};
use crate::light::{Lit, share_of_light};
use crate::slabs::view::{HalfRow, LANES};

/// How far a ray is followed beyond the faces of a brick, voxels, so that a crossing on a face that rounding puts outside
/// of both bricks is found by one of them: ten times the error of an f32 position.
const OVERLAP: f32 = 2e-4;

/// Halvings of a step between two samples.
const HALVINGS: usize = 10;

/// A step along rays, with the field at both ends less the surface's value.
#[derive(Clone, Copy)]
struct Step<S: Simd> {
    /// Where the surface lies between both ends.
    crosses: mask32x8<S>,
    near: f32x8<S>,
    far: f32x8<S>,
    at_near: f32x8<S>,
    at_far: f32x8<S>,
}

/// Draws the surface inside a brick. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
pub(crate) fn add_brick<S: Simd>(
    simd: S,
    job: &TileContext,
    iso: &IsoSettings,
    rays: &AnchoredRays,
    window: Window,
    scratch: &mut FieldScratch,
) -> (usize, bool) {
    let cells = CellBox::new(job.placed.brick, &job.settings.sheets.anchor);
    let (mut touched, mut seen) = (0, false);
    for row in window.rows[0]..window.rows[1] {
        for half in window.columns[0] / LANES..window.columns[1].div_ceil(LANES) {
            let at = HalfRow {
                row,
                first: half * LANES,
            };
            touched += LANES;
            let rays = Rays::new(simd, rays, &cells, at);
            seen |= add_half_row(simd, job, iso, &rays, scratch);
        }
    }
    (
        touched,
        seen && scratch
            .pixels
            .is_opaque(simd, job.settings.sheets.min_transmittance),
    )
}

#[inline(always)]
fn add_half_row<S: Simd>(
    simd: S,
    job: &TileContext,
    iso: &IsoSettings,
    rays: &Rays<S>,
    scratch: &mut FieldScratch,
) -> bool {
    let constant = |v: f32| f32x8::splat(simd, v);
    let at = rays.at;
    let range = at.first..at.first + LANES;
    let load = |plane: &TilePlane| f32x8::from_slice(simd, &plane[at.row][range.clone()]);
    let (first, last) = rays.inside_brick(simd, job, OVERLAP);
    let floor = constant(job.settings.sheets.min_transmittance.max(f32::MIN_POSITIVE));
    let in_view = last.simd_gt(first);
    let mut left = in_view & load(&scratch.pixels.transmittance).simd_ge(floor);
    if left.all_false() {
        return false;
    }
    let longest = left
        .select(last - first, constant(0.0))
        .to_array()
        .into_iter()
        .fold(0.0, f32::max);
    let steps = (longest / iso.step).ceil().max(1.0);
    let length = (last - first) * constant(1.0 / steps);
    // Not a closure: one that is called twice is left as a call here, without the vector instructions.
    let value = constant(iso.value);
    let at_near = field(simd, job, rays, first) - value;
    let mut step = Step {
        crosses: left,
        near: first,
        far: first,
        at_near,
        at_far: constant(0.0),
    };
    let mut seen = false;
    for number in 1..=steps as usize {
        step.far = length.mul_add(constant(number as f32), first);
        step.at_far = field(simd, job, rays, step.far) - value;
        scratch.work.computed += LANES;
        scratch.work.shown += set_lanes(left);
        step.crosses = left & is_across(simd, step.at_near, step.at_far);
        if !step.crosses.all_false() {
            seen |= add_surface(simd, job, iso, rays, step, scratch);
            left &= load(&scratch.pixels.transmittance).simd_ge(floor);
            if left.all_false() {
                return true;
            }
        }
        (step.near, step.at_near) = (step.far, step.at_far);
    }
    seen
}

/// Returns true if two values lie on either side of 0; 0 itself counts as above.
#[inline(always)]
fn is_across<S: Simd>(simd: S, a: f32x8<S>, b: f32x8<S>) -> mask32x8<S> {
    let zero = f32x8::splat(simd, 0.0);
    (a.simd_ge(zero) & b.simd_lt(zero)) | (a.simd_lt(zero) & b.simd_ge(zero))
}

#[inline(always)]
fn located<S: Simd>(simd: S, rays: &Rays<S>, t: f32x8<S>) -> Located<S> {
    let at = |axis: usize| rays.direction[axis].mul_add(t, rays.start[axis]);
    in_box_cells(simd, rays.cells, rays.at, [at(0), at(1), at(2)])
}

/// The field along rays.
#[inline(always)]
fn field<S: Simd>(simd: S, job: &TileContext, rays: &Rays<S>, t: f32x8<S>) -> f32x8<S> {
    let located = located(simd, rays, t);
    interpolated(
        simd,
        &job.placed.brick.scalars,
        &located.places,
        located.share,
    )
}

/// Composites the surface that rays cross in a step. Returns whether any of it is seen.
#[inline(always)]
fn add_surface<S: Simd>(
    simd: S,
    job: &TileContext,
    iso: &IsoSettings,
    rays: &Rays<S>,
    mut step: Step<S>,
    scratch: &mut FieldScratch,
) -> bool {
    let at = rays.at;
    let crosses = step.crosses;
    let constant = |v: f32| f32x8::splat(simd, v);
    for _ in 0..HALVINGS {
        let middle = (step.near + step.far) * constant(0.5);
        let value = field(simd, job, rays, middle) - constant(iso.value);
        let beyond = is_across(simd, value, step.at_far);
        step.near = beyond.select(middle, step.near);
        step.at_near = beyond.select(value, step.at_near);
        step.far = beyond.select(step.far, middle);
        step.at_far = beyond.select(step.at_far, value);
    }
    // The ends lie on either side, so that they differ; where nothing crosses, the quotient is not looked at.
    let share = step.at_near / (step.at_near - step.at_far);
    let hit = share.mul_add(step.far - step.near, step.near);
    let range = at.first..at.first + LANES;
    let load = |plane: &TilePlane| f32x8::from_slice(simd, &plane[at.row][range.clone()]);
    let mut found = located(simd, rays, crosses.select(hit, step.near));
    // A crossing on a face that two bricks share is found by both of them.
    let apart = constant(4.0 * OVERLAP) * reach_per_voxel(simd, rays);
    found.inside = crosses & hit.simd_gt(load(&scratch.last_hit) + apart);
    let found = masked(simd, job, &found);
    if found.inside.all_false() {
        return false;
    }
    scratch.work.contributed += set_lanes(found.inside);
    let zero = constant(0.0);
    let before = load(&scratch.pixels.transmittance);
    let weight = found.inside.select(before * constant(iso.opacity), zero);
    let depth = hit + constant(job.settings.sheets.anchor.camera_z as f32);
    found
        .inside
        .select(hit, load(&scratch.last_hit))
        .store_slice(&mut scratch.last_hit[at.row][range.clone()]);
    let lit = lit(simd, job, &found, weight).unwrap_or(Lit {
        body: constant(1.0),
        highlight: zero,
    });
    let Lit { body, highlight } = darkened(simd, job, &found, lit);
    let samples = WeightedRow {
        weight,
        camera_z: Some(found.inside.select(depth, zero)),
        body: weight * body,
        highlight: weight * highlight,
        rgb: iso.rgb,
    };
    scratch.pixels.add_row(simd, at, &samples);
    true
}

/// Camera z that a ray passes along a voxel, at most.
#[inline(always)]
fn reach_per_voxel<S: Simd>(simd: S, rays: &Rays<S>) -> f32x8<S> {
    let [x, y, z] = rays.direction;
    let length2 = x.mul_add(x, y.mul_add(y, z * z));
    f32x8::splat(simd, 1.0) / length2.sqrt()
}

/// Lights the samples whose weight is above 0; `None` where nothing is shaded.
#[inline(always)]
fn lit<S: Simd>(
    simd: S,
    job: &TileContext,
    located: &Located<S>,
    weight: f32x8<S>,
) -> Option<Lit<f32x8<S>>> {
    let (shade, gradients) = (
        job.settings.sheets.shade.as_ref()?,
        job.placed.brick.gradients.as_ref()?,
    );
    let gradients = (gradients, &job.settings.from_differences);
    let gradient = interpolated_gradient(simd, gradients, located, weight);
    Some(shade.light(simd, gradient, job.view.rays(simd, located.at)))
}

/// As much of the light as reaches the samples, where shadows or occlusion are drawn.
#[inline(always)]
fn darkened<S: Simd>(
    simd: S,
    job: &TileContext,
    located: &Located<S>,
    light: Lit<f32x8<S>>,
) -> Lit<f32x8<S>> {
    let (gains, tables) = (job.settings.gains, job.placed.light);
    let mut lit = light;
    if let Some((faces, gain)) = tables.sun.zip(gains.sun) {
        lit = lit.shadowed(simd, share_of(simd, located, (faces, gain)));
    }
    if let Some((faces, gain)) = tables.sky.zip(gains.sky) {
        lit = lit.occluded(
            simd,
            share_of(simd, located, (faces, gain)),
            gains.sun.is_some(),
        );
    }
    lit
}

/// The share of light that reaches the samples.
#[inline(always)]
fn share_of<S: Simd>(simd: S, located: &Located<S>, (faces, gain): (&FaceBytes, f32)) -> f32x8<S> {
    let corners = Corners::of_bytes(simd, faces, &located.places);
    share_of_light(simd, corners.interpolated(located.share), gain)
}
