//! Lists of samples and of ray segments that wait to be classified, side by side whatever rays they belong to.
//!
//! A part of a ray in a cell is one segment, or two halves of equal length: those share the corners of
//! the cell and the point where they meet.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16, u32x16};
use resample_core::tile::{TILE_AREA, TILE_PX};

use crate::bricks::cells::{CELL_SIDE, CELLS, LAST_CELL, VERTEX_SIDE};
use crate::slabs::view::{self, HalfRow};

/// Lanes of a vector of packed samples: a block of 4x4 pixels.
pub(crate) const LANES: usize = 16;

/// Samples that are classified together: few enough that all that is known of them stays in the first-level cache.
const BATCH: usize = 256;

/// Room for a batch and a vector beyond it.
const ROOM: usize = BATCH + LANES;

/// A number for each sample.
pub(crate) type Numbers = [f32; ROOM];

/// Samples in the order in which they were found.
#[derive(Clone, Debug)]
pub(crate) struct PackedSamples {
    count: usize,
    /// Number of the cell in the brick, x fastest, below [`PIXEL_SHIFT`], and the pixel's in the tile.
    pub(crate) place: [u32; ROOM],
    /// Position in the cell.
    pub(crate) share: [Numbers; 3],
    /// The field.
    pub(crate) scalar: Numbers,
    /// Camera z; only where depth is wanted.
    pub(crate) camera_z: Numbers,
    /// The part of the slab that is drawn; only where surfaces cut it.
    pub(crate) part: Numbers,
    pub(crate) shown: ShownSamples,
    pub(crate) between: BetweenSteps,
    pub(crate) sums: ChannelSums,
}

/// Sums over the channels at each sample, where there are several.
#[derive(Clone, Debug)]
pub(crate) struct ChannelSums {
    pub(crate) strength: Numbers,
    /// Colour times strength, lit.
    pub(crate) rgb: [[f32; 4]; ROOM],
    /// The factor of each colour that is added; highlights have none.
    pub(crate) tint: [[f32; 4]; ROOM],
}

/// Results of one step of a batch that the next one reads. They are kept from batch to batch: clearing the arrays took a twentieth of
/// a frame.
#[derive(Clone, Debug)]
pub(crate) struct BetweenSteps {
    /// The faces of the samples' cells, nearer and farther along z.
    pub(crate) faces: [[u32; ROOM]; 2],
    /// The scalars at the corners of the cells.
    pub(crate) corners: [Numbers; 8],
    /// The places in the tables of the first vertices of the cells of samples that show something.
    pub(crate) vertex: [u32; ROOM],
    /// The differences of bytes at both ends of the four edges along x of the cells of samples that show something.
    pub(crate) differences: [[[u32; 2]; ROOM]; 4],
    /// Places in the transfer function's table, extinctions there, and opacity units of a slab.
    pub(crate) entry: [i32; ROOM],
    pub(crate) strength: Numbers,
    pub(crate) units: Numbers,
    /// Gradients and rays of the samples that show something, in the world.
    pub(crate) gradient: [Numbers; 3],
    pub(crate) ray: [Numbers; 3],
}

/// Samples that show something.
#[derive(Clone, Debug)]
pub(crate) struct ShownSamples {
    pub(crate) count: usize,
    /// As in [`PackedSamples`].
    pub(crate) place: [u32; ROOM],
    pub(crate) share: [Numbers; 3],
    pub(crate) camera_z: Numbers,
    /// Number in the list of all.
    pub(crate) number: [u32; ROOM],
    /// Place in the transfer function's table.
    pub(crate) entry: [u32; ROOM],
    /// Opacity, or extinction as long as channels are added.
    pub(crate) opacity: Numbers,
    /// Factors of the colour by light.
    pub(crate) body: Numbers,
    pub(crate) highlight: Numbers,
}

/// Where the pixel begins in a sample's place.
pub(crate) const PIXEL_SHIFT: u32 = 16;

/// Bits of a sample's place that are its cell.
pub(crate) const CELL_MASK: u32 = CELLS as u32 - 1;

/// The place in the tables of the first vertex of a sample's cell.
#[inline(always)]
pub(crate) fn vertex(place: u32) -> usize {
    let cell = (place & CELL_MASK) as usize;
    (cell + (cell >> 3 & 7) + (2 * (VERTEX_SIDE - 1) + 1) * (cell >> 6)).min(LAST_CELL)
}

impl Default for PackedSamples {
    fn default() -> Self {
        let zero = [0.0; ROOM];
        Self {
            count: 0,
            place: [0; ROOM],
            share: [zero; 3],
            scalar: zero,
            camera_z: zero,
            part: zero,
            shown: ShownSamples {
                count: 0,
                place: [0; ROOM],
                share: [zero; 3],
                camera_z: zero,
                number: [0; ROOM],
                entry: [0; ROOM],
                opacity: zero,
                body: zero,
                highlight: zero,
            },
            between: BetweenSteps {
                faces: [[0; ROOM]; 2],
                corners: [zero; 8],
                vertex: [0; ROOM],
                differences: [[[0; 2]; ROOM]; 4],
                entry: [0; ROOM],
                strength: zero,
                units: zero,
                gradient: [zero; 3],
                ray: [zero; 3],
            },
            sums: ChannelSums {
                strength: zero,
                rgb: [[0.0; 4]; ROOM],
                tint: [[0.0; 4]; ROOM],
            },
        }
    }
}

