//! Segments of rays between the faces of cells, each classified as a whole: for transfer functions with narrow peaks.
//!
//! Between the faces of one cell the trilinear field is a cubic along a ray, without a kink; its eight corners are
//! gathered once, and the field is read at the ends of equal segments inside. Along a segment the scalar is taken to
//! change linearly, and the transfer function is integrated between its ends (`sheets::integrals`): a shell that is
//! thinner than the distance of samples keeps its opacity, where samples would hit it or miss it and draw rings.
//! Cells that cannot show anything are passed over. Bricks share their faces to the bit.
//! Limits: the field is linear between the ends of a segment; lit by the gradient at the middle of what it shows.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, mask32x8};
use fearless_simd_macros::simd;
use resample_core::composite::{DepthRule, opacity};

use super::iso_rays::AnchoredRays;
use super::rays::Rays;
use crate::bricks::cells::CELL_SIDE;
use crate::field::cell_sample::{CellBox, Corners, Located, places_of};
use crate::field::clipped::masked;
use crate::field::gather::{GatherScratch, Window, set_lanes};
use crate::field::job::Job;
use crate::field::lit::lit;
use crate::sheets::integrals::{Prefix, TransferIntegrals};
use crate::sheets::view::{HalfRow, LANES};

/// Most steps of a ray in a brick: one, and one more for each face that it may cross.
const MOST_CELLS: usize = 3 * CELL_SIDE + 1;

/// Where rays are on their way from cell to cell.
#[derive(Clone, Copy)]
struct Walk<S: Simd> {
    /// Cell, counted from the brick's first.
    cell: [f32x8<S>; 3],
    /// Along each axis: where the cell ends, how far it is through a cell, and the next cell's number less this one's.
    end: [f32x8<S>; 3],
    stride: [f32x8<S>; 3],
    sign: [f32x8<S>; 3],
    at: f32x8<S>,
    last: f32x8<S>,
}

/// Half a row of rays in a brick, and how what they meet is classified.
struct RowInBrick<'a, S: Simd> {
    job: &'a Job<'a>,
    integrals: &'a TransferIntegrals,
    rays: Rays<'a, S>,
}

/// The part of each ray in a cell.
struct CellPart<S: Simd> {
    cell: [f32x8<S>; 3],
    places: [i32; LANES],
    near: f32x8<S>,
    far: f32x8<S>,
    /// Which rays are in it.
    inside: mask32x8<S>,
}

/// A piece of each ray inside one cell.
struct Segment<S: Simd> {
    near: f32x8<S>,
    far: f32x8<S>,
    from: Prefix<S>,
    to: Prefix<S>,
    /// Mean extinction of the pieces that are seen, 0 for others.
    strength: f32x8<S>,
}

