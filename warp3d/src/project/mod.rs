//! Surfaces laid on the screen: which piece of a reference each place of a lattice of screen positions sees.
//!
//! Cells are scan-converted band by band; their samples are warped as a band comes to them. Joined cells share their
//! corners, so there are no cracks; cut cells give each corner its quarter on its own tangent plane. Turned-away pieces are
//! dropped.
//!
//! Limits: a piece with a corner before the near plane is dropped whole; it is smaller than a sample's spacing.

mod warped;
mod extent;
mod cells;
mod quarters;
// What is kept of a reference between frames, segments of this folder among it.
pub(crate) mod prepared;

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8};
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::simd::Vectors;

pub(crate) use crate::project::cells::{
    EightCells, EightQuads, EightTriangles, HALVES, QuadBlock, SLACK, scan_triangle,
};
use crate::project::warped::{Bounds, WarpedRows};
pub(crate) use crate::project::warped::{LANES, SEGMENT, Terms, Vertex, narrow};
use crate::view::layer::RowRange;
use extent::{all_in_front, count_in_front, extents, range_of};
pub(crate) use quarters::Quarters;

use crate::surfaces::surface::{Cell, Surfaces};

/// Where a reference lies on one screen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Projected {
    /// Corners of the quarters of cut cells.
    quarters: Vec<QuadBlock>,
    /// Screen columns and rows that each segment of each row of cells touches at most.
    segments: Vec<[RowRange; 2]>,
    /// Screen rows that each row of cells touches.
    rows: Vec<RowRange>,
}

/// A receiver of a band's pieces.
pub(crate) trait Sink {
    /// Eight cells of a row.
    fn eight<S: Simd>(&mut self, simd: S, cells: &EightCells<S>);
    /// Eight quarters at cuts, which lie on the rims of their surfaces, and the numbers of their pieces.
    fn quads<S: Simd>(&mut self, simd: S, quads: &EightQuads<S>, id: impl Fn(usize) -> u32);
    /// Returns true if anything within these columns and rows (px) can matter.
    fn wants(&self, columns: RowRange, rows: RowRange) -> bool;
}

/// How the cells of a reference are joined, in the form in which they are drawn: by segment, one bit a cell.
#[derive(Clone, Debug)]
pub(crate) struct Segments {
    /// Joined cells.
    joined: Vec<u32>,
    /// Those joined along the main diagonal.
    main: Vec<u32>,
    /// Least and greatest disparity of the corners of joined cells.
    ranges: Vec<[f32; 2]>,
    /// The quarters of cut cells.
    quarters: Quarters,
}

/// The surfaces that bands are drawn from.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    /// The surfaces.
    pub(crate) surfaces: &'a Surfaces,
    /// Their cells.
    pub(crate) segments: &'a Segments,
    /// Where they lie on the screen.
    pub(crate) terms: &'a Terms,
}

impl Segments {
    /// The cells of `surfaces`, with the `quarters` of the cut ones.
    pub(crate) fn new(surfaces: &Surfaces, quarters: Quarters) -> Self {
        let [width, height] = surfaces.size;
        let per_row = (width + 1).div_ceil(SEGMENT);
        let bits = |which: fn(Cell) -> bool| -> Vec<u32> {
            let of_segment = |segment: usize| {
                let (cy, first) = (segment / per_row, segment % per_row * SEGMENT);
                let cells = &surfaces.cells[cy * (width + 1)..(cy + 1) * (width + 1)];
                let set = cells[first..(first + SEGMENT).min(width + 1)]
                    .iter()
                    .enumerate();
                set.filter(|&(_, &cell)| which(cell))
                    .fold(0, |bits, (i, _)| bits | 1 << i)
            };
            (0..per_row * (height + 1))
                .into_par_iter()
                .map(of_segment)
                .collect()
        };
        let range = |segment: usize| {
            let (cy, first) = (segment / per_row, segment % per_row * SEGMENT);
            range_of(surfaces, cy, [first, (first + SEGMENT).min(width + 1)])
        };
        Self {
            ranges: (0..per_row * (height + 1))
                .into_par_iter()
                .map(range)
                .collect(),
            joined: bits(|cell| matches!(cell, Cell::MainDiagonal | Cell::AntiDiagonal)),
            main: bits(|cell| cell == Cell::MainDiagonal),
            quarters,
        }
    }
}

