//! The planes of a brick over a tile: which of their samples lie in cells that may show something.
//!
//! A block of 4x4 pixels is one vector: a brick covers a few pixels along both axes, so that fewer lanes miss it than in
//! rows of pixels. A brick's 512 cells are as many bits, in one vector of 64 bytes, and a sample's bit is found in it by
//! permutation.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16, mask32x16, u8x64, u32x16};
use fearless_simd_macros::simd;
use resample_core::composite::DepthRule;
use resample_core::narrow::single;
use resample_core::tile::TILE_PX;

use super::planes::{Ends, open_blocks, planes_inside, positions};
use super::{PackedRule, planes};
use crate::bricks::cells::CELL_SIDE;
use crate::field::settings::TileContext;
use crate::field::walk::cell_sample::CellBox;
use crate::field::walk::corners::{shown, unmasked};
use crate::field::walk::lists::{LANES, PIXEL_SHIFT, PackedSamples};
use crate::field::walk::scratch::{FieldScratch, REMEMBERED_PLANES, Window};
use crate::slabs::view::{BLOCK_PX, PlaneView};

/// Planes that are gone through together: a tile remembers as many.
const PLANES: u32 = REMEMBERED_PLANES as u32;

const _: () = assert!(LANES == BLOCK_PX * BLOCK_PX);

/// The target of a scan.
struct Scan<'a, S: Simd> {
    job: &'a TileContext<'a>,
    cells: CellBox,
    /// The brick's first cell, relative to the anchor.
    first_cell: [i32; 3],
    /// A bit for each cell.
    bits: u8x64<S>,
    /// The pixels of the first block, at the place of the pixel.
    lanes: u32x16<S>,
}

/// The cells that samples of a block of a plane lie in.
struct Located<S: Simd> {
    /// Their numbers in the brick, of those inside it.
    cell: u32x16<S>,
    /// Position in the cell.
    share: [f32x16<S>; 3],
    /// Lanes in cells of the brick that may show something.
    shown: mask32x16<S>,
}

/// Takes all samples of a brick in. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
pub(crate) fn add_brick<S: Simd, R: PackedRule>(
    simd: S,
    job: &TileContext,
    window: Window,
    scratch: &mut FieldScratch,
) -> (usize, bool) {
    let contributed = scratch.work.contributed;
    let touched = add_planes::<S, R>(simd, job, window, scratch);
    let seen = R::HIDES && scratch.work.contributed > contributed;
    let least = job.settings.sheets.min_transmittance;
    (touched, seen && scratch.pixels.is_opaque(simd, least))
}

/// Finds the samples of all planes, and composites them. Returns the lanes looked at.
#[inline(always)]
fn add_planes<S: Simd, R: PackedRule>(
    simd: S,
    job: &TileContext,
    window: Window,
    scratch: &mut FieldScratch,
) -> usize {
    let (settings, placed) = (job.settings, job.placed);
    let mut numbers = [0; LANES];
    for (lane, number) in numbers.iter_mut().enumerate() {
        *number = (lane / BLOCK_PX * TILE_PX + lane % BLOCK_PX) as u32;
    }
    let cells = CellBox::new(placed.brick, &settings.sheets.anchor);
    let scan = Scan {
        job,
        cells,
        first_cell: cells.corner.map(|corner| corner as i32),
        bits: u8x64::from_slice(simd, placed.brick.shown.rows()),
        lanes: u32x16::from_slice(simd, &numbers),
    };
    let open = open_blocks::<S, R>(simd, job, window, scratch);
    // Out of the scratch storage as long as the rest of it changes.
    let mut planes = std::mem::take(&mut scratch.planes);
    let met = std::mem::take(&mut scratch.runs);
    let is_long = planes::is_long(placed);
    let mut touched = 0;
    let batches = met.iter().flat_map(|run| {
        run.clone()
            .step_by(REMEMBERED_PLANES)
            .map(|first| (first, run.end))
    });
    for (first, end) in batches {
        let count = PLANES.min(end - first);
        planes.make(job.view, first..first + count);
        let ends = Ends {
            planes: [planes.made(first), planes.made(first + count - 1)],
            count,
        };
        let [left, right] = window.columns;
        for (y, row) in open.iter().enumerate() {
            for (x, &open) in row.iter().enumerate() {
                let is_covered = x * BLOCK_PX < right && (x + 1) * BLOCK_PX > left;
                if open == 0 || !is_covered {
                    continue;
                }
                let at = [x, y];
                let inside = match is_long {
                    true => planes_inside::<S, true>(simd, &ends, &scan.cells, at, open),
                    false => planes_inside::<S, false>(simd, &ends, &scan.cells, at, open),
                };
                for number in inside {
                    touched += LANES;
                    let plane = planes.made(first + number);
                    scan.add_block::<R>(simd, plane, (at, open), scratch);
                    if scratch.samples.is_full() {
                        flush::<S, R>(simd, job, scratch);
                    }
                }
            }
        }
    }
    flush::<S, R>(simd, job, scratch);
    scratch.planes = planes;
    scratch.runs = met;
    touched
}

