//! The two rows of samples on the screen that a row of cells lies between, warped when a band asks for them.
//!
//! A band draws rows of cells from the top, so that a row of samples is kept until the next but one. A row that two bands
//! ask for is warped twice, to the same numbers.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;

use super::vertex::{LANES, SEGMENT};
use super::warped::{Terms, narrow};
use crate::surfaces::surface::Surfaces;

/// Screen x, screen y and nearness of the samples of a row.
type Planes = [Vec<f32>; 3];

/// How much of a block of samples is warped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Held {
    Nothing,
    /// The last eight.
    End,
    All,
}

/// Samples of one row on the screen: sample i is entry i + [`LANES`], so that eight cells can be loaded anywhere.
#[derive(Debug)]
struct WarpedRow {
    /// Its number.
    y: usize,
    planes: Planes,
    blocks: Vec<Held>,
}

/// Two rows of samples, one below the other.
#[derive(Debug)]
pub(crate) struct WarpedRows {
    /// Those of even and of odd numbers.
    rows: [WarpedRow; 2],
}

impl WarpedRow {
    fn new(width: usize) -> Self {
        let blocks = width.div_ceil(SEGMENT);
        Self {
            y: usize::MAX,
            planes: [(); 3].map(|()| vec![f32::NAN; LANES + blocks * SEGMENT]),
            blocks: vec![Held::Nothing; blocks],
        }
    }

    /// Warps a block of row `y`, and the sample before it.
    #[inline(always)]
    fn hold<S: Simd>(
        &mut self,
        simd: S,
        terms: &Terms,
        surfaces: &Surfaces,
        [y, block]: [usize; 2],
    ) {
        if self.y != y {
            self.y = y;
            self.blocks.fill(Held::Nothing);
        }
        let width = surfaces.size[0];
        let disparity = &surfaces.disparity[y * width..(y + 1) * width];
        let first = block * SEGMENT;
        if block > 0 && self.blocks[block - 1] == Held::Nothing {
            self.blocks[block - 1] = Held::End;
            warp_samples(
                simd,
                terms,
                disparity,
                y,
                [first - LANES, first],
                &mut self.planes,
            );
        }
        if self.blocks[block] != Held::All {
            self.blocks[block] = Held::All;
            let end = (first + SEGMENT).min(width);
            warp_samples(simd, terms, disparity, y, [first, end], &mut self.planes);
        }
    }

    /// The entries from the sample before column `first` on.
    #[inline(always)]
    fn before(&self, first: usize) -> [&[f32]; 3] {
        let [x, y, nearness] = &self.planes;
        let from = first + LANES - 1;
        [&x[from..], &y[from..], &nearness[from..]]
    }
}

impl WarpedRows {
    /// Of a reference of so many columns, nothing warped.
    pub(crate) fn new(width: usize) -> Self {
        Self {
            rows: [WarpedRow::new(width), WarpedRow::new(width)],
        }
    }

    /// The corners of a segment of the row `cy` of cells: above and below, from the sample before its first cell on.
    #[inline(always)]
    pub(crate) fn around<S: Simd>(
        &mut self,
        simd: S,
        terms: &Terms,
        surfaces: &Surfaces,
        [cy, block]: [usize; 2],
    ) -> [[&[f32]; 3]; 2] {
        for y in [cy - 1, cy] {
            self.rows[y % 2].hold(simd, terms, surfaces, [y, block]);
        }
        let first = block * SEGMENT;
        [cy - 1, cy].map(|y| self.rows[y % 2].before(first))
    }
}

/// Warps the samples of row `y` from one column to another, the first a multiple of eight.
#[simd]
fn warp_samples<S: Simd>(
    simd: S,
    terms: &Terms,
    disparity: &[f32],
    y: usize,
    [first, end]: [usize; 2],
    planes: &mut Planes,
) {
    for first in (first..end).step_by(LANES) {
        let eight = eight_of(simd, disparity, first);
        for (value, plane) in terms
            .warped(simd, [first, y], eight)
            .into_iter()
            .zip(&mut *planes)
        {
            narrow(value).store_slice(&mut plane[first + LANES..first + 2 * LANES]);
        }
    }
}

/// Eight numbers of a row from column `first` on, unknown beyond its end.
#[inline(always)]
pub(crate) fn eight_of<S: Simd>(simd: S, row: &[f32], first: usize) -> f32x8<S> {
    if let Some(eight) = row.get(first..first + LANES) {
        return f32x8::from_slice(simd, eight);
    }
    let mut eight = [f32::NAN; LANES];
    let rest = &row[first..];
    eight[..rest.len()].copy_from_slice(rest);
    f32x8::simd_from(simd, eight)
}