/// Composites what the rays of a tile see of a brick. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
pub(super) fn add_brick<S: Simd, const SHADED: bool>(
    simd: S,
    job: &Job,
    rays: &AnchoredRays,
    window: Window,
    scratch: &mut GatherScratch,
) -> (usize, bool) {
    let Some(integrals) = job.settings.sheets.table.integrals() else {
        return (0, false);
    };
    let cells = CellBox::new(job.placed.brick, &job.settings.sheets.anchor);
    let (mut touched, mut seen) = (0, false);
    for row in window.rows[0]..window.rows[1] {
        for half in window.columns[0] / LANES..window.columns[1].div_ceil(LANES) {
            let at = HalfRow {
                row,
                first: half * LANES,
            };
            touched += LANES;
            let row = RowInBrick {
                job,
                integrals,
                rays: Rays::new(simd, rays, &cells, at),
            };
            seen |= add_half_row::<S, SHADED>(simd, &row, scratch);
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
fn add_half_row<S: Simd, const SHADED: bool>(
    simd: S,
    row: &RowInBrick<S>,
    scratch: &mut GatherScratch,
) -> bool {
    let (first, last) = row.rays.inside_brick(simd, row.job, 0.0);
    let in_view = last.simd_gt(first);
    let mut open = is_open(simd, row, scratch);
    if (in_view & open).all_false() {
        return false;
    }
    let mut walk = Walk::new(simd, &row.rays, first, in_view.select(last, first));
    let mut seen = false;
    for _ in 0..MOST_CELLS {
        let (cell, near) = (walk.cell, walk.at);
        walk.step(simd);
        let places = places_of(simd, cell);
        let inside = open & walk.at.simd_gt(near) & row.shown(simd, cell);
        if !inside.all_false() {
            let part = CellPart {
                cell,
                places,
                near,
                far: walk.at,
                inside,
            };
            seen |= add_cell::<S, SHADED>(simd, row, &part, scratch);
            open = is_open(simd, row, scratch);
        }
        if (open & walk.at.simd_lt(walk.last)).all_false() {
            break;
        }
    }
    seen
}

/// The pixels that are not opaque.
#[inline(always)]
fn is_open<S: Simd>(simd: S, row: &RowInBrick<S>, scratch: &GatherScratch) -> mask32x8<S> {
    let at = row.rays.at;
    let left = &scratch.pixels.transmittance[at.row][at.first..at.first + LANES];
    let least = row.job.settings.sheets.min_transmittance;
    f32x8::from_slice(simd, left).simd_ge(f32x8::splat(simd, least.max(f32::MIN_POSITIVE)))
}

impl<S: Simd> Walk<S> {
    #[inline(always)]
    fn new(simd: S, rays: &Rays<S>, first: f32x8<S>, last: f32x8<S>) -> Self {
        let constant = |v: f32| f32x8::splat(simd, v);
        let zero = [constant(0.0); 3];
        let mut walk = Self {
            cell: zero,
            end: zero,
            stride: zero,
            sign: zero,
            at: first,
            last,
        };
        for axis in 0..3 {
            let (corner, low, high) = (
                rays.cells.corner[axis],
                rays.cells.low[axis],
                rays.cells.high[axis],
            );
            let inverse = rays.inverse(simd, axis);
            let start = rays.start[axis] - constant(corner);
            let place = rays.direction[axis].mul_add(first, start);
            let cell = place
                .max(constant(low - corner))
                .min(constant(high - corner - 1.0))
                .trunc();
            let forward = inverse.simd_gt(constant(0.0));
            let face = cell + forward.select(constant(1.0), constant(0.0));
            walk.cell[axis] = cell;
            walk.end[axis] = (face - start) * inverse;
            walk.stride[axis] = inverse.abs();
            walk.sign[axis] = forward.select(constant(1.0), constant(-1.0));
        }
        walk
    }

    /// On to the next face.
    #[inline(always)]
    fn step(&mut self, simd: S) {
        let zero = f32x8::splat(simd, 0.0);
        let [x, y, z] = self.end;
        let far = x.min(y).min(z).min(self.last).max(self.at);
        for axis in 0..3 {
            let crossed = self.end[axis].simd_le(far);
            self.cell[axis] += crossed.select(self.sign[axis], zero);
            self.end[axis] += crossed.select(self.stride[axis], zero);
        }
        self.at = far;
    }
}

/// Composites what rays see of a cell. Returns whether that is anything.
#[inline(always)]
fn add_cell<S: Simd, const SHADED: bool>(
    simd: S,
    row: &RowInBrick<S>,
    part: &CellPart<S>,
    scratch: &mut GatherScratch,
) -> bool {
    let constant = |v: f32| f32x8::splat(simd, v);
    let (job, integrals) = (row.job, row.integrals);
    let corners = Corners::new(simd, &job.placed.brick.scalars, &part.places);
    let [least, greatest] = corners.range();
    let [low, high] = job.settings.sheets.table.shown();
    let mut inside = part.inside & least.simd_le(constant(high)) & greatest.simd_ge(constant(low));
    if inside.all_false() {
        return false;
    }
    if job.placed.brick.mask.is_some() {
        let middle = (part.near + part.far) * constant(0.5);
        inside &= masked(simd, job, &row.located(simd, part, middle)).inside;
    }
    let count = job.settings.segments;
    let length = (part.far - part.near) * constant(1.0 / count as f32);
    let (mut seen, mut near) = (false, part.near);
    let mut from = row.place(simd, part, &corners, near);
    for number in 1..=count {
        let far = length.mul_add(constant(number as f32), part.near);
        let to = row.place(simd, part, &corners, far);
        let met = inside & integrals.meets(simd, from, to);
        scratch.work.computed += LANES;
        scratch.work.shown += set_lanes(inside);
        if !met.all_false() {
            let (from, to) = (integrals.up_to(simd, from), integrals.up_to(simd, to));
            let segment = Segment {
                near,
                far,
                from,
                to,
                strength: met.select(integrals.mean(simd, &from, &to), constant(0.0)),
            };
            let shows = segment.strength.simd_gt(constant(0.0));
            if shows.any_true() {
                seen = true;
                scratch.work.contributed += set_lanes(shows);
                add_segment::<S, SHADED>(simd, row, part, &segment, scratch);
            }
        }
        (near, from) = (far, to);
    }
    seen
}

impl<S: Simd> RowInBrick<'_, S> {
    /// Which cells may be seen.
    #[inline(always)]
    fn shown(&self, simd: S, [x, y, z]: [f32x8<S>; 3]) -> mask32x8<S> {
        let side = f32x8::splat(simd, CELL_SIDE as f32);
        let numbers = z.mul_add(side, y).mul_add(side, x).to_int::<i32x8<S>>();
        let numbers = numbers.to_array();
        let mut bits = [0; LANES];
        for lane in 0..LANES {
            bits[lane] = self.job.placed.brick.shown.bit(numbers[lane]);
        }
        i32x8::from_slice(simd, &bits).simd_eq(i32x8::splat(simd, 1))
    }

    /// Where rays are in their cells.
    #[inline(always)]
    fn share(&self, simd: S, part: &CellPart<S>, t: f32x8<S>) -> [f32x8<S>; 3] {
        let mut share = [f32x8::splat(simd, 0.0); 3];
        for (axis, share) in share.iter_mut().enumerate() {
            let corner = f32x8::splat(simd, self.rays.cells.corner[axis]) + part.cell[axis];
            *share = self.rays.direction[axis].mul_add(t, self.rays.start[axis] - corner);
        }
        share
    }

    /// The place in the transfer function of the field on the rays.
    #[inline(always)]
    fn place(&self, simd: S, part: &CellPart<S>, corners: &Corners<S>, t: f32x8<S>) -> f32x8<S> {
        let scalar = corners.interpolated(self.share(simd, part, t));
        self.job.settings.sheets.table.unbounded_place(simd, scalar)
    }

    #[inline(always)]
    fn located(&self, simd: S, part: &CellPart<S>, t: f32x8<S>) -> Located<S> {
        Located {
            at: self.rays.at,
            position: [t; 3],
            inside: part.inside,
            places: part.places,
            share: self.share(simd, part, t),
        }
    }
}

/// Composites a segment.
#[inline(always)]
fn add_segment<S: Simd, const SHADED: bool>(
    simd: S,
    row: &RowInBrick<S>,
    part: &CellPart<S>,
    segment: &Segment<S>,
    scratch: &mut GatherScratch,
) {
    let (job, at) = (row.job, row.rays.at);
    let settings = job.settings;
    let constant = |v: f32| f32x8::splat(simd, v);
    let range = at.first..at.first + LANES;
    let slabs = (segment.far - segment.near) * constant(1.0 / settings.sheets.thickness as f32);
    let units = f32x8::from_slice(simd, &job.view.units_per_slab[at.row][range.clone()]) * slabs;
    let before = f32x8::from_slice(simd, &scratch.pixels.transmittance[at.row][range.clone()]);
    let added = opacity(simd, settings.sheets.opacity, segment.strength * units);
    let weight = before * added;
    (before - weight).store_slice(&mut scratch.pixels.transmittance[at.row][range.clone()]);
    let (strengths, weights) = (segment.strength.to_array(), weight.to_array());
    let mut colours = [[0.0f32; 4]; LANES];
    for lane in 0..LANES {
        if weights[lane] > 0.0 {
            colours[lane] =
                row.integrals
                    .mean_colour(&segment.from, &segment.to, lane, strengths[lane]);
        }
    }
    // Where in the segment the middle of what it shows lies.
    let mut middles = [0.0f32; LANES];
    for lane in 0..LANES {
        middles[lane] = colours[lane][3];
    }
    let span = segment.to.place - segment.from.place;
    let apart = span.abs().simd_gt(constant(1.0));
    let share = (f32x8::from_slice(simd, &middles) - segment.from.place)
        / apart.select(span, constant(1.0));
    let share = apart
        .select(share, constant(0.5))
        .max(constant(0.0))
        .min(constant(1.0));
    let middle = (segment.far - segment.near).mul_add(share, segment.near);
    if settings.sheets.depth == DepthRule::Expected {
        let z = middle + constant(settings.sheets.anchor.camera_z as f32);
        let depth = &mut scratch.pixels.depth[at.row][range.clone()];
        weight
            .mul_add(z, f32x8::from_slice(simd, depth))
            .store_slice(depth);
    }
    let light = if SHADED {
        lit(simd, job, &row.located(simd, part, middle), weight)
    } else {
        None
    };
    let (bodies, highlights) = match light {
        Some(light) => (
            (weight * light.body).to_array(),
            (weight * light.highlight).to_array(),
        ),
        None => (weights, [0.0; LANES]),
    };
    for (lane, sum) in scratch.rgb[at.row][range].iter_mut().enumerate() {
        for channel in 0..3 {
            sum[channel] += bodies[lane] * colours[lane][channel] + highlights[lane];
        }
    }
}
