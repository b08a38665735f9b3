//! The scalars at the corners of cells, a vector of samples at a time, and their trilinear mix.
//!
//! Source: the trilinear kernel, gathered. Limits: a brick's own cells only.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16, mask32x16, u8x64, u32x16};

use crate::bricks::cells::{
    CELL_CORNERS, CELL_ROWS, CELL_SIDE, CELLS, Scalars, TABLE_LEN, VERTEX_SIDE,
};
use crate::field::settings::TileContext;
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

/// The places of cells' first vertices.
#[inline(always)]
pub(crate) fn vertices<S: Simd>(simd: S, cell: u32x16<S>) -> u32x16<S> {
    let constant = |v: u32| u32x16::splat(simd, v);
    let rows = (cell >> 3) & constant(CELL_SIDE as u32 - 1);
    let layers = cell >> 6;
    cell + rows + layers * constant(2 * CELL_SIDE as u32 + 1)
}

/// Returns which cells may show something, by a bit for each cell of the brick.
#[inline(always)]
pub(crate) fn shown<S: Simd>(simd: S, bits: u8x64<S>, cell: u32x16<S>) -> mask32x16<S> {
    let constant = |v: u32| u32x16::splat(simd, v);
    // The lowest byte of each lane is looked up, the upper bytes are ignored.
    let rows: u8x64<S> = (cell >> 3).bitcast();
    let row: u32x16<S> = bits.swizzle_dyn(rows).bitcast();
    let bit = row >> (cell & constant(7)) & constant(1);
    bit.simd_eq(constant(1))
}

/// The samples whose nearest voxel the mask shows.
#[inline(always)]
pub(crate) fn unmasked<S: Simd>(
    simd: S,
    job: &TileContext,
    cell: u32x16<S>,
    share: [f32x16<S>; 3],
) -> mask32x16<S> {
    let Some(mask) = job.placed.brick.mask.as_deref() else {
        return cell.simd_eq(cell);
    };
    let constant = |v: u32| u32x16::splat(simd, v);
    let half = f32x16::splat(simd, 0.5);
    let mut nearest = vertices(simd, cell);
    let mut stride = 1;
    for share in share {
        nearest += share.simd_ge(half).select(constant(stride), constant(0));
        stride *= VERTEX_SIDE as u32;
    }
    let nearest = nearest.to_array();
    let mut kept = [0u32; LANES];
    for lane in 0..LANES {
        kept[lane] = u32::from(mask[(nearest[lane] as usize).min(TABLE_LEN - 1)]);
    }
    u32x16::from_slice(simd, &kept).simd_gt(constant(0))
}
