//! Segments of rays between the faces of cells, each classified as a whole: for transfer functions with narrow peaks.
//!
//! Between the faces of one cell the trilinear field is a cubic along a ray, without a kink; its eight corners are
//! gathered, and the field is read at the ends of equal segments inside. Along a segment the scalar is taken to
//! change linearly, and the transfer function is integrated between its ends (`slabs::table`): a shell that is
//! thinner than the distance of samples keeps its opacity, where samples would hit it or miss it and draw rings.
//! Cells that cannot show anything are skipped; segments in the others wait in a list (`lists`). Of those a sixth shows anything: the
//! segments that meet the transfer function's shown scalars are selected, integrated and lit a vector at a time, and composited one by one,
//! in the order in which rays meet them. Bricks share their faces to the bit.
//! Limits: the field is linear between the ends of a segment; lit by the gradient at the middle of its visible part.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16, i32x16, mask32x8, mask32x16, u8x64, u32x16};
use fearless_simd_macros::simd;
use resample_core::composite::{DepthRule, opacity};

use crate::bricks::cells::{CELL_SIDE, CELLS, FaceBytes, face_value};
use crate::field::settings::{AnchoredRays, TileContext};
use crate::field::walk::cell_sample::{CellBox, Located};
use crate::field::walk::corners;
use crate::field::walk::corners::{Corners, unmasked};
use crate::field::walk::gradient::interpolated_gradient;
use crate::field::walk::lists::{Found, LANE_NUMBERS, PAIR_LANES, Segment, SegmentList};
use crate::field::walk::rays::Rays;
use crate::field::walk::scratch::{FieldScratch, Window};
use crate::light::{Lit, share_of_light};
use crate::slabs::table::{Prefix, TransferIntegrals};
use crate::slabs::view::{HalfRow, LANES};

/// Most steps of a ray in a brick: one, and one more for each face that it may cross.
const MOST_CELLS: usize = 3 * CELL_SIDE + 1;

/// Where rays are on their way from cell to cell.
#[derive(Clone, Copy)]
struct Walk<S: Simd> {
    /// Cell, counted from the brick's first.
    cell: [f32x16<S>; 3],
    /// Along each axis: where the cell ends, how far it is through a cell, and the next cell's number less this one's.
    end: [f32x16<S>; 3],
    stride: [f32x16<S>; 3],
    sign: [f32x16<S>; 3],
    at: f32x16<S>,
    last: f32x16<S>,
}

/// Two half rows of rays, one below the other, in a brick; and the integrals that classify their segments.
struct PairInBrick<'a, S: Simd> {
    job: &'a TileContext<'a>,
    integrals: &'a TransferIntegrals,
    rows: [Rays<'a, S>; 2],
    start: [f32x16<S>; 3],
    direction: [f32x16<S>; 3],
}

/// The part of each ray in a cell.
struct CellPart<S: Simd> {
    cell: [f32x16<S>; 3],
    /// Its number in the brick.
    number: u32x16<S>,
    near: f32x16<S>,
    far: f32x16<S>,
    /// The rays in it.
    inside: mask32x16<S>,
}

/// Composites what the rays of a tile see of a brick. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
pub(crate) fn add_brick<S: Simd, const SHADED: bool>(
    simd: S,
    job: &TileContext,
    rays: &AnchoredRays,
    window: Window,
    scratch: &mut FieldScratch,
) -> (usize, bool) {
    let Some(integrals) = job.settings.sheets.table.integrals() else {
        return (0, false);
    };
    let cells = CellBox::new(job.placed.brick, &job.settings.sheets.anchor);
    let (mut touched, contributed) = (0, scratch.work.contributed);
    scratch.segments.halves = if job.settings.segments.is_multiple_of(2) {
        2
    } else {
        1
    };
    for pair in window.rows[0] / 2..window.rows[1].div_ceil(2) {
        for half in window.columns[0] / LANES..window.columns[1].div_ceil(LANES) {
            let (row, first) = (2 * pair, half * LANES);
            touched += PAIR_LANES;
            let above = Rays::new(simd, rays, &cells, HalfRow { row, first });
            let row = row + 1;
            let below = Rays::new(simd, rays, &cells, HalfRow { row, first });
            let pair = PairInBrick::new(simd, job, integrals, [above, below]);
            add_pair::<S, SHADED>(simd, &pair, scratch);
        }
    }
    flush::<S, SHADED>(simd, job, integrals, scratch);
    let seen = scratch.work.contributed > contributed;
    (
        touched,
        seen && scratch
            .pixels
            .is_opaque(simd, job.settings.sheets.min_transmittance),
    )
}

