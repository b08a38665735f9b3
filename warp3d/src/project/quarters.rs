//! The quarters of cut cells: a corner's own piece of its tangent plane, up to where the edge was found.
//!
//! Which quarters there are, and how far they reach, belongs to the reference; only their corners are warped for each
//! frame.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f64x8, mask32x8};
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use super::cells::QuadBlock;
use crate::project::warped::{LANES, SEGMENT, Terms, narrow, widen};
use crate::surfaces::rims::Rims;
use crate::surfaces::surface::{Cell, KINDS, Surfaces, cell_of, patch_id};

/// The quarters of a reference, in the order of its segments of cells.
#[derive(Clone, Debug)]
pub(crate) struct Quarters {
    quarters: Vec<Quarter>,
    /// First quarter of each segment, and the end.
    first: Vec<u32>,
}

/// A quarter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quarter {
    /// The number of its piece.
    id: u32,
    /// How far it reaches along x and y, and the corner opposite its sample, from the sample on, in parts of [`ONE`].
    outline: [i16; 4],
}

/// A sample's spacing in a quarter's outline.
const ONE: f32 = 16384.0;

impl Quarter {
    /// The corner of its cell that is its sample.
    #[inline(always)]
    fn corner(&self) -> usize {
        (self.id % KINDS) as usize - 2
    }

    /// Returns true if it reaches forwards along one axis and backwards along the other.
    #[inline(always)]
    fn is_mirrored(&self) -> bool {
        matches!(self.id % KINDS - 2, 1 | 2)
    }

    /// Column and row of its sample.
    #[inline(always)]
    fn sample(&self, surfaces: &Surfaces) -> (usize, usize) {
        let (cell, corner) = (cell_of(self.id), self.corner());
        let cy = surfaces.cell_rows.row(cell);
        let cx = cell - cy * (surfaces.size[0] + 1);
        (cx + corner % 2 - 1, cy + corner / 2 - 1)
    }
}

impl Quarters {
    /// The quarters of every cut cell.
    pub(crate) fn new(surfaces: &Surfaces, rims: &Rims) -> Self {
        let [width, height] = surfaces.size;
        let per_row = (width + 1).div_ceil(SEGMENT);
        let of_segment = |segment: usize| {
            let (cy, first) = (segment / per_row, segment % per_row * SEGMENT);
            (first..(first + SEGMENT).min(width + 1))
                .filter(|cx| surfaces.cells[cy * (width + 1) + cx] == Cell::Cut)
                .flat_map(|cx| {
                    (0..4).filter_map(move |corner| quarter(surfaces, rims, (cx, cy), corner))
                })
                .collect()
        };
        let by_segment: Vec<Vec<Quarter>> = (0..per_row * (height + 1))
            .into_par_iter()
            .map(of_segment)
            .collect();
        let mut first = vec![0];
        first.extend(by_segment.iter().scan(0, |end, quarters| {
            *end += quarters.len() as u32;
            Some(*end)
        }));
        Self {
            quarters: by_segment.into_iter().flatten().collect(),
            first,
        }
    }

    /// The quarters of a segment.
    pub(crate) fn of_segment(&self, segment: usize) -> std::ops::Range<usize> {
        self.first[segment] as usize..self.first[segment + 1] as usize
    }

    /// The number of a quarter's piece.
    pub(crate) fn id(&self, quarter: usize) -> u32 {
        self.quarters[quarter].id
    }

    /// Warps every corner.
    pub(crate) fn project(
        &self,
        surfaces: &Surfaces,
        terms: &Terms,
        level: Vectors,
        to: &mut Vec<QuadBlock>,
    ) {
        to.resize(
            self.quarters.len().div_ceil(LANES),
            [[[f32::NAN; LANES]; 3]; 4],
        );
        to.par_chunks_mut(TASK)
            .zip(self.quarters.par_chunks(TASK * LANES))
            .for_each(|(to, quarters)| {
                dispatch!(level, simd => project_quarters(simd, terms, surfaces, quarters, to));
            });
    }
}

