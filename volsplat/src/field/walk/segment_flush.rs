//! Classifies and composites the segments that wait in a list.
//!
//! Of the segments in cells that may show something a sixth shows anything: those that meet the transfer function's
//! shown scalars are picked, integrated and lit a vector at a time, and composited one by one. Segments keep the order in
//! which rays meet them.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, i32x16, mask32x8, mask32x16, u32x16};
use resample_core::composite::{DepthRule, opacity};

use crate::bricks::cells::{CELL_CORNERS, CELL_ROWS, CELLS, CellBrick, LAST_CELL};
use crate::bricks::scalars::Scalars;
use crate::field::setup::tile_context::TileContext;
use crate::field::walk::cell_sample::Located;
use crate::field::walk::gather::GatherScratch;
use crate::field::walk::gradient::interpolated_gradient;
use crate::field::walk::segment_list::{LANE_NUMBERS, PAIR_LANES, Segment, SegmentList};
use crate::light::Lit;
use crate::slabs::integrals::{Prefix, TransferIntegrals};
use crate::slabs::view::{HalfRow, LANES};

/// Some of the segments that show something.
struct Shown<S: Simd> {
    /// The numbers of the segments in the list, and those that show something.
    segments: [Segment; LANES],
    shows: mask32x8<S>,
    ends: [Prefix<S>; 2],
    /// Mean extinction, and opacity.
    strength: f32x8<S>,
    opacity: f32x8<S>,
    z: [f32x8<S>; 2],
}

/// Composites the segments that wait.
#[inline(always)]
pub(crate) fn flush<S: Simd, const SHADED: bool>(
    simd: S,
    job: &TileContext,
    integrals: &TransferIntegrals,
    scratch: &mut GatherScratch,
) {
    let met = pick(simd, job, integrals, scratch);
    for first in (0..met).step_by(LANES) {
        let lanes = (met - first).min(LANES);
        if let Some(shown) = shown(simd, job, integrals, &scratch.segments, [first, lanes]) {
            composite::<S, SHADED>(simd, job, integrals, &shown, scratch);
        }
    }
    scratch.segments.count = 0;
}

/// Picks the segments between whose ends the transfer function shows something. Returns how many there are.
#[inline(always)]
fn pick<S: Simd>(
    simd: S,
    job: &TileContext,
    integrals: &TransferIntegrals,
    scratch: &mut GatherScratch,
) -> usize {
    let list = &mut scratch.segments;
    let (brick, table) = (job.placed.brick, &job.settings.sheets.table);
    let halves = list.halves as usize;
    scratch.work.computed += halves * list.count.next_multiple_of(PAIR_LANES);
    scratch.work.shown += halves * list.count;
    let mut met = 0;
    for first in (0..list.count).step_by(PAIR_LANES) {
        let corners = corners(simd, brick, list, first);
        let (near, far) = (list.shares(simd, 0, first), list.shares(simd, 1, first));
        let from = table.unbounded_place(simd, corners.interpolated(near));
        let to = table.unbounded_place(simd, corners.interpolated(far));
        if halves == 1 {
            met = add_met(simd, integrals, list, [from, to], [first, met]);
            continue;
        }
        let half = f32x16::splat(simd, 0.5);
        let mut middle = near;
        for (middle, far) in middle.iter_mut().zip(far) {
            *middle = (far - *middle).mul_add(half, *middle);
        }
        let middle = table.unbounded_place(simd, corners.interpolated(middle));
        // Both halves of a part come before the next part's: a ray may have two parts here.
        let ends = [from.zip_low(middle), middle.zip_low(to)];
        met = add_met(simd, integrals, list, ends, [2 * first, met]);
        let ends = [from.zip_high(middle), middle.zip_high(to)];
        met = add_met(simd, integrals, list, ends, [2 * first + PAIR_LANES, met]);
    }
    met
}

/// The values at the corners of the cells of parts.
#[inline(always)]
fn corners<S: Simd>(
    simd: S,
    brick: &CellBrick,
    list: &SegmentList,
    first: usize,
) -> PairCorners<S> {
    let mut values = [f32x16::splat(simd, 0.0); 8];
    let table = match &brick.scalars {
        Scalars::Numbers(table) => table,
        Scalars::Bytes(faces) => {
            let (mut front, mut back) = ([0; PAIR_LANES], [0; PAIR_LANES]);
            for lane in 0..PAIR_LANES {
                let cell = list.cell(first + lane) % CELLS;
                front[lane] = faces[cell];
                back[lane] = faces[cell + CELL_ROWS];
            }
            let faces = [
                u32x16::from_slice(simd, &front),
                u32x16::from_slice(simd, &back),
            ];
            for (k, value) in values.iter_mut().enumerate() {
                let byte = faces[k / 4] >> (8 * (k % 4) as u32) & u32x16::splat(simd, 0xff);
                *value = byte.bitcast::<i32x16<S>>().to_float();
            }
            return PairCorners { values };
        }
    };
    let mut corners = [[0.0; PAIR_LANES]; 8];
    for lane in 0..PAIR_LANES {
        let place = (list.vertex(first + lane) as usize).min(LAST_CELL);
        for (corner, offset) in corners.iter_mut().zip(CELL_CORNERS) {
            corner[lane] = table[place + offset];
        }
    }
    for (value, corner) in values.iter_mut().zip(&corners) {
        *value = f32x16::from_slice(simd, corner);
    }
    PairCorners { values }
}

