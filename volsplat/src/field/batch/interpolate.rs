//! The field at packed samples: the trilinear mix of the voxels around each.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16, u32x16};

use super::one_by_one;
use crate::bricks::cells::Scalars;
use crate::bricks::cells::{CELL_CORNERS, CELL_ROWS, CellBrick, FaceBytes};
use crate::field::walk::lists::{CELL_MASK, LANES, PackedSamples, vertex};

/// The field at the samples.
#[inline(always)]
pub(crate) fn interpolate<S: Simd>(simd: S, brick: &CellBrick, samples: &mut PackedSamples) {
    let count = samples.len();
    let table = match &brick.scalars {
        Scalars::Numbers(table) => table,
        Scalars::Bytes(faces) => return of_bytes(simd, faces, samples),
    };
    let corners = &mut samples.between.corners;
    for (k, &place) in samples.place[..count].iter().enumerate() {
        one_by_one();
        let place = vertex(place);
        for edge in 0..4 {
            let at = place + CELL_CORNERS[2 * edge];
            corners[2 * edge][k] = table[at];
            corners[2 * edge + 1][k] = table[at + 1];
        }
    }
    for first in (0..count).step_by(LANES) {
        let range = first..first + LANES;
        let load = |k: usize| f32x16::from_slice(simd, &samples.between.corners[k][range.clone()]);
        let mix = Mix::new(simd, samples, first);
        let front = mix.face(load(0), load(1), load(2), load(3));
        let back = mix.face(load(4), load(5), load(6), load(7));
        mix.between(front, back)
            .store_slice(&mut samples.scalar[range.clone()]);
    }
}

/// The field at samples among bytes.
#[inline(always)]
fn of_bytes<S: Simd>(simd: S, faces: &FaceBytes, samples: &mut PackedSamples) {
    let count = samples.len();
    let [front, back] = &mut samples.between.faces;
    for k in 0..count {
        one_by_one();
        let cell = (samples.place[k] & CELL_MASK) as usize;
        front[k] = faces[cell];
        back[k] = faces[cell + CELL_ROWS];
    }
    for first in (0..count).step_by(LANES) {
        let range = first..first + LANES;
        let [front, back] = &samples.between.faces;
        let front = u32x16::from_slice(simd, &front[range.clone()]);
        let back = u32x16::from_slice(simd, &back[range.clone()]);
        let mix = Mix::new(simd, samples, first);
        let front = mix.face(
            byte(simd, front, 0),
            byte(simd, front, 8),
            byte(simd, front, 16),
            byte(simd, front, 24),
        );
        let back = mix.face(
            byte(simd, back, 0),
            byte(simd, back, 8),
            byte(simd, back, 16),
            byte(simd, back, 24),
        );
        mix.between(front, back)
            .store_slice(&mut samples.scalar[range.clone()]);
    }
}

/// A byte of each lane as a number.
#[inline(always)]
fn byte<S: Simd>(simd: S, lanes: u32x16<S>, shift: u32) -> f32x16<S> {
    let whole = (lanes >> shift) & u32x16::splat(simd, 0xff);
    whole.bitcast::<i32x16<S>>().to_float()
}

/// The trilinear mix, in the order x, y, z.
struct Mix<S: Simd> {
    share: [f32x16<S>; 3],
}

impl<S: Simd> Mix<S> {
    #[inline(always)]
    fn new(simd: S, samples: &PackedSamples, first: usize) -> Self {
        let range = first..first + LANES;
        Self {
            share: [
                f32x16::from_slice(simd, &samples.share[0][range.clone()]),
                f32x16::from_slice(simd, &samples.share[1][range.clone()]),
                f32x16::from_slice(simd, &samples.share[2][range]),
            ],
        }
    }

    #[inline(always)]
    fn face(&self, a: f32x16<S>, b: f32x16<S>, c: f32x16<S>, d: f32x16<S>) -> f32x16<S> {
        let near = mix(a, b, self.share[0]);
        mix(near, mix(c, d, self.share[0]), self.share[1])
    }

    #[inline(always)]
    fn between(&self, front: f32x16<S>, back: f32x16<S>) -> f32x16<S> {
        mix(front, back, self.share[2])
    }
}

#[inline(always)]
fn mix<S: Simd>(a: f32x16<S>, b: f32x16<S>, t: f32x16<S>) -> f32x16<S> {
    (b - a).mul_add(t, a)
}
