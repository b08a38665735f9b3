//! A disc on the screen, and the pixels that meet it.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use resample_core::Projection;

/// Change of depth over a disc against its depth, below which a series of three terms gives its inverse to f32's rounding.
const FLAT: f32 = 1.0 / 128.0;

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

/// Discs at one pixel each: depth and, for perspective, that over the depth of the disc's middle.
pub(crate) struct Met<S: Simd> {
    pub(crate) z: f32x16<S>,
    pub(crate) ratio: f32x16<S>,
}

impl Splat {
    #[inline(always)]
    pub(crate) fn met<S: Simd>(
        &self,
        simd: S,
        projection: Projection,
        [dx, dy]: [f32x16<S>; 2],
    ) -> Met<S> {
        let splat = |value: f32| f32x16::splat(simd, value);
        let [nearest, farthest] = self.depths;
        let change = dx.mul_add(splat(self.slope[0]), dy * self.slope[1]);
        let one = splat(1.0);
        match projection {
            // z = middle's z / (1 - change); beyond the horizon of the plane it is as far as the disc goes.
            Projection::Perspective => {
                let half = (farthest - self.z) / self.z;
                let ratio = if half < FLAT {
                    let c = change.max(splat(-half)).min(splat(half));
                    let over = c.mul_add(c.mul_add(c + one, one), one);
                    over.max(splat(1.0 - half)).min(splat(1.0 + half))
                } else {
                    let over = one / (one - change).max(splat(f32::MIN_POSITIVE));
                    over.max(splat(nearest.max(0.0) / self.z))
                        .min(splat(1.0 + half))
                };
                Met {
                    z: ratio * self.z,
                    ratio,
                }
            }
            Projection::Orthographic => Met {
                z: (change + self.z).max(splat(nearest)).min(splat(farthest)),
                ratio: one,
            },
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
        let q = met.ratio * met.ratio * form(simd, &self.disc, [dx, dy]);
        let cut = met.ratio * dx.mul_add(f32x16::splat(simd, self.cut[0]), dy * self.cut[1]);
        q.simd_le(one) & cut.simd_le(one)
    }
}

#[inline(always)]
pub(crate) fn form<S: Simd>(simd: S, form: &[f32; 3], [dx, dy]: [f32x16<S>; 2]) -> f32x16<S> {
    let along = dx.mul_add(f32x16::splat(simd, form[0]), dy * form[1]);
    along.mul_add(dx, dy * dy * form[2])
}
