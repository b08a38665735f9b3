//! Samples as a screen sees them: the terms of the warping equation along rows of samples, and rows that are warped as they are asked for.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f64x8, mask32x8, mask64x8};
use fearless_simd_macros::simd;
use resample_core::Projection;

use crate::surfaces::surface::Surfaces;
use crate::view::layer::RowRange;
use crate::view::warp::Warp;

/// Cells that are drawn at once.
pub(crate) const LANES: usize = 8;

/// Cells of a row that share one entry in the table of screen rows; one bit each.
pub(crate) const SEGMENT: usize = 32;

/// A sample or another corner on the screen; x is NaN where it is not in front of the near plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    /// Screen x, px.
    pub(crate) x: f32,
    /// Screen y, px.
    pub(crate) y: f32,
    /// Larger is nearer; linear over the screen on a plane.
    pub(crate) nearness: f32,
}

/// 0.5 to 7.5.
const PLACES: [f64; LANES] = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5];

/// The terms of places on the screen.
#[derive(Clone, Debug)]
pub(crate) struct Terms {
    /// Constant, and what x, y and disparity add: screen x, screen y and their divisor, all scaled, and the numerator of
    /// depth.
    rows: [[f64; 4]; 4],
    /// Constant and slope in disparity of the divisor of depth.
    depth_divisor: [f64; 2],
    target: Projection,
    /// Largest nearness of anything in front.
    most: f64,
}

/// A sum of terms for eight places.
#[inline(always)]
fn along<S: Simd>(
    simd: S,
    [one, by_x, by_y, by_disparity]: [f64; 4],
    [x, y, disparity]: [f64x8<S>; 3],
) -> f64x8<S> {
    let constant = |v: f64| f64x8::splat(simd, v);
    let sum = y.mul_add(constant(by_y), constant(one));
    let sum = x.mul_add(constant(by_x), sum);
    disparity.mul_add(constant(by_disparity), sum)
}

impl Terms {
    pub(crate) fn new(warp: &Warp) -> Self {
        let ([by_x, by_y, one], by_disparity) = (warp.pixel_columns(), warp.disparity_column());
        let ([x, y, constant, disparity], depth_divisor) = warp.depth_terms();
        let row = |i: usize| [one[i], by_x[i], by_y[i], by_disparity[i]];
        let (target, near) = warp.target();
        Self {
            rows: [row(0), row(1), row(2), [constant, x, y, disparity]],
            depth_divisor,
            target,
            most: warp.nearness(near),
        }
    }

    /// Eight samples of row `y` from column `first` on, as [`Self::at`] gives them.
    #[inline(always)]
    pub(crate) fn warped<S: Simd>(
        &self,
        simd: S,
        [first, y]: [usize; 2],
        disparity: f32x8<S>,
    ) -> [f64x8<S>; 3] {
        let x = f64x8::from_slice(simd, &PLACES) + f64x8::splat(simd, first as f64);
        let y = f64x8::splat(simd, y as f64 + 0.5);
        self.at(simd, [x, y, widen(disparity)])
    }

    /// Eight places of the reference (x and y, px, and disparity): screen x, which is NaN where they are not in front,
    /// screen y and nearness.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, at: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        let constant = |v: f64| f64x8::splat(simd, v);
        let divisor = along(simd, self.rows[2], at);
        let inverse = constant(1.0) / divisor;
        let (nearness, before) = match self.target {
            Projection::Perspective => {
                let [one, by_disparity] = self.depth_divisor.map(constant);
                let nearness = at[2].mul_add(by_disparity, one) * inverse;
                (nearness, divisor.simd_gt(constant(0.0)))
            }
            Projection::Orthographic => (
                -(along(simd, self.rows[3], at) * inverse),
                divisor.simd_gt(constant(f64::NEG_INFINITY)),
            ),
        };
        let in_front = before
            & nearness.simd_le(constant(self.most))
            & divisor.simd_lt(constant(f64::INFINITY));
        let x = along(simd, self.rows[0], at) * inverse;
        let x = in_front.select(x, constant(f64::NAN));
        [x, along(simd, self.rows[1], at) * inverse, nearness]
    }

    /// Screen x and y of eight corners of boxes, and which of them are in front: between corners that are, no place is behind
    /// the eye or before the near plane.
    #[inline(always)]
    pub(crate) fn corner<S: Simd>(
        &self,
        simd: S,
        at: [f64x8<S>; 3],
    ) -> ([f64x8<S>; 2], mask64x8<S>) {
        let constant = |v: f64| f64x8::splat(simd, v);
        let [x, y, nearness] = self.at(simd, at);
        let before = along(simd, self.rows[2], at).simd_gt(constant(0.0));
        // Places between may round differently.
        let most = nearness.abs().mul_add(constant(1e-9), nearness);
        let in_front = before & most.simd_le(constant(self.most)) & x.simd_eq(x);
        ([x, y], in_front)
    }
}

/// Eight numbers of twice the width.
#[inline(always)]
pub(crate) fn widen<S: Simd>(value: f32x8<S>) -> f64x8<S> {
    let (low, high) = value.widen();
    low.combine(high)
}

/// Eight numbers of half the width.
#[inline(always)]
pub(crate) fn narrow<S: Simd>(value: f64x8<S>) -> f32x8<S> {
    let (low, high) = value.split();
    low.narrow(high)
}

/// Least and greatest screen x and y, by lanes.
pub(crate) struct Bounds<S: Simd> {
    low: [f32x8<S>; 2],
    high: [f32x8<S>; 2],
}

impl<S: Simd> Bounds<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        let constant = |v: f32| f32x8::splat(simd, v);
        Self {
            low: [constant(f32::INFINITY); 2],
            high: [constant(f32::NEG_INFINITY); 2],
        }
    }

    /// Widens the bounds to hold some of eight places.
    #[inline(always)]
    pub(crate) fn include(&mut self, at: [f32x8<S>; 2], some: mask32x8<S>) {
        for (axis, value) in at.into_iter().enumerate() {
            self.low[axis] = some.select(value.min(self.low[axis]), self.low[axis]);
            self.high[axis] = some.select(value.max(self.high[axis]), self.high[axis]);
        }
    }

    #[inline(always)]
    pub(crate) fn ranges(&self) -> [RowRange; 2] {
        let range = |i: usize| RowRange {
            low: self.low[i].reduce_min(),
            high: self.high[i].reduce_max(),
        };
        [range(0), range(1)]
    }
}

// The two rows of samples on the screen that a row of cells lies between, warped when a band asks for them.
//
// A band draws rows of cells from the top, so that a row of samples is kept until the next but one. A row that two bands
// ask for is warped twice, to the same numbers.

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