/// The values at the corners of cells, x fastest.
struct PairCorners<S: Simd> {
    values: [f32x16<S>; 8],
}

impl<S: Simd> PairCorners<S> {
    /// The trilinear mix.
    #[inline(always)]
    fn interpolated(&self, [x, y, z]: [f32x16<S>; 3]) -> f32x16<S> {
        let v = &self.values;
        let front = mix(mix(v[0], v[1], x), mix(v[2], v[3], x), y);
        let back = mix(mix(v[4], v[5], x), mix(v[6], v[7], x), y);
        mix(front, back, z)
    }
}

#[inline(always)]
fn mix<S: Simd>(a: f32x16<S>, b: f32x16<S>, t: f32x16<S>) -> f32x16<S> {
    (b - a).mul_add(t, a)
}

/// Adds those segments, numbered from the first, that meet something to the `met` ones. Returns how many there are then.
#[inline(always)]
fn add_met<S: Simd>(
    simd: S,
    integrals: &TransferIntegrals,
    list: &mut SegmentList,
    [from, to]: [f32x16<S>; 2],
    [first, met]: [usize; 2],
) -> usize {
    let lanes = (list.count * list.halves as usize)
        .saturating_sub(first)
        .min(PAIR_LANES);
    let listed = mask32x16::from_bitmask(simd, (1 << lanes) - 1);
    let some = listed & integrals.meets(simd, from, to);
    if some.all_false() {
        return met;
    }
    let numbers = u32x16::from_slice(simd, &LANE_NUMBERS) + u32x16::splat(simd, first as u32);
    let at = met..met + PAIR_LANES;
    numbers
        .compress(some)
        .store_slice(&mut list.met[at.clone()]);
    from.compress(some)
        .store_slice(&mut list.scalar[0][at.clone()]);
    to.compress(some).store_slice(&mut list.scalar[1][at]);
    met + some.to_bitmask().count_ones() as usize
}

/// The opacities of picked segments, so many from the first; `None` where they show nothing.
#[inline(always)]
fn shown<S: Simd>(
    simd: S,
    job: &TileContext,
    integrals: &TransferIntegrals,
    list: &SegmentList,
    [first, lanes]: [usize; 2],
) -> Option<Shown<S>> {
    let settings = &job.settings.sheets;
    let place = |end: usize| f32x8::from_slice(simd, &list.scalar[end][first..first + LANES]);
    let ends = [
        integrals.up_to(simd, place(0)),
        integrals.up_to(simd, place(1)),
    ];
    let strength = integrals.mean(simd, &ends[0], &ends[1]);
    let shows =
        strength.simd_gt(f32x8::splat(simd, 0.0)) & mask32x8::from_bitmask(simd, (1 << lanes) - 1);
    if shows.all_false() {
        return None;
    }
    let mut segments = [Segment::default(); LANES];
    for (segment, &met) in segments.iter_mut().zip(&list.met[first..first + LANES]) {
        *segment = list.segment(met);
    }
    let units_per_slab = job.view.units_per_slab.as_flattened();
    let (mut z, mut units) = ([[0.0; LANES]; 2], [0.0; LANES]);
    for (lane, &segment) in segments.iter().enumerate() {
        (z[0][lane], z[1][lane]) = (list.z(segment, 0), list.z(segment, 1));
        units[lane] = units_per_slab[list.pixel(segment.part)];
    }
    let z = [
        f32x8::from_slice(simd, &z[0]),
        f32x8::from_slice(simd, &z[1]),
    ];
    let slabs = (z[1] - z[0]) * f32x8::splat(simd, 1.0 / settings.thickness as f32);
    let units = f32x8::from_slice(simd, &units) * slabs;
    Some(Shown {
        segments,
        shows,
        ends,
        strength,
        opacity: opacity(simd, settings.opacity, strength * units),
        z,
    })
}

