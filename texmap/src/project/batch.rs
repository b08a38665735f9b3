//! Sub-pixels of one triangle that are computed together, and how they are lit.
//!
//! The same formulas as for a single position, in vectors.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use resample_core::light::{AMBIENT, DIFFUSE};

use crate::project::surface::{Light, Surface, TileView};
use crate::screen::lanes::{IOTA, LANES, Lanes};
use crate::screen::plane::Plane;

/// Up to sixteen positions, px from the corner of the tile's border. Those beyond `count` are any numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Batch {
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    pub(crate) count: usize,
}

impl Batch {
    /// Positions a pixel apart.
    #[inline(always)]
    pub(crate) fn along<S: Simd>(simd: S, first_px: [f32; 2], count: usize) -> Self {
        let x = f32x16::from_slice(simd, &IOTA) + f32x16::splat(simd, first_px[0]);
        let mut batch = Self {
            x: [0.0; LANES],
            y: [first_px[1]; LANES],
            count: count.min(LANES),
        };
        x.store_slice(&mut batch.x);
        batch
    }

    /// The k-th position.
    #[inline(always)]
    pub(crate) fn at(&self, k: usize) -> [f32; 2] {
        [self.x[k], self.y[k]]
    }

    /// A plane's values.
    #[inline(always)]
    pub(crate) fn on<S: Simd>(&self, simd: S, plane: &Plane) -> f32x16<S> {
        let [x, y] = [&self.x, &self.y].map(|lanes| f32x16::from_slice(simd, lanes));
        let splat = |x: f32| f32x16::splat(simd, x);
        splat(plane[0]) * x + splat(plane[1]) * y + splat(plane[2])
    }

    /// The values of three planes.
    #[inline(always)]
    pub(crate) fn on_3<S: Simd>(&self, simd: S, [a, b, c]: &[Plane; 3]) -> [f32x16<S>; 3] {
        [self.on(simd, a), self.on(simd, b), self.on(simd, c)]
    }

    /// The light that the surface reflects, as a factor of its colour.
    #[inline(always)]
    pub(crate) fn light<S: Simd>(
        &self,
        simd: S,
        (surface, tile): (&Surface, &TileView),
    ) -> f32x16<S> {
        let splat = |x: f32| f32x16::splat(simd, x);
        let zero = splat(0.0);
        let towards = match surface.light {
            Light::None | Light::Surroundings => return splat(1.0),
            Light::Eye => {
                let [x, y, z] = self.on_3(simd, &tile.rays);
                [zero - x, zero - y, zero - z]
            }
            Light::Distant(direction) => {
                [splat(direction.x), splat(direction.y), splat(direction.z)]
            }
        };
        let normal = self.on_3(simd, &surface.normal);
        let (mut cosine, mut normal2, mut towards2) = (zero, zero, zero);
        for axis in 0..3 {
            cosine += normal[axis] * towards[axis];
            normal2 += normal[axis] * normal[axis];
            towards2 += towards[axis] * towards[axis];
        }
        let lengths = (normal2 * towards2).sqrt();
        let cosine = lengths.simd_gt(zero).select(cosine / lengths, zero);
        splat(AMBIENT) + splat(DIFFUSE) * cosine.max(zero)
    }
}
