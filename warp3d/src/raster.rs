//! Surfaces laid on the screen: which piece of a reference each place of a lattice of screen positions sees.
//!
//! Samples are warped once; their cells are scan-converted band by band. Joined cells share their corners, so there are
//! no cracks; cut cells give each corner its quarter on its own tangent plane. Turned-away pieces are dropped.
//!
//! Limits: a piece with a corner before the near plane is dropped whole; it is smaller than a sample's spacing.

mod cells;
mod project;
mod quarters;
mod scan;
mod vertex;

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8};
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::simd::Vectors;

pub(crate) use cells::{EightCells, EightQuads, EightTriangles, HALVES, QuadBlock};
use project::{Bounds, ProjectedRow, project_row};
pub(crate) use project::{Terms, narrow};
#[cfg(feature = "input")]
pub(crate) use quarters::Quarter;
pub(crate) use quarters::Quarters;
pub(crate) use scan::{SLACK, scan_triangle};
use vertex::Planes;
pub(crate) use vertex::{LANES, SEGMENT, Vertex};

use crate::bands::RowRange;
use crate::surface::{Cell, Surfaces};
use crate::warp::Warp;

/// Samples warped to one screen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Projected {
    planes: Planes,
    /// Corners of the quarters of cut cells.
    quarters: Vec<QuadBlock>,
    /// Screen columns and rows of each block of each row of samples.
    blocks: Vec<[RowRange; 2]>,
    /// Screen columns and rows that each segment of each row of cells touches.
    segments: Vec<[RowRange; 2]>,
    /// Screen rows that each row of cells touches.
    rows: Vec<RowRange>,
}

/// What receives the pieces of a band.
pub(crate) trait Sink {
    /// Eight cells of a row.
    fn eight<S: Simd>(&mut self, simd: S, cells: &EightCells<S>);
    /// Eight quarters at cuts, which lie on the rims of their surfaces, and the numbers of their pieces.
    fn quads<S: Simd>(&mut self, simd: S, quads: &EightQuads<S>, id: impl Fn(usize) -> u32);
    /// Whether anything within these columns and rows (px) can matter.
    fn wants(&self, columns: RowRange, rows: RowRange) -> bool;
}

/// How the cells of a reference are joined, in the form in which they are drawn: by segment, one bit a cell.
#[derive(Clone, Debug)]
pub(crate) struct Segments {
    /// Joined cells.
    joined: Vec<u32>,
    /// Those joined along the main diagonal.
    main: Vec<u32>,
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
        Self {
            joined: bits(|cell| matches!(cell, Cell::MainDiagonal | Cell::AntiDiagonal)),
            main: bits(|cell| cell == Cell::MainDiagonal),
            quarters,
        }
    }
}

impl Projected {
    /// Warps every sample.
    pub(crate) fn project(&mut self, scene: &Scene<'_>, warp: &Warp, level: Vectors) {
        let [width, height] = scene.surfaces.size;
        let per_row = (width + 1).div_ceil(SEGMENT);
        for plane in &mut self.planes.0 {
            plane.resize(width * height + LANES + 1, f32::NAN);
            // Entries beyond the samples are unknown; a reference of another size may have left numbers there.
            plane[width * height + 1..].fill(f32::NAN);
        }
        self.blocks.resize(per_row * height, [RowRange::EMPTY; 2]);
        let [xs, ys, nearness] = &mut self.planes.0;
        let rows = xs[1..]
            .par_chunks_mut(width)
            .zip(ys[1..].par_chunks_mut(width));
        rows.zip(nearness[1..].par_chunks_mut(width))
            .zip(self.blocks.par_chunks_mut(per_row))
            .enumerate()
            .for_each(|(y, ((row, near), blocks))| {
                let disparity = &scene.surfaces.disparity[y * width..(y + 1) * width];
                let to = ProjectedRow {
                    planes: [row.0, row.1, near],
                    blocks,
                };
                dispatch!(level, simd => project_row(simd, warp, y, disparity, to));
            });
        scene
            .segments
            .quarters
            .project(scene.surfaces, warp, level, &mut self.quarters);
        self.segments
            .resize(per_row * (height + 1), [RowRange::EMPTY; 2]);
        let (planes, blocks, quarters) = (&self.planes.0, &self.blocks, &self.quarters);
        self.segments
            .par_iter_mut()
            .with_min_len(256)
            .enumerate()
            .for_each(|(segment, range)| {
                *range = [RowRange::EMPTY; 2];
                let (cy, block) = (segment / per_row, segment % per_row);
                if scene.segments.joined[segment] != 0 {
                    for y in [cy - 1, cy] {
                        range[0].join(blocks[y * per_row + block][0]);
                        range[1].join(blocks[y * per_row + block][1]);
                        if block > 0 {
                            let before = y * width + block * SEGMENT;
                            range[0].include(planes[0][before]);
                            range[1].include(planes[1][before]);
                        }
                    }
                }
                let own = scene.segments.quarters.of_segment(segment);
                if !own.is_empty() {
                    let [x, y] = dispatch!(level, simd => quad_bounds(simd, quarters, own));
                    range[0].join(x);
                    range[1].join(y);
                }
            });
        let joined = |segments: &[[RowRange; 2]]| {
            segments
                .iter()
                .fold(RowRange::EMPTY, |mut row, [_, along]| {
                    row.join(*along);
                    row
                })
        };
        self.rows.clear();
        self.rows.extend(self.segments.chunks(per_row).map(joined));
    }

    /// Number of warped samples that are in front of the near plane.
    pub(crate) fn in_front(&self) -> u64 {
        self.planes.0[0].iter().filter(|x| !x.is_nan()).count() as u64
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
        let per_row = (scene.surfaces.size[0] + 1).div_ceil(SEGMENT);
        let touching = (0..self.rows.len()).filter(|&cy| self.rows[cy].touches(rows[0], rows[1]));
        for segment in touching.flat_map(|cy| cy * per_row..(cy + 1) * per_row) {
            let [columns, along] = self.segments[segment];
            if along.touches(rows[0], rows[1]) && sink.wants(columns, along) {
                self.visit_segment(simd, scene, segment, sink);
            }
        }
    }

    #[inline(always)]
    fn visit_segment<S: Simd>(
        &self,
        simd: S,
        scene: &Scene<'_>,
        segment: usize,
        sink: &mut impl Sink,
    ) {
        let width = scene.surfaces.size[0];
        let per_row = (width + 1).div_ceil(SEGMENT);
        let (cy, first) = (segment / per_row, segment % per_row * SEGMENT);
        let (joined, main) = (scene.segments.joined[segment], scene.segments.main[segment]);
        for shift in (0..SEGMENT).step_by(LANES) {
            if joined >> shift & 0xff == 0 {
                continue;
            }
            let cx = first + shift;
            let (cell, above) = (cy * (width + 1) + cx, (cy - 1) * width + cx);
            let bits = [joined >> shift, main >> shift];
            let cells = EightCells::load(simd, &self.planes, cell, above, width, bits);
            sink.eight(simd, &cells);
        }
        for (block, some) in blocks_of(scene.segments.quarters.of_segment(segment)) {
            let quads = EightQuads::load(simd, &self.quarters[block], some);
            sink.quads(simd, &quads, |lane| {
                scene.segments.quarters.id(block * LANES + lane)
            });
        }
    }
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
