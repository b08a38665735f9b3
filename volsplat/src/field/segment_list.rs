//! Segments of rays that wait to be classified, side by side whatever rays they belong to.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8, u32x8};
use resample_core::tile::{TILE_AREA, TILE_PX};

use crate::bricks::cells::{CELL_SIDE, VERTEX_SIDE};
use crate::sheets::view::{HalfRow, LANES};

/// Segments that are classified together: few enough that all that is known of them stays in the first-level cache.
const BATCH: usize = 256;

/// Room for a batch and a vector beyond it.
pub(super) const ROOM: usize = BATCH + LANES;

/// Where the pixel begins in a segment's place.
const PIXEL_SHIFT: u32 = 16;

/// The numbers of lanes.
pub(super) const LANE_NUMBERS: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7];

/// A number for each segment.
type Numbers = [f32; ROOM];

/// Segments in the order in which they were found.
#[derive(Clone, Debug)]
pub(crate) struct SegmentList {
    pub(super) count: usize,
    /// Number of the cell in the brick, x fastest, below [`PIXEL_SHIFT`], and the pixel's in the tile.
    place: [u32; ROOM],
    /// Camera z of the ends, relative to the anchor's.
    pub(super) z: [Numbers; 2],
    /// Positions of the ends in the cell.
    pub(super) share: [[Numbers; 3]; 2],
    /// Those that meet scalars which are shown: their numbers, and the places of their ends in the transfer function.
    pub(super) met: [u32; ROOM],
    pub(super) scalar: [Numbers; 2],
}

/// Segments of half a row of rays, each in one cell.
pub(super) struct Found<S: Simd> {
    pub(super) inside: mask32x8<S>,
    /// Cells by their numbers in the brick.
    pub(super) cell: u32x8<S>,
    pub(super) at: HalfRow,
    pub(super) z: [f32x8<S>; 2],
    pub(super) share: [[f32x8<S>; 3]; 2],
}

impl Default for SegmentList {
    fn default() -> Self {
        let zero = [0.0; ROOM];
        Self {
            count: 0,
            place: [0; ROOM],
            z: [zero; 2],
            share: [[zero; 3]; 2],
            met: [0; ROOM],
            scalar: [zero; 2],
        }
    }
}

impl SegmentList {
    /// Takes segments in.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&mut self, simd: S, found: &Found<S>) {
        let first = (found.at.row * TILE_PX + found.at.first) as u32;
        let pixel = u32x8::from_slice(simd, &LANE_NUMBERS) + u32x8::splat(simd, first);
        let place = found.cell | pixel << PIXEL_SHIFT;
        let at = self.count..self.count + LANES;
        place
            .compress(found.inside)
            .store_slice(&mut self.place[at.clone()]);
        for end in 0..2 {
            found.z[end]
                .compress(found.inside)
                .store_slice(&mut self.z[end][at.clone()]);
            for axis in 0..3 {
                found.share[end][axis]
                    .compress(found.inside)
                    .store_slice(&mut self.share[end][axis][at.clone()]);
            }
        }
        self.count += found.inside.to_bitmask().count_ones() as usize;
    }

    /// Whether another vector of segments might not fit.
    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.count + LANES > BATCH
    }

    #[inline(always)]
    pub(super) fn cell(&self, number: usize) -> usize {
        (self.place[number] & ((1 << PIXEL_SHIFT) - 1)) as usize
    }

    #[inline(always)]
    pub(super) fn pixel(&self, number: usize) -> usize {
        (self.place[number] >> PIXEL_SHIFT) as usize % TILE_AREA
    }

    /// The place of the first vertex of a segment's cell in the brick's tables.
    #[inline(always)]
    pub(super) fn vertex(&self, number: usize) -> i32 {
        let cell = self.cell(number);
        let (x, y) = (cell % CELL_SIDE, cell / CELL_SIDE % CELL_SIDE);
        (x + VERTEX_SIDE * (y + VERTEX_SIDE * (cell / (CELL_SIDE * CELL_SIDE)))) as i32
    }

    #[inline(always)]
    pub(super) fn shares<S: Simd>(&self, simd: S, end: usize, first: usize) -> [f32x8<S>; 3] {
        let load =
            |axis: usize| f32x8::from_slice(simd, &self.share[end][axis][first..first + LANES]);
        [load(0), load(1), load(2)]
    }
}
