//! Planes of a brick over a tile: which pixels of its blocks of 4x4 pixels take samples, and on which planes.
//!
//! The rays of a block are cut with the box of the brick's visible cells, all at once; the planes between the first
//! entry and the last exit are those on which samples can lie inside, give or take the rounding of positions.
//!
//! Planes are as far apart as the finest axis requires. Where another axis of the brick is a thousand times as long, a tile
//! sees most of its planes beside the brick: the rays of one pixel meet a few among millions. A range of many planes is cut with
//! the rays of the tile at once; where they meet nothing it is skipped, else each of its halves is tested in turn. The cost follows
//! the planes that are met. Skipped planes have no samples: pictures are the same.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, mask32x16};
use fearless_simd_macros::simd;
use resample_core::tile::TILE_PX;

use super::PackedRule;
use crate::field::settings::{PlacedBrick, TileContext};
use crate::field::walk::cell_sample::CellBox;
use crate::field::walk::scratch::{FieldScratch, POSITION_ERROR, REMEMBERED_PLANES, Window};
use crate::slabs::view::{BLOCK_PX, PlaneView};

/// Blocks along a tile's side.
const BLOCKS: usize = TILE_PX / BLOCK_PX;

/// Least movement per plane along an axis, voxels: below it, a ray is taken to run along the faces of that axis.
const LEAST_STEP: f32 = 1e-20;

/// The pixels of each block that take samples, a bit for each.
pub(crate) type OpenBlocks = [[u64; BLOCKS]; BLOCKS];

/// The pixels of each block that take samples of the brick.
#[inline(always)]
pub(crate) fn open_blocks<S: Simd, R: PackedRule>(
    simd: S,
    job: &TileContext,
    window: Window,
    scratch: &FieldScratch,
) -> OpenBlocks {
    let mut open = [[0; BLOCKS]; BLOCKS];
    for row in window.rows[0]..window.rows[1] {
        let mut takes = R::open(simd, job, scratch, row);
        if let Some(spans) = job.spans {
            takes &= spans.open(simd, &job.settings.sheets, job.placed.planes, row);
        }
        let bits = takes.to_bitmask();
        let of_row = &mut open[row / BLOCK_PX];
        for (x, block) in of_row.iter_mut().enumerate() {
            let four = bits >> (x * BLOCK_PX) & ((1 << BLOCK_PX) - 1);
            *block |= four << (row % BLOCK_PX * BLOCK_PX);
        }
    }
    open
}

/// Where a block of a plane lies in the grid, relative to the anchor. Positions come out the same for every brick, so that
/// a sample on a face belongs to one.
#[inline(always)]
pub(crate) fn positions<S: Simd>(simd: S, plane: &PlaneView, [x, y]: [usize; 2]) -> [f32x16<S>; 3] {
    let mut positions = [f32x16::splat(simd, 0.0); 3];
    for (axis, position) in positions.iter_mut().enumerate() {
        let columns = &plane.lanes[axis][x * BLOCK_PX..(x + 1) * BLOCK_PX];
        let columns = f32x16::block_splat(f32x4::from_slice(simd, columns));
        *position = columns + f32x16::from_slice(simd, &plane.block_rows[axis][y]);
    }
    positions
}

/// How large the terms of a block's positions along an axis may be: that of the first pixel, and the steps along both sides.
#[inline(always)]
fn magnitude(plane: &PlaneView, axis: usize) -> f32 {
    let [left, right] = [0, TILE_PX - 1].map(|lane| plane.lanes[axis][lane].abs());
    plane.first[axis].abs() + TILE_PX as f32 * plane.step_y[axis].abs() + left.max(right)
}

/// The first plane and the last of a brick, as a tile sees them, and how many there are from one to the other.
pub(crate) struct Ends<'a> {
    pub(crate) planes: [&'a PlaneView; 2],
    pub(crate) count: u32,
}

/// By how much of its terms f32 may move a position far beyond the brick: each of the three terms is rounded, and their sums; on
/// the plane in question and on both ends.
const FAR_ERROR: f32 = 7.5 * f32::EPSILON;