/// Blocks of one task.
const TASK: usize = 32;

/// The corners of eight quarters, wound like the reference's own triangles.
#[simd]
fn project_quarters<S: Simd>(
    simd: S,
    terms: &Terms,
    surfaces: &Surfaces,
    quarters: &[Quarter],
    to: &mut [QuadBlock],
) {
    for (block, quarters) in to.iter_mut().zip(quarters.chunks(LANES)) {
        // Place x and y, disparity and its slopes, the reach, and the inner corner.
        let mut lanes = [[f32::NAN; LANES]; 9];
        // Mirrored quarters are wound the other way.
        let mut mirrored = 0;
        for (lane, quarter) in quarters.iter().enumerate() {
            let (column, row) = quarter.sample(surfaces);
            mirrored |= u64::from(quarter.is_mirrored()) << lane;
            let index = row * surfaces.size[0] + column;
            let slope = surfaces.slope_of_quarter(index, quarter.corner());
            lanes[0][lane] = column as f32;
            lanes[1][lane] = row as f32;
            lanes[2][lane] = surfaces.disparity[index];
            (lanes[3][lane], lanes[4][lane]) = (slope[0], slope[1]);
            for (lanes, at) in lanes[5..].iter_mut().zip(quarter.outline) {
                lanes[lane] = f32::from(at) / ONE;
            }
        }
        let load = |i: usize| widen(f32x8::simd_from(simd, lanes[i]));
        let half = f64x8::splat(simd, 0.5);
        let (place, here) = ([load(0) + half, load(1) + half], load(2));
        let (slope, reach) = ([load(3), load(4)], [load(5), load(6)]);
        let inner = [load(7), load(8)];
        let zero = f64x8::splat(simd, 0.0);
        let least = f64x8::splat(simd, 0.25) * here;
        let flipped = mask32x8::from_bitmask(simd, mirrored);
        let offsets = [[zero, zero], [reach[0], zero], inner, [zero, reach[1]]];
        let mut corners = [[f32x8::splat(simd, 0.0); 3]; 4];
        for (corner, [x, y]) in corners.iter_mut().zip(offsets) {
            // The tangent plane may reach its horizon within a steep quarter: it stays in front of it.
            let disparity = (here + slope[0] * x + slope[1] * y).max(least);
            let at = terms.at(simd, [place[0] + x, place[1] + y, disparity]);
            for (to, value) in corner.iter_mut().zip(at) {
                *to = narrow(value);
            }
        }
        let [p, q, r, s] = corners;
        for axis in 0..3 {
            p[axis].store_slice(&mut block[0][axis]);
            flipped
                .select(s[axis], q[axis])
                .store_slice(&mut block[1][axis]);
            r[axis].store_slice(&mut block[2][axis]);
            flipped
                .select(q[axis], s[axis])
                .store_slice(&mut block[3][axis]);
        }
    }
}

fn quarter(
    surfaces: &Surfaces,
    rims: &Rims,
    (cx, cy): (usize, usize),
    corner: usize,
) -> Option<Quarter> {
    let corners = surfaces.corners(cx, cy);
    let sample = corners[corner].filter(|&i| !surfaces.disparity[i].is_nan())?;
    let towards = [1 - 2 * (corner as i32 % 2), 1 - 2 * (corner as i32 / 2)];
    let shape = rims.shape(surfaces, &corners, (corner, sample));
    let id = patch_id(cy * (surfaces.size[0] + 1) + cx, corner as u32 + 2);
    let [[x, y], [inner_x, inner_y]] = [shape.reach, shape.inner];
    let signed = |axis: usize, at: f64| (f64::from(towards[axis]) * at * f64::from(ONE)).round();
    let outline = [
        signed(0, x),
        signed(1, y),
        signed(0, inner_x),
        signed(1, inner_y),
    ];
    Some(Quarter {
        id,
        outline: outline.map(|at| at as i16),
    })
}
