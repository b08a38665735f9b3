//! Runs of planes of a brick that some ray of a tile meets.
//!
//! Planes are as far apart as the finest axis asks for. Where another axis of the brick is a thousand times as long, a tile
//! sees most of its planes beside the brick: the rays of one pixel meet a few among millions. A range of many planes is cut with
//! the rays of the tile at once; where they meet nothing it is left out, else each of its halves is asked in turn. The cost follows
//! the planes that are met. What is left out has no samples: pictures are the same.

use std::ops::Range;

use fearless_simd::Simd;
use fearless_simd_macros::simd;
use resample_core::tile::TILE_PX;

use super::blocks::{BLOCKS, Ends, OpenBlocks, planes_inside};
use crate::field::settings::{PlacedBrick, TileContext};
use crate::field::walk::cell_sample::CellBox;
use crate::field::walk::gather::{REMEMBERED_PLANES, Window};
use crate::slabs::view::BLOCK_PX;

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