#[inline(always)]
fn add_pair<S: Simd, const SHADED: bool>(
    simd: S,
    pair: &PairInBrick<S>,
    scratch: &mut FieldScratch,
) {
    let (first, last) = pair.rows[0].inside_brick(simd, pair.job, 0.0);
    let (first_below, last_below) = pair.rows[1].inside_brick(simd, pair.job, 0.0);
    let (first, last) = (first.combine(first_below), last.combine(last_below));
    let in_view = last.simd_gt(first);
    let mut open = pair.open(simd, scratch);
    if (in_view & open).all_false() {
        return;
    }
    let mut walk = Walk::new(simd, pair, first, in_view.select(last, first));
    for _ in 0..MOST_CELLS {
        let (cell, near) = (walk.cell, walk.at);
        walk.step(simd);
        let (number, shown) = pair.shown(simd, cell);
        let inside = open & walk.at.simd_gt(near) & shown;
        if !inside.all_false() {
            let part = CellPart {
                cell,
                number,
                near,
                far: walk.at,
                inside,
            };
            if add_cell::<S, SHADED>(simd, pair, &part, scratch) {
                open &= pair.open(simd, scratch);
            }
        }
        if (open & walk.at.simd_lt(walk.last)).all_false() {
            break;
        }
    }
}

