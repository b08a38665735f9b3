//! The scalars at the corners of cells, a vector of samples at a time, and their trilinear mix.
//!
//! Source: the trilinear kernel, gathered. Limits: a brick's own cells only.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16, u32x16};

use crate::bricks::cells::{CELL_CORNERS, CELL_ROWS, CELLS, Scalars};
use crate::field::walk::lists::{LANES, vertex};

/// The values at the corners of each lane's cell, x fastest.
#[derive(Clone, Copy)]
pub(crate) struct Corners<S: Simd> {
    pub(crate) values: [f32x16<S>; 8],
}

impl<S: Simd> Corners<S> {
    /// The corners of the cells with these numbers in the brick.
    #[inline(always)]
    pub(crate) fn new(simd: S, scalars: &Scalars, cell: impl Fn(usize) -> u32) -> Self {
        let table = match scalars {
            Scalars::Numbers(table) => table,
            Scalars::Bytes(faces) => {
                let (mut front, mut back) = ([0; LANES], [0; LANES]);
                for lane in 0..LANES {
                    let cell = cell(lane) as usize % CELLS;
                    front[lane] = faces[cell];
                    back[lane] = faces[cell + CELL_ROWS];
                }
                let load = |faces: &[u32; LANES]| u32x16::from_slice(simd, faces);
                return Self::of_faces(simd, load(&front), load(&back));
            }
        };
        let mut corners = [[0.0; LANES]; 8];
        for lane in 0..LANES {
            let place = vertex(cell(lane));
            for (corner, offset) in corners.iter_mut().zip(CELL_CORNERS) {
                corner[lane] = table[place + offset];
            }
        }
        let mut values = [f32x16::splat(simd, 0.0); 8];
        for (value, corner) in values.iter_mut().zip(&corners) {
            *value = f32x16::from_slice(simd, corner);
        }
        Self { values }
    }

    /// The four bytes of each face.
    #[inline(always)]
    pub(crate) fn of_faces(simd: S, front: u32x16<S>, back: u32x16<S>) -> Self {
        let faces = [front, back];
        let mut values = [f32x16::splat(simd, 0.0); 8];
        for (k, value) in values.iter_mut().enumerate() {
            let byte = faces[k / 4] >> (8 * (k % 4) as u32) & u32x16::splat(simd, 0xff);
            *value = byte.bitcast::<i32x16<S>>().to_float();
        }
        Self { values }
    }

    /// The trilinear mix, in the order x, y, z.
    #[inline(always)]
    pub(crate) fn interpolated(&self, [x, y, z]: [f32x16<S>; 3]) -> f32x16<S> {
        let v = &self.values;
        let front = mix(mix(v[0], v[1], x), mix(v[2], v[3], x), y);
        let back = mix(mix(v[4], v[5], x), mix(v[6], v[7], x), y);
        mix(front, back, z)
    }

    /// How far the values are above one.
    #[inline(always)]
    pub(crate) fn above(mut self, simd: S, least: f32) -> Self {
        let (zero, least) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, least));
        for value in &mut self.values {
            *value = (*value - least).max(zero);
        }
        self
    }

    /// The trilinear mix in which each value counts by its weight.
    #[inline(always)]
    pub(crate) fn weighted(mut self, simd: S, weights: &Self, share: [f32x16<S>; 3]) -> f32x16<S> {
        for (product, &weight) in self.values.iter_mut().zip(&weights.values) {
            *product *= weight;
        }
        let least = f32x16::splat(simd, f32::MIN_POSITIVE);
        self.interpolated(share) / weights.interpolated(share).max(least)
    }
}

#[inline(always)]
fn mix<S: Simd>(a: f32x16<S>, b: f32x16<S>, t: f32x16<S>) -> f32x16<S> {
    (b - a).mul_add(t, a)
}