/// The planes, counted from the first, on which samples of a block can lie in the box. With `FAR`, pixels or
/// planes may lie so many voxels apart that positions have lost digits.
#[inline(always)]
pub(crate) fn planes_inside<S: Simd, const FAR: bool>(
    simd: S,
    ends: &Ends<'_>,
    cells: &CellBox,
    at: [usize; 2],
    open: u64,
) -> Range<u32> {
    if ends.count <= 1 {
        return 0..ends.count;
    }
    let constant = |v: f32| f32x16::splat(simd, v);
    let last = (ends.count - 1) as f32;
    let (from, to) = (
        positions(simd, ends.planes[0], at),
        positions(simd, ends.planes[1], at),
    );
    let (mut near, mut far) = (constant(0.0), constant(last));
    for axis in 0..3 {
        let step = (to[axis] - from[axis]) * constant(1.0 / last);
        let tiny = step.abs().simd_lt(constant(LEAST_STEP));
        let inverse = constant(1.0) / tiny.select(constant(LEAST_STEP), step);
        let low = (constant(cells.low[axis]) - from[axis]) * inverse;
        let high = (constant(cells.high[axis]) - from[axis]) * inverse;
        let mut position_error = constant(POSITION_ERROR);
        if FAR {
            let [from, to] = ends.planes.map(|plane| magnitude(plane, axis));
            position_error += constant(FAR_ERROR * from.max(to));
        }
        let error = position_error * inverse.abs();
        near = near.max(low.min(high) - error);
        far = far.min(low.max(high) + error);
    }
    let crosses = near.simd_le(far) & mask32x16::from_bitmask(simd, open);
    if crosses.all_false() {
        return 0..0;
    }
    let first = least(crosses.select(near, constant(last)));
    let end = -least(crosses.select(-far, constant(0.0)));
    first as u32..end as u32 + 1
}

/// The least of all lanes.
#[inline(always)]
fn least<S: Simd>(lanes: f32x16<S>) -> f32 {
    let (a, b) = lanes.split();
    let (a, b) = a.min(b).split();
    let [a, b, c, d] = a.min(b).to_array();
    a.min(b).min(c.min(d))
}

/// Planes of a brick that are gone through without asking whether they are met. Bricks of cubic cells have 28 at most, cells
/// that are ten times as long 200; to ask costs about as much as ten planes.
const FEW_PLANES: u32 = 4 * REMEMBERED_PLANES as u32;

/// Returns true if a brick has so many planes that runs of them are looked for.
pub(crate) fn is_long(placed: &PlacedBrick) -> bool {
    let [first, end] = placed.planes;
    end.saturating_sub(first) > FEW_PLANES
}

/// Lists the runs of planes of a brick that rays of the window may meet, front to back.
#[simd]
pub(crate) fn find<S: Simd>(
    simd: S,
    job: &TileContext,
    window: Window,
    runs: &mut Vec<Range<u32>>,
) {
    runs.clear();
    let [first, end] = job.placed.planes;
    if !is_long(job.placed) {
        runs.push(first..end);
        return;
    }
    let cells = CellBox::new(job.placed.brick, &job.settings.sheets.anchor);
    let open = of_window(window);
    let mut waiting = Vec::new();
    waiting.push(first..end);
    while let Some(run) = waiting.pop() {
        if run.len() <= REMEMBERED_PLANES {
            runs.push(run);
            continue;
        }
        let Some(met) = met(simd, job, (&cells, &open), &run) else {
            continue;
        };
        if met.len() * 2 <= run.len() {
            waiting.push(met);
        } else {
            let middle = met.start + met.len() as u32 / 2;
            // The nearer half is taken first.
            waiting.push(middle..met.end);
            waiting.push(met.start..middle);
        }
    }
}

/// The part of a run between the first plane and the last that a ray of the window may meet; `None` if it meets no plane.
#[inline(always)]
fn met<S: Simd>(
    simd: S,
    job: &TileContext,
    (cells, open): (&CellBox, &OpenBlocks),
    run: &Range<u32>,
) -> Option<Range<u32>> {
    let planes = [job.view.plane(run.start), job.view.plane(run.end - 1)];
    let ends = Ends {
        planes: [&planes[0], &planes[1]],
        count: run.len() as u32,
    };
    let mut union: Option<Range<u32>> = None;
    for (y, row) in open.iter().enumerate() {
        for (x, &open) in row.iter().enumerate().filter(|(_, open)| **open != 0) {
            let inside = planes_inside::<S, true>(simd, &ends, cells, [x, y], open);
            if inside.is_empty() {
                continue;
            }
            union = Some(match union {
                Some(union) => union.start.min(inside.start)..union.end.max(inside.end),
                None => inside,
            });
        }
    }
    // Plane numbers beyond 2^23 are counted in f32 by ones.
    let slack = 2 + (ends.count >> 20);
    union.map(|met| {
        let start = run.start + met.start.saturating_sub(slack);
        start..(run.start + met.end + slack).min(run.end)
    })
}

/// The pixels of a window, a bit for each in its block.
fn of_window(window: Window) -> OpenBlocks {
    let mut open = [[0; BLOCKS]; BLOCKS];
    for row in window.rows[0]..window.rows[1].min(TILE_PX) {
        for column in window.columns[0]..window.columns[1].min(TILE_PX) {
            let bit = row % BLOCK_PX * BLOCK_PX + column % BLOCK_PX;
            open[row / BLOCK_PX][column / BLOCK_PX] |= 1u64 << bit;
        }
    }
    open
}