impl Projected {
    /// Finds where the segments and the quarters lie.
    pub(crate) fn project(&mut self, scene: &Scene<'_>, level: Vectors) {
        let Scene {
            surfaces,
            segments,
            terms,
        } = *scene;
        let [width, height] = surfaces.size;
        let per_row = (width + 1).div_ceil(SEGMENT);
        segments
            .quarters
            .project(surfaces, terms, level, &mut self.quarters);
        self.segments
            .resize(per_row * (height + 1), [RowRange::EMPTY; 2]);
        self.rows.resize(height + 1, RowRange::EMPTY);
        let quarters = &self.quarters;
        let rows = self.segments.par_chunks_mut(per_row).zip(&mut self.rows);
        rows.enumerate().for_each(|(cy, (extent, row))| {
            let ranges = &segments.ranges[cy * per_row..(cy + 1) * per_row];
            dispatch!(level, simd => extents(simd, terms, surfaces, ranges, cy, extent));
            for (block, extent) in extent.iter_mut().enumerate() {
                let own = segments.quarters.of_segment(cy * per_row + block);
                if !own.is_empty() {
                    let [x, y] = dispatch!(level, simd => quad_bounds(simd, quarters, own));
                    extent[0].join(x);
                    extent[1].join(y);
                }
            }
            *row = RowRange::EMPTY;
            extent.iter().for_each(|[_, along]| row.join(*along));
        });
    }

    /// Gives the pieces that touch the screen rows `rows` to `sink`, in the order of the reference.
    #[inline(always)]
    pub(crate) fn visit<S: Simd>(
        &self,
        simd: S,
        scene: &Scene<'_>,
        rows: [usize; 2],
        sink: &mut impl Sink,
    ) {
        let width = scene.surfaces.size[0];
        let per_row = (width + 1).div_ceil(SEGMENT);
        let mut warped = WarpedRows::new(width);
        let touching = (0..self.rows.len()).filter(|&cy| self.rows[cy].touches(rows[0], rows[1]));
        for segment in touching.flat_map(|cy| cy * per_row..(cy + 1) * per_row) {
            let [columns, along] = self.segments[segment];
            if along.touches(rows[0], rows[1]) && sink.wants(columns, along) {
                self.visit_segment(simd, scene, segment, &mut warped, sink);
            }
        }
    }

    #[inline(always)]
    fn visit_segment<S: Simd>(
        &self,
        simd: S,
        scene: &Scene<'_>,
        segment: usize,
        warped: &mut WarpedRows,
        sink: &mut impl Sink,
    ) {
        let width = scene.surfaces.size[0];
        let per_row = (width + 1).div_ceil(SEGMENT);
        let (cy, block) = (segment / per_row, segment % per_row);
        let (joined, main) = (scene.segments.joined[segment], scene.segments.main[segment]);
        if joined != 0 {
            let rows = warped.around(simd, scene.terms, scene.surfaces, [cy, block]);
            for shift in (0..SEGMENT).step_by(LANES) {
                if joined >> shift & 0xff == 0 {
                    continue;
                }
                let cell = cy * (width + 1) + block * SEGMENT + shift;
                let bits = [joined >> shift, main >> shift];
                sink.eight(simd, &EightCells::load(simd, &rows, shift, cell, bits));
            }
        }
        for (block, some) in blocks_of(scene.segments.quarters.of_segment(segment)) {
            let quads = EightQuads::load(simd, &self.quarters[block], some);
            sink.quads(simd, &quads, |lane| {
                scene.segments.quarters.id(block * LANES + lane)
            });
        }
    }
}

/// Number of the `known` samples of a reference that are in front of the near plane.
pub(crate) fn in_front(surfaces: &Surfaces, terms: &Terms, known: u64, level: Vectors) -> u64 {
    if dispatch!(level, simd => all_in_front(simd, terms, surfaces)) {
        return known;
    }
    let count = |y| dispatch!(level, simd => count_in_front(simd, terms, surfaces, y));
    (0..surfaces.size[1]).into_par_iter().map(count).sum()
}

/// The blocks of eight that a range of quarters lies in, and which of the eight belong to it, one bit each.
fn blocks_of(range: Range<usize>) -> impl Iterator<Item = (usize, u64)> {
    let blocks = if range.is_empty() {
        0..0
    } else {
        range.start / LANES..range.end.div_ceil(LANES)
    };
    blocks.map(move |block| {
        let first = block * LANES;
        let from = range.start.saturating_sub(first);
        let end = (range.end - first).min(LANES);
        (block, (1 << end) - (1 << from))
    })
}

/// Screen columns and rows that some quarters touch.
#[simd]
fn quad_bounds<S: Simd>(simd: S, quarters: &[QuadBlock], range: Range<usize>) -> [RowRange; 2] {
    let mut bounds = Bounds::new(simd);
    for (block, some) in blocks_of(range) {
        let some = mask32x8::from_bitmask(simd, some);
        for [x, y, _] in &quarters[block] {
            let [x, y] = [x, y].map(|v| f32x8::from_slice(simd, v));
            bounds.include([x, y], some & x.simd_eq(x));
        }
    }
    bounds.ranges()
}
