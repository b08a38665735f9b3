//! A disc on the screen, and the pixels that meet it.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use fearless_simd_macros::simd;

/// Change of depth over a disc against its depth, below which series of three terms give the depth, and the square of its ratio, to f32's
/// rounding.
pub(crate) const FLAT: f32 = 1.0 / 256.0;

/// A disc on the screen. Places are px from the tile's first corner; forms are of the offset of a pixel's centre from the disc's
/// middle, px.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct Splat {
    /// The disc's middle.
    pub(crate) at: [f32; 2],
    /// Camera z of the middle, world units.
    pub(crate) z: f32,
    /// Least and greatest camera z of the disc, world units.
    pub(crate) depths: [f32; 2],
    /// How far behind it other discs belong to its surface, world units.
    pub(crate) tolerance: f32,
    /// Perspective: change of z of the middle over z; orthographic: change of z, world units. Per px.
    pub(crate) slope: [f32; 2],
    /// The change goes so far at most; negative where the series below do not hold.
    pub(crate) most_change: f32,
    /// The depth less the middle's over the change: for a change of 0, and its slope.
    pub(crate) deeper: [f32; 2],
    /// The square of the ratio of depths less 1 over the change, likewise.
    pub(crate) wider: [f32; 2],
    /// The blend's Gaussian exp(-q / 2): xx, twice xy, yy.
    pub(crate) gaussian: [f32; 3],
    /// The disc itself, q <= 1: xx, twice xy, yy.
    pub(crate) disc: [f32; 3],
    /// The disc's cut: what is above 1 lies outside.
    pub(crate) cut: [f32; 2],
    /// Weight in the middle, 1/px^2: the disc's share of the surface over the Gaussian's area.
    pub(crate) weight: f32,
    /// Linear colour.
    pub(crate) rgb: [f32; 3],
    /// Column and row, and the ends, of the disc in the tile with its apron.
    pub(crate) disc_box: [u32; 4],
    /// Blocks of the tile that the blend's footprint touches.
    pub(crate) blocks: u64,
}

/// Discs at one pixel each: depth and, for perspective, the square of that over the depth of the disc's middle.
pub(crate) struct Met<S: Simd> {
    pub(crate) z: f32x16<S>,
    pub(crate) square: f32x16<S>,
}

impl Splat {
    #[inline(always)]
    pub(crate) fn met<S: Simd>(&self, simd: S, [dx, dy]: [f32x16<S>; 2]) -> Met<S> {
        let splat = |value: f32| f32x16::splat(simd, value);
        let change = dx.mul_add(splat(self.slope[0]), dy * self.slope[1]);
        if self.most_change < 0.0 {
            return self.met_of_deep(simd, change);
        }
        let c = change
            .max(splat(-self.most_change))
            .min(splat(self.most_change));
        let deeper = c.mul_add(splat(self.deeper[1]), splat(self.deeper[0]));
        let wider = c.mul_add(splat(self.wider[1]), splat(self.wider[0]));
        Met {
            z: c.mul_add(deeper, splat(self.z)),
            square: c.mul_add(wider, splat(1.0)),
        }
    }

    /// As `met`, where the depth changes much over a disc: z = middle's z / (1 - change); beyond the horizon of the plane it is as far as
    /// the disc goes.
    #[cold]
    #[simd]
    fn met_of_deep<S: Simd>(&self, simd: S, change: f32x16<S>) -> Met<S> {
        let splat = |value: f32| f32x16::splat(simd, value);
        let one = splat(1.0);
        let [nearest, farthest] = self.depths;
        let over = one / (one - change).max(splat(f32::MIN_POSITIVE));
        let ratio = over
            .max(splat(nearest.max(0.0) / self.z))
            .min(splat(farthest / self.z));
        Met {
            z: ratio * self.z,
            square: ratio * ratio,
        }
    }

    #[inline(always)]
    pub(crate) fn covers<S: Simd>(
        &self,
        simd: S,
        met: &Met<S>,
        [dx, dy]: [f32x16<S>; 2],
    ) -> mask32x16<S> {
        let one = f32x16::splat(simd, 1.0);
        let q = met.square * form(simd, &self.disc, [dx, dy]);
        let covers = q.simd_le(one);
        if self.cut == [0.0; 2] {
            return covers;
        }
        let cut = dx.mul_add(f32x16::splat(simd, self.cut[0]), dy * self.cut[1]);
        covers & (met.square.sqrt() * cut).simd_le(one)
    }
}

#[inline(always)]
pub(crate) fn form<S: Simd>(simd: S, form: &[f32; 3], [dx, dy]: [f32x16<S>; 2]) -> f32x16<S> {
    let along = dx.mul_add(f32x16::splat(simd, form[0]), dy * form[1]);
    along.mul_add(dx, dy * dy * form[2])
}
