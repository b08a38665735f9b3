//! Sub-pixels of one triangle that stand beside each other in a row, and how they are lit.
//!
//! The same formulas as for a single position, in loops over the run that compilers turn into vector code.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use resample_core::light::{AMBIENT, DIFFUSE};

use crate::lanes::{IOTA, LANES, Lanes};
use crate::plane::Plane;
use crate::surface::{Light, Surface, TileView};

/// Sub-pixels a pixel apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// Position of the first, px from the corner of the tile's border.
    pub(crate) first_px: [f32; 2],
    /// How many they are; at most the span's columns.
    pub(crate) len: usize,
}

impl Run {
    /// Position of the k-th sub-pixel.
    #[inline(always)]
    pub(crate) fn at(&self, k: usize) -> [f32; 2] {
        [self.first_px[0] + k as f32, self.first_px[1]]
    }

    /// A plane's slope along the run and its value at the first sub-pixel.
    #[inline(always)]
    pub(crate) fn line(&self, plane: &Plane) -> [f32; 2] {
        [
            plane[0],
            plane[0] * self.first_px[0] + plane[1] * self.first_px[1] + plane[2],
        ]
    }

    /// The light that the surface reflects along the run, as a factor of its colour, from `column` of `out` on.
    #[inline(always)]
    pub(crate) fn light<S: Simd>(
        &self,
        simd: S,
        (surface, tile): (&Surface, &TileView),
        column: usize,
        out: &mut Lanes,
    ) {
        let mut done = 0;
        while done < self.len {
            self.light_vector(simd, (surface, tile), done)
                .store_slice(&mut out[column + done..column + done + LANES]);
            done += LANES;
        }
    }

    /// The light from the sub-pixel `done` of the run on.
    #[inline(always)]
    pub(crate) fn light_vector<S: Simd>(
        &self,
        simd: S,
        (surface, tile): (&Surface, &TileView),
        done: usize,
    ) -> f32x16<S> {
        let towards = match surface.light {
            Light::None | Light::Surroundings => return f32x16::splat(simd, 1.0),
            // The rays, turned round.
            Light::Eye => [
                self.line(&tile.rays[0]),
                self.line(&tile.rays[1]),
                self.line(&tile.rays[2]),
            ],
            Light::Distant(direction) => [
                [0.0, -direction.x],
                [0.0, -direction.y],
                [0.0, -direction.z],
            ],
        };
        let normal = [
            self.line(&surface.normal[0]),
            self.line(&surface.normal[1]),
            self.line(&surface.normal[2]),
        ];
        let splat = |x: f32| f32x16::splat(simd, x);
        let x = f32x16::from_slice(simd, &IOTA) + splat(done as f32);
        let zero = splat(0.0);
        let (mut cosine, mut normal2, mut ray2) = (zero, zero, zero);
        for axis in 0..3 {
            let n = splat(normal[axis][0]) * x + splat(normal[axis][1]);
            let r = splat(towards[axis][0]) * x + splat(towards[axis][1]);
            cosine -= n * r;
            normal2 += n * n;
            ray2 += r * r;
        }
        let lengths = (normal2 * ray2).sqrt();
        let cosine = lengths.simd_gt(zero).select(cosine / lengths, zero);
        splat(AMBIENT) + splat(DIFFUSE) * cosine.max(zero)
    }
}
