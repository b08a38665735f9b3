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

#[cfg(test)]
mod tests {
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    use super::*;

    const SIDE: usize = 16;

    /// A map whose texels hold their centre's place on the square, 0 to 1.
    fn places() -> Map {
        let mut map = Map::black(SIDE);
        let share = |k: usize| (centre(k, SIDE) + 1.0) / 2.0;
        map.for_each_row(|y, row| {
            for (x, texel) in row.iter_mut().enumerate() {
                *texel = Vec4::new(share(x), share(y), 1.0, 0.0);
            }
        });
        map
    }

    #[test]
    fn texels_are_at_their_centres() {
        assert_eq!(centre(0, 4), -0.75);
        assert_eq!(centre(3, 4), 0.75);
        let level = SimdLevel::Auto.resolve();
        let x = dispatch!(level, simd => centres(simd, 16, 64).to_array());
        for (lane, x) in x.into_iter().enumerate() {
            assert_eq!(x, (16.5 + lane as f32) / 32.0 - 1.0);
        }
    }

    #[test]
    fn a_mix_of_texels_is_the_place_itself() {
        let map = places();
        let half = map.halved();
        for (map, rim) in [(&map, 0.5 / SIDE as f32), (&half, 1.0 / SIDE as f32)] {
            for k in 0..=100 {
                let [u, v] = [k, k * 37 % 101].map(|k| rim + (1.0 - 2.0 * rim) * k as f32 / 100.0);
                let found = map.at_square([u, v]);
                let off = (found - Vec4::new(u, v, 1.0, 0.0)).abs().max_element();
                assert!(off < 1e-6, "{u} {v}: {found}");
            }
        }
    }

    #[test]
    fn a_direction_has_the_texel_that_was_drawn_for_it() {
        let map = places();
        let level = SimdLevel::Auto.resolve();
        for y in 0..SIDE {
            let [right, up, back] = dispatch!(level, simd => {
                directions_on_square(simd, centres(simd, 0, SIDE), centre(y, SIDE))
                    .map(|part| part.to_array())
            });
            let row = &map.texels[(y + 1) * (SIDE + 2) + 1..][..SIDE];
            for (x, texel) in row.iter().enumerate() {
                let direction = Vec3::new(right[x], up[x], back[x]);
                let off = (map.at(direction) - texel).abs();
                assert!(off.max_element() < 1e-5, "texel {x}, {y}: {direction}");
            }
        }
    }

    #[test]
    fn the_border_continues_the_map_across_the_fold() {
        // Beyond an edge of the square lies the texel at the other side of the edge's middle.
        let (map, stride) = (places(), SIDE + 2);
        for k in 0..SIDE {
            let mirrored = SIDE - 1 - k;
            let at = |x: usize, y: usize| map.texels[y * stride + x];
            assert_eq!(at(k + 1, 0), at(mirrored + 1, 1), "above");
            assert_eq!(at(k + 1, SIDE + 1), at(mirrored + 1, SIDE), "below");
            assert_eq!(at(0, k + 1), at(1, mirrored + 1), "left");
            assert_eq!(at(SIDE + 1, k + 1), at(SIDE, mirrored + 1), "right");
        }
    }

    #[test]
    fn coarser_copies_end_at_four_texels() {
        let sides: Vec<usize> = places().with_coarser().iter().map(|map| map.side).collect();
        assert_eq!(sides, [16, 8, 4]);
    }

    #[test]
    fn blocks_number_the_texels_of_a_row() {
        let mut row = vec![Vec4::ZERO; 40];
        let found: Vec<_> = blocks(&mut row)
            .map(|(texels, part)| (texels, part.len()))
            .collect();
        assert_eq!(found, [(0..16, 16), (16..32, 16), (32..48, 8)]);
    }
}