impl PackedSamples {
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.count.min(BATCH)
    }

    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes so many in, of which there are at most a vector.
    #[inline(always)]
    pub(crate) fn grow(&mut self, count: usize) {
        self.count += count;
    }

    /// Returns true if another vector of samples might not fit.
    #[inline(always)]
    pub(crate) fn is_full(&self) -> bool {
        self.count + LANES > BATCH
    }
}

/// Rays that are walked together: those of half a row, and of the half row below it.
pub(crate) const PAIR_LANES: usize = 2 * view::LANES;

/// The numbers of lanes.
pub(crate) const LANE_NUMBERS: [u32; PAIR_LANES] =
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// The pixels of two half rows, from the first in the tile.
const PAIR_NUMBERS: [u32; PAIR_LANES] = {
    let mut numbers = [0; PAIR_LANES];
    let mut lane = 0;
    while lane < PAIR_LANES {
        numbers[lane] = (lane / view::LANES * TILE_PX + lane % view::LANES) as u32;
        lane += 1;
    }
    numbers
};

/// Most segments of a part.
const MOST_HALVES: usize = 2;

/// Parts of rays in the order in which they were found.
#[derive(Clone, Debug)]
pub(crate) struct SegmentList {
    pub(crate) count: usize,
    /// Segments of each part, 1 or [`MOST_HALVES`].
    pub(crate) halves: u32,
    /// Number of the cell in the brick, x fastest, below [`PIXEL_SHIFT`], and the pixel's in the tile.
    place: [u32; ROOM],
    /// Camera z of the ends, relative to the anchor's.
    z: [Numbers; 2],
    /// Positions of the ends in the cell.
    share: [[Numbers; 3]; 2],
    /// The segments that meet scalars which are shown: their numbers, and the places of their ends in the transfer
    /// function.
    pub(crate) met: [u32; MOST_HALVES * ROOM],
    pub(crate) scalar: [[f32; MOST_HALVES * ROOM]; 2],
}

/// One segment of a list: a part, and where on it the segment begins and ends, from 0 to 1.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Segment {
    pub(crate) part: usize,
    span: [f32; 2],
}

/// Parts of the rays of two half rows, each in one cell.
pub(crate) struct Found<S: Simd> {
    pub(crate) inside: mask32x16<S>,
    /// Cells by their numbers in the brick.
    pub(crate) cell: u32x16<S>,
    /// The upper half row.
    pub(crate) at: HalfRow,
    pub(crate) z: [f32x16<S>; 2],
    pub(crate) share: [[f32x16<S>; 3]; 2],
}

impl Default for SegmentList {
    fn default() -> Self {
        let zero = [0.0; ROOM];
        Self {
            count: 0,
            halves: 1,
            place: [0; ROOM],
            z: [zero; 2],
            share: [[zero; 3]; 2],
            met: [0; MOST_HALVES * ROOM],
            scalar: [[0.0; MOST_HALVES * ROOM]; 2],
        }
    }
}

impl SegmentList {
    /// Appends ray segments.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(&mut self, simd: S, found: &Found<S>) {
        let first = (found.at.row * TILE_PX + found.at.first) as u32;
        let pixel = u32x16::from_slice(simd, &PAIR_NUMBERS) + u32x16::splat(simd, first);
        let place = found.cell | pixel << PIXEL_SHIFT;
        let at = self.count..self.count + PAIR_LANES;
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

    /// Returns true if another vector of parts might not fit.
    #[inline(always)]
    pub(crate) fn is_full(&self) -> bool {
        self.count + PAIR_LANES > BATCH
    }

    #[inline(always)]
    pub(crate) fn cell(&self, number: usize) -> usize {
        (self.place[number] & ((1 << PIXEL_SHIFT) - 1)) as usize
    }

    #[inline(always)]
    pub(crate) fn pixel(&self, number: usize) -> usize {
        (self.place[number] >> PIXEL_SHIFT) as usize % TILE_AREA
    }

    /// The segment of this number, counted from the first part's.
    #[inline(always)]
    pub(crate) fn segment(&self, number: u32) -> Segment {
        let part = (number / self.halves) as usize;
        let (half, length) = ((number % self.halves) as f32, 1.0 / self.halves as f32);
        Segment {
            part: part.min(ROOM - 1),
            span: [half * length, (half + 1.0) * length],
        }
    }

    /// Camera z of an end of a segment, relative to the anchor's.
    #[inline(always)]
    pub(crate) fn z(&self, segment: Segment, end: usize) -> f32 {
        let [near, far] = [self.z[0][segment.part], self.z[1][segment.part]];
        (far - near).mul_add(segment.span[end], near)
    }

    /// The position of an end of a segment in its cell, along an axis.
    #[inline(always)]
    pub(crate) fn share(&self, segment: Segment, end: usize, axis: usize) -> f32 {
        let [near, far] = [0, 1].map(|end| self.share[end][axis][segment.part]);
        (far - near).mul_add(segment.span[end], near)
    }

    /// The place of the first vertex of a part's cell in the brick's tables.
    #[inline(always)]
    pub(crate) fn vertex(&self, number: usize) -> i32 {
        let cell = self.cell(number);
        let (x, y) = (cell % CELL_SIDE, cell / CELL_SIDE % CELL_SIDE);
        (x + VERTEX_SIDE * (y + VERTEX_SIDE * (cell / (CELL_SIDE * CELL_SIDE)))) as i32
    }

    #[inline(always)]
    pub(crate) fn shares<S: Simd>(&self, simd: S, end: usize, first: usize) -> [f32x16<S>; 3] {
        let at = first..first + PAIR_LANES;
        let load = |axis: usize| f32x16::from_slice(simd, &self.share[end][axis][at.clone()]);
        [load(0), load(1), load(2)]
    }
}