/// Takes in the samples that wait.
#[inline(always)]
fn flush<S: Simd, R: PackedRule>(simd: S, job: &TileContext, scratch: &mut FieldScratch) {
    let count = scratch.samples.len();
    if count > 0 {
        scratch.work.computed += count.next_multiple_of(LANES);
        scratch.work.shown += count;
        R::take(simd, job, scratch);
        scratch.samples.clear();
    }
}

impl<S: Simd> Scan<'_, S> {
    #[inline(always)]
    fn add_block<R: PackedRule>(
        &self,
        simd: S,
        plane: &PlaneView,
        ([x, y], open): ([usize; 2], u64),
        scratch: &mut FieldScratch,
    ) {
        let position = positions(simd, plane, [x, y]);
        let Located { cell, share, shown } = self.located(simd, &position);
        let mut inside = shown & mask32x16::from_bitmask(simd, open);
        if inside.all_false() {
            return;
        }
        if self.job.placed.cuts != 0 {
            inside &= self.clipped(simd, &position);
        }
        if self.job.placed.brick.mask.is_some() {
            inside &= unmasked(simd, self.job, cell, share);
        }
        if let Some(spans) = self.job.spans {
            let thickness = single(self.job.settings.sheets.thickness);
            let part = spans.part_of_slab(simd, thickness, plane, [x, y]);
            // A statistic takes samples whole: those whose plane lies in the span.
            let least = f32x16::splat(simd, if R::HIDES { 0.0 } else { 0.5 });
            inside &= part.simd_gt(least);
            let first = scratch.samples.len();
            part.compress(inside)
                .store_slice(&mut scratch.samples.part[first..first + LANES]);
        }
        let first = (y * BLOCK_PX * TILE_PX + x * BLOCK_PX) as u32;
        let pixel = self.lanes + u32x16::splat(simd, first);
        append(
            &mut scratch.samples,
            inside,
            cell | pixel << PIXEL_SHIFT,
            share,
        );
        if self.job.settings.sheets.depth == DepthRule::Expected || !R::HIDES {
            let z = f32x16::splat(simd, plane.camera_z);
            let first = scratch.samples.len();
            z.store_slice(&mut scratch.samples.camera_z[first..first + LANES]);
        }
        let count = inside.to_bitmask().count_ones() as usize;
        scratch.samples.grow(count);
    }

    /// Positions in the cells of the brick. A cell begins at a whole number, and rounding down is exact: a sample on a face
    /// is in one of the two cells, whatever brick asks.
    #[inline(always)]
    fn located(&self, simd: S, position: &[f32x16<S>; 3]) -> Located<S> {
        let constant = |v: u32| u32x16::splat(simd, v);
        let mut share = *position;
        let (mut cell, mut all_axes) = (constant(0), constant(0));
        for axis in [2, 1, 0] {
            let below = position[axis].floor();
            share[axis] = position[axis] - below;
            let in_brick = below.to_int::<i32x16<S>>() - i32x16::splat(simd, self.first_cell[axis]);
            let in_brick: u32x16<S> = in_brick.bitcast();
            all_axes |= in_brick;
            cell = cell << 3 | in_brick;
        }
        // Beyond the brick a place is negative or has more than three bits, and the cell's number says nothing.
        let is_inside = (all_axes & constant(!(CELL_SIDE as u32 - 1))).simd_eq(constant(0));
        Located {
            cell,
            share,
            shown: is_inside & shown(simd, self.bits, cell),
        }
    }

    /// The positions that the clip keeps.
    #[inline(always)]
    fn clipped(&self, simd: S, position: &[f32x16<S>; 3]) -> mask32x16<S> {
        let constant = |v: f32| f32x16::splat(simd, v);
        let mut kept = constant(0.0).simd_eq(constant(0.0));
        for (number, half) in self.job.settings.clip.iter().enumerate() {
            if self.job.placed.cuts >> number & 1 == 1 {
                let height = position[0].mul_add(
                    constant(half.normal[0]),
                    position[1].mul_add(
                        constant(half.normal[1]),
                        position[2].mul_add(constant(half.normal[2]), constant(half.offset)),
                    ),
                );
                kept &= height.simd_ge(constant(0.0));
            }
        }
        kept
    }
}

/// Writes the samples of a vector behind the others.
#[inline(always)]
fn append<S: Simd>(
    samples: &mut PackedSamples,
    inside: mask32x16<S>,
    place: u32x16<S>,
    share: [f32x16<S>; 3],
) {
    let first = samples.len();
    let end = first + LANES;
    place
        .compress(inside)
        .store_slice(&mut samples.place[first..end]);
    for (numbers, share) in samples.share.iter_mut().zip(share) {
        share.compress(inside).store_slice(&mut numbers[first..end]);
    }
}
