//! Radiance on the octahedral square.

use std::ops::Range;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use resample_core::narrow::cell;

use crate::light::around::{Blurred, folded, square_from_direction};
use crate::screen::LANES;

/// Radiance on the octahedral square, with a border of one texel.
#[derive(Clone, Debug)]
pub(crate) struct Map {
    /// Texels along a side, without the border: a multiple of [`LANES`], except in coarse copies.
    pub(crate) side: usize,
    /// Rows of `side` + 2 texels.
    pub(crate) texels: Vec<Vec4>,
}

impl Map {
    /// A black map.
    pub(crate) fn black(side: usize) -> Self {
        Self {
            side,
            texels: vec![Vec4::ZERO; (side + 2) * (side + 2)],
        }
    }

    /// Calls a function for every row inside the border, with its number and its texels, in parallel; then continues the map at its border.
    pub(crate) fn for_each_row(&mut self, fill: impl Fn(usize, &mut [Vec4]) + Sync) {
        let (side, stride) = (self.side, self.side + 2);
        let rows = self.texels.par_chunks_mut(stride).skip(1).take(side);
        rows.enumerate()
            .for_each(|(y, row)| fill(y, &mut row[1..=side]));
        self.continue_at_border();
    }

    fn continue_at_border(&mut self) {
        let (side, stride) = (self.side, self.side + 2);
        for k in 0..stride {
            for [x, y] in [[k, 0], [k, side + 1], [0, k], [side + 1, k]] {
                let inside = folded([x, y].map(|at| at as isize - 1), side);
                self.texels[y * stride + x] = self.texels[(inside[1] + 1) * stride + inside[0] + 1];
            }
        }
    }

    /// The map and its ever coarser copies.
    pub(crate) fn with_coarser(self) -> Vec<Self> {
        let mut coarser = vec![self];
        while let Some(next) = coarser.last().filter(|map| map.side > 4).map(Self::halved) {
            coarser.push(next);
        }
        coarser
    }

    /// The mean of two by two texels.
    fn halved(&self) -> Self {
        let stride = self.side + 2;
        let mut half = Self::black(self.side / 2);
        half.for_each_row(|y, row| {
            for (x, texel) in row.iter_mut().enumerate() {
                let first = (2 * y + 1) * stride + 2 * x + 1;
                let below = first + stride;
                let sum = self.texels[first] + self.texels[first + 1];
                *texel = (sum + self.texels[below] + self.texels[below + 1]) * 0.25;
            }
        });
        half
    }

    /// The mix of the four texels around a direction.
    pub(crate) fn at(&self, direction: Vec3) -> Vec4 {
        self.at_square(square_from_direction(direction).map(|at| at * 0.5 + 0.5))
    }

    /// The mix of the four texels around a place on the square, 0 to 1 along each side.
    fn at_square(&self, place: [f32; 2]) -> Vec4 {
        let last = self.side as f32;
        let [x, y] = place.map(|at| at * last + 0.5);
        let (x0, y0) = (x.floor().clamp(0.0, last), y.floor().clamp(0.0, last));
        let first = cell(y0) * (self.side + 2) + cell(x0);
        let row = |at: usize| self.texels[at].lerp(self.texels[at + 1], x - x0);
        row(first).lerp(row(first + self.side + 2), y - y0)
    }

    /// Its texels, and what another map has at their places.
    fn with<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = [Vec4; 2]> + 'a {
        let (side, stride) = (self.side, self.side + 2);
        (0..stride * stride).map(move |at| {
            if other.side == side {
                return [self.texels[at], other.texels[at]];
            }
            let inside = folded([at % stride, at / stride].map(|k| k as isize - 1), side);
            let place = inside.map(|k| (k as f32 + 0.5) / side as f32);
            [self.texels[at], other.at_square(place)]
        })
    }
}

/// Maps for looks between one and the next.
pub(super) fn blurred_of(maps: &[&Map]) -> Blurred {
    let mut levels = Blurred::default();
    for pair in maps.windows(2) {
        levels.push(pair[0].side, pair[0].with(pair[1]));
    }
    levels
}

/// Directions at the places of sixteen texels in a row, of any length: `x` and `y` are on the square, -1 to 1.
#[inline(always)]
pub(super) fn directions_on_square<S: Simd>(simd: S, x: f32x16<S>, y: f32) -> [f32x16<S>; 3] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (zero, one, z) = (splat(0.0), splat(1.0), splat(y));
    let up = one - x.abs() - z.abs();
    let is_up = up.simd_ge(zero);
    let x_side = x.simd_ge(zero).select(one, splat(-1.0));
    let z_side = z.simd_ge(zero).select(one, splat(-1.0));
    [
        is_up.select(x, (one - z.abs()) * x_side),
        up,
        is_up.select(z, (one - x.abs()) * z_side),
    ]
}

/// The centres of sixteen texels in a row, from `first` on: places on the square, -1 to 1.
#[inline(always)]
pub(super) fn centres<S: Simd>(simd: S, first: usize, side: usize) -> f32x16<S> {
    let mut x = [0.0; LANES];
    for (lane, x) in x.iter_mut().enumerate() {
        *x = centre(first + lane, side);
    }
    f32x16::from_slice(simd, &x)
}

/// The centre of a texel in a row or a column.
pub(super) fn centre(texel: usize, side: usize) -> f32 {
    (2 * texel + 1) as f32 / side as f32 - 1.0
}

/// Sixteen texels at a time.
pub(super) fn blocks(row: &mut [Vec4]) -> impl Iterator<Item = (Range<usize>, &mut [Vec4])> {
    let block = |(number, texels): (usize, _)| (number * LANES..(number + 1) * LANES, texels);
    row.chunks_mut(LANES).enumerate().map(block)
}