/// Composites segments one by one behind what their pixels hold.
#[inline(always)]
fn composite<S: Simd, const SHADED: bool>(
    simd: S,
    job: &TileContext,
    integrals: &TransferIntegrals,
    shown: &Shown<S>,
    scratch: &mut GatherScratch,
) {
    let constant = |v: f32| f32x8::splat(simd, v);
    let settings = &job.settings.sheets;
    let (strengths, opacities) = (shown.strength.to_array(), shown.opacity.to_array());
    let [from, to] = &shown.ends;
    let bits = shown.shows.to_bitmask();
    let mut colours = [[0.0f32; 4]; LANES];
    let mut middles = [0.0f32; LANES];
    for lane in 0..LANES {
        if bits >> lane & 1 == 1 {
            colours[lane] = integrals.mean_colour(from, to, lane, strengths[lane]);
            middles[lane] = colours[lane][3];
        }
    }
    // The extinction's mean place along the segment, from 0 at its near end to 1.
    let span = to.place - from.place;
    let apart = span.abs().simd_gt(constant(1.0));
    let share =
        (f32x8::from_slice(simd, &middles) - from.place) / apart.select(span, constant(1.0));
    let share = apart
        .select(share, constant(0.5))
        .max(constant(0.0))
        .min(constant(1.0));
    let middle = (shown.z[1] - shown.z[0]).mul_add(share, shown.z[0]);
    let camera_z = (middle + constant(settings.anchor.camera_z as f32)).to_array();
    let light = if SHADED {
        light(simd, job, shown, share, &scratch.segments)
    } else {
        None
    };
    let (body, highlight) = light.map_or((constant(1.0), constant(0.0)), |light| {
        (light.body, light.highlight)
    });
    let (bodies, highlights) = (body.to_array(), highlight.to_array());
    let least = settings.min_transmittance.max(f32::MIN_POSITIVE);
    let with_depth = settings.depth == DepthRule::Expected;
    for lane in 0..LANES {
        let pixel = scratch.segments.pixel(shown.segments[lane].part);
        let before = scratch.pixels.transmittance.as_flattened()[pixel];
        // Opaque pixels take no more, one by one.
        if bits >> lane & 1 == 0 || !(before >= least) {
            continue;
        }
        scratch.work.contributed += 1;
        let weight = before * opacities[lane];
        scratch.pixels.transmittance.as_flattened_mut()[pixel] = before - weight;
        if with_depth {
            let depth = &mut scratch.pixels.depth.as_flattened_mut()[pixel];
            *depth = weight.mul_add(camera_z[lane], *depth);
        }
        let (body, highlight) = (weight * bodies[lane], weight * highlights[lane]);
        let sum = &mut scratch.rgb.as_flattened_mut()[pixel];
        for channel in 0..3 {
            sum[channel] += body * colours[lane][channel] + highlight;
        }
    }
}

/// The light at that place of each segment.
#[inline(always)]
fn light<S: Simd>(
    simd: S,
    job: &TileContext,
    shown: &Shown<S>,
    share: f32x8<S>,
    list: &SegmentList,
) -> Option<Lit<f32x8<S>>> {
    let (shade, gradients) = (
        job.settings.sheets.shade.as_ref()?,
        job.placed.brick.gradients.as_ref()?,
    );
    let mut ends = [[[0.0; LANES]; 3]; 2];
    let mut rays = [[0.0; LANES]; 3];
    for (lane, &segment) in shown.segments.iter().enumerate() {
        let pixel = list.pixel(segment.part);
        for axis in 0..3 {
            ends[0][axis][lane] = list.share(segment, 0, axis);
            ends[1][axis][lane] = list.share(segment, 1, axis);
            rays[axis][lane] = job.view.ray_in_world[axis].as_flattened()[pixel];
        }
    }
    let load = |values: &[f32; LANES]| f32x8::from_slice(simd, values);
    let between = |axis: usize| {
        let (near, far) = (load(&ends[0][axis]), load(&ends[1][axis]));
        (far - near).mul_add(share, near)
    };
    let middle = [between(0), between(1), between(2)];
    let located = Located {
        at: HalfRow { row: 0, first: 0 },
        position: middle,
        inside: shown.shows,
        places: std::array::from_fn(|lane| list.vertex(shown.segments[lane].part)),
        share: middle,
    };
    let weight = shown
        .shows
        .select(f32x8::splat(simd, 1.0), f32x8::splat(simd, 0.0));
    let gradients = (gradients, &job.settings.from_differences);
    let gradient = interpolated_gradient(simd, gradients, &located, weight);
    Some(shade.light(
        simd,
        gradient,
        [load(&rays[0]), load(&rays[1]), load(&rays[2])],
    ))
}
