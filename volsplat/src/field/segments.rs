//! Segments of rays between the faces of cells, each classified as a whole: for transfer functions with narrow peaks.
//!
//! Between the faces of one cell the trilinear field is a cubic along a ray, without a kink; its eight corners are
//! gathered, and the field is read at the ends of equal segments inside. Along a segment the scalar is taken to
//! change linearly, and the transfer function is integrated between its ends (`sheets::integrals`): a shell that is
//! thinner than the distance of samples keeps its opacity, where samples would hit it or miss it and draw rings.
//! Cells that cannot show anything are passed over; segments in the others wait in a list (`segment_list`). Bricks share their faces to the bit.
//! Limits: the field is linear between the ends of a segment; lit by the gradient at the middle of what it shows.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, mask32x8, u8x64, u32x8, u32x16};
use fearless_simd_macros::simd;

use super::iso_rays::AnchoredRays;
use super::rays::Rays;
use crate::bricks::cells::{CELL_SIDE, CELLS};
use crate::field::cell_sample::{CellBox, Located, places_of};
use crate::field::clipped::masked;
use crate::field::gather::{GatherScratch, Window};
use crate::field::job::Job;
use crate::field::segment_flush::flush;
use crate::field::segment_list::Found;
use crate::sheets::integrals::TransferIntegrals;
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
    /// Its number in the brick.
    number: u32x8<S>,
    near: f32x8<S>,
    far: f32x8<S>,
    /// Which rays are in it.
    inside: mask32x8<S>,
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
    let (mut touched, contributed) = (0, scratch.work.contributed);
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
            add_half_row::<S, SHADED>(simd, &row, scratch);
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
fn add_half_row<S: Simd, const SHADED: bool>(
    simd: S,
    row: &RowInBrick<S>,
    scratch: &mut GatherScratch,
) {
    let (first, last) = row.rays.inside_brick(simd, row.job, 0.0);
    let in_view = last.simd_gt(first);
    let mut open = is_open(simd, row, scratch);
    if (in_view & open).all_false() {
        return;
    }
    let mut walk = Walk::new(simd, &row.rays, first, in_view.select(last, first));
    for _ in 0..MOST_CELLS {
        let (cell, near) = (walk.cell, walk.at);
        walk.step(simd);
        let (number, shown) = row.shown(simd, cell);
        let inside = open & walk.at.simd_gt(near) & shown;
        if !inside.all_false() {
            let part = CellPart {
                cell,
                number,
                near,
                far: walk.at,
                inside,
            };
            add_cell::<S, SHADED>(simd, row, &part, scratch);
            open &= is_open(simd, row, scratch);
        }
        if (open & walk.at.simd_lt(walk.last)).all_false() {
            break;
        }
    }
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

/// Takes the segments of rays in a cell into the list.
#[inline(always)]
fn add_cell<S: Simd, const SHADED: bool>(
    simd: S,
    row: &RowInBrick<S>,
    part: &CellPart<S>,
    scratch: &mut GatherScratch,
) {
    let constant = |v: f32| f32x8::splat(simd, v);
    let job = row.job;
    let mut inside = part.inside;
    if job.placed.brick.mask.is_some() {
        let middle = (part.near + part.far) * constant(0.5);
        inside &= masked(simd, job, &row.located(simd, part, middle)).inside;
    }
    let count = job.settings.segments;
    let length = (part.far - part.near) * constant(1.0 / count as f32);
    let (mut near, mut from) = (part.near, row.share(simd, part, part.near));
    for number in 1..=count {
        let far = length.mul_add(constant(number as f32), part.near);
        let to = row.share(simd, part, far);
        let found = Found {
            inside,
            cell: part.number,
            at: row.rays.at,
            z: [near, far],
            share: [from, to],
        };
        scratch.segments.add(simd, &found);
        if scratch.segments.is_full() {
            flush::<S, SHADED>(simd, job, row.integrals, scratch);
        }
        (near, from) = (far, to);
    }
}

impl<S: Simd> RowInBrick<'_, S> {
    /// The numbers of cells, and which of them may be seen.
    #[inline(always)]
    fn shown(&self, simd: S, [x, y, z]: [f32x8<S>; 3]) -> (u32x8<S>, mask32x8<S>) {
        let constant = |v: u32| u32x8::splat(simd, v);
        let side = f32x8::splat(simd, CELL_SIDE as f32);
        let numbers = z.mul_add(side, y).mul_add(side, x).to_int::<i32x8<S>>();
        let cell: u32x8<S> = numbers.bitcast();
        // The lowest byte of each lane is looked up, the others give something that is not looked at.
        let rows: u8x64<S> = (cell >> 3).combine(constant(0)).bitcast();
        let bits = u8x64::from_slice(simd, self.job.placed.brick.shown.rows());
        let found: u32x16<S> = bits.swizzle_dyn(rows).bitcast();
        let (row, _) = found.split();
        let bit = row >> (cell & constant(7)) & constant(1);
        (cell & constant(CELLS as u32 - 1), bit.simd_eq(constant(1)))
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

    #[inline(always)]
    fn located(&self, simd: S, part: &CellPart<S>, t: f32x8<S>) -> Located<S> {
        Located {
            at: self.rays.at,
            position: [t; 3],
            inside: part.inside,
            places: places_of(simd, part.cell),
            share: self.share(simd, part, t),
        }
    }
}