impl<S: Simd> Walk<S> {
    #[inline(always)]
    fn new(simd: S, pair: &PairInBrick<S>, first: f32x16<S>, last: f32x16<S>) -> Self {
        let constant = |v: f32| f32x16::splat(simd, v);
        let zero = [constant(0.0); 3];
        let mut walk = Self {
            cell: zero,
            end: zero,
            stride: zero,
            sign: zero,
            at: first,
            last,
        };
        let cells = pair.rows[0].cells;
        for axis in 0..3 {
            let (corner, low, high) = (cells.corner[axis], cells.low[axis], cells.high[axis]);
            let [above, below] = &pair.rows;
            let inverse = above.inverse(simd, axis).combine(below.inverse(simd, axis));
            let start = pair.start[axis] - constant(corner);
            let place = pair.direction[axis].mul_add(first, start);
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
        let zero = f32x16::splat(simd, 0.0);
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

/// Takes the parts of rays in a cell into the list, cut into as many as their segments need. Returns whether any pixel may
/// have become more opaque.
#[inline(always)]
fn add_cell<S: Simd, const SHADED: bool>(
    simd: S,
    pair: &PairInBrick<S>,
    part: &CellPart<S>,
    scratch: &mut FieldScratch,
) -> bool {
    let constant = |v: f32| f32x16::splat(simd, v);
    let job = pair.job;
    let mut inside = part.inside;
    if job.placed.brick.mask.is_some() {
        let middle = (part.near + part.far) * constant(0.5);
        inside &= unmasked(simd, job, part.number, pair.share(simd, part, middle));
    }
    let count = job.settings.segments / scratch.segments.halves;
    let length = (part.far - part.near) * constant(1.0 / count as f32);
    let (mut near, mut from) = (part.near, pair.share(simd, part, part.near));
    let mut is_flushed = false;
    for number in 1..=count {
        let far = length.mul_add(constant(number as f32), part.near);
        let to = pair.share(simd, part, far);
        let found = Found {
            inside,
            cell: part.number,
            at: pair.rows[0].at,
            z: [near, far],
            share: [from, to],
        };
        scratch.segments.add(simd, &found);
        if scratch.segments.is_full() {
            flush::<S, SHADED>(simd, job, pair.integrals, scratch);
            is_flushed = true;
        }
        (near, from) = (far, to);
    }
    is_flushed
}

impl<'a, S: Simd> PairInBrick<'a, S> {
    #[inline(always)]
    fn new(
        simd: S,
        job: &'a TileContext<'a>,
        integrals: &'a TransferIntegrals,
        rows: [Rays<'a, S>; 2],
    ) -> Self {
        let zero = [f32x16::splat(simd, 0.0); 3];
        let (mut start, mut direction) = (zero, zero);
        for axis in 0..3 {
            start[axis] = rows[0].start[axis].combine(rows[1].start[axis]);
            direction[axis] = rows[0].direction[axis].combine(rows[1].direction[axis]);
        }
        Self {
            job,
            integrals,
            rows,
            start,
            direction,
        }
    }

    /// The pixels that are not opaque.
    #[inline(always)]
    fn open(&self, simd: S, scratch: &FieldScratch) -> mask32x16<S> {
        let HalfRow { row, first } = self.rows[0].at;
        let left = &scratch.pixels.transmittance;
        let above = f32x8::from_slice(simd, &left[row][first..first + LANES]);
        let below = f32x8::from_slice(simd, &left[row + 1][first..first + LANES]);
        let least = self.job.settings.sheets.min_transmittance;
        above
            .combine(below)
            .simd_ge(f32x16::splat(simd, least.max(f32::MIN_POSITIVE)))
    }

    /// The numbers of cells, and which of them may be seen.
    #[inline(always)]
    fn shown(&self, simd: S, [x, y, z]: [f32x16<S>; 3]) -> (u32x16<S>, mask32x16<S>) {
        let side = f32x16::splat(simd, CELL_SIDE as f32);
        let numbers = z.mul_add(side, y).mul_add(side, x).to_int::<i32x16<S>>();
        let cell: u32x16<S> = numbers.bitcast();
        let bits = u8x64::from_slice(simd, self.job.placed.brick.shown.rows());
        let number = cell & u32x16::splat(simd, CELLS as u32 - 1);
        (number, corners::shown(simd, bits, cell))
    }

    /// Where rays are in their cells.
    #[inline(always)]
    fn share(&self, simd: S, part: &CellPart<S>, t: f32x16<S>) -> [f32x16<S>; 3] {
        let mut share = [f32x16::splat(simd, 0.0); 3];
        for (axis, share) in share.iter_mut().enumerate() {
            let corner = f32x16::splat(simd, self.rows[0].cells.corner[axis]) + part.cell[axis];
            *share = self.direction[axis].mul_add(t, self.start[axis] - corner);
        }
        share
    }
}

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
    scratch: &mut FieldScratch,
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
    scratch: &mut FieldScratch,
) -> usize {
    let list = &mut scratch.segments;
    let (brick, table) = (job.placed.brick, &job.settings.sheets.table);
    let halves = list.halves as usize;
    scratch.work.computed += halves * list.count.next_multiple_of(PAIR_LANES);
    scratch.work.shown += halves * list.count;
    let mut met = 0;
    for first in (0..list.count).step_by(PAIR_LANES) {
        let corners = Corners::new(simd, &brick.scalars, |lane| list.cell(first + lane) as u32);
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
    scratch: &mut FieldScratch,
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
    let unlit = Lit {
        body: constant(1.0),
        highlight: constant(0.0),
    };
    let light = if SHADED {
        let light = light(simd, job, shown, share, &scratch.segments).unwrap_or(unlit);
        darkened(simd, job, (shown, share), &scratch.segments, light)
    } else {
        unlit
    };
    let (body, highlight) = (light.body, light.highlight);
    let (bodies, highlights) = (body.to_array(), highlight.to_array());
    let least = settings.min_transmittance.max(f32::MIN_POSITIVE);
    let with_depth = settings.depth == DepthRule::Expected;
    for lane in 0..LANES {
        let pixel = scratch.segments.pixel(shown.segments[lane].part);
        if bits >> lane & 1 == 0 {
            continue;
        }
        let z = with_depth.then_some(camera_z[lane]);
        let colour = |weight: f32| {
            let body = f32x4::splat(simd, weight * bodies[lane]);
            let highlight = f32x4::splat(simd, weight * highlights[lane]);
            body * f32x4::from_slice(simd, &colours[lane]) + highlight
        };
        let opacity = (opacities[lane], least);
        let is_seen = scratch.pixels.add(simd, pixel, opacity, z, colour);
        scratch.work.contributed += usize::from(is_seen);
    }
}

/// As much of the light as reaches that place of each segment, where shadows or occlusion are drawn.
#[inline(always)]
fn darkened<S: Simd>(
    simd: S,
    job: &TileContext,
    (shown, share): (&Shown<S>, f32x8<S>),
    list: &SegmentList,
    light: Lit<f32x8<S>>,
) -> Lit<f32x8<S>> {
    let (gains, tables) = (job.settings.gains, job.placed.light);
    if gains.is_none() {
        return light;
    }
    let shares = share.to_array();
    let of = |tables: Option<(&FaceBytes, f32)>| {
        let (faces, gain) = tables?;
        let mut roots = [0.0; LANES];
        for (lane, &segment) in shown.segments.iter().enumerate() {
            let at = [0, 1, 2].map(|axis| {
                let [near, far] = [0, 1].map(|end| list.share(segment, end, axis));
                (far - near).mul_add(shares[lane], near)
            });
            roots[lane] = face_value(faces, list.cell(segment.part), at);
        }
        Some(share_of_light(simd, f32x8::from_slice(simd, &roots), gain))
    };
    let (sun, sky) = (of(tables.sun.zip(gains.sun)), of(tables.sky.zip(gains.sky)));
    let lit = sun.map_or(light, |sun| light.shadowed(simd, sun));
    sky.map_or(lit, |sky| lit.occluded(simd, sky, sun.is_some()))
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
