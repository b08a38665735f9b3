//! Balls on the screen: where discs, and groups of them, may be seen.
//!
//! Takes balls around discs, or around the middles of a group's discs, returns bounds of their pixels and of their depth. They are
//! cheap and hold all that the exact footprints do.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use resample_core::Projection;
use resample_core::narrow::single;
use resample_core::point::PIXEL_SIGMA_PX;

use crate::draw::sizes::{APRON_PX, LEAST_HALF_AXIS_PX, MOST_REACH_PX, REACH_SIGMAS};
use crate::draw::view::{Middles, View};

/// A little more, for rounding.
const ROUNDING_PX: f32 = 0.01;

/// Sixteen discs, or groups of discs.
pub(crate) struct Balls<S: Simd> {
    pub(crate) middles: Middles<S>,
    /// Distance of the farthest disc's middle from a group's; 0 for discs.
    pub(crate) reach: f32x16<S>,
    /// Radius of the largest disc.
    pub(crate) radius: f32x16<S>,
    /// Standard deviation of the widest blend.
    pub(crate) sigma: f32x16<S>,
}

/// Bounds of sixteen balls.
pub(crate) struct Bounds<S: Simd> {
    /// The pixels that may be touched lie so far from the middle at most, along x and y, px.
    pub(crate) reach: [f32x16<S>; 2],
    /// The least depth.
    pub(crate) nearest: f32x16<S>,
}

impl<S: Simd> Balls<S> {
    /// Balls of these middles; sizes are those of prepared discs.
    #[inline(always)]
    pub(crate) fn new(
        simd: S,
        view: &View,
        middles: Middles<S>,
        [reach, radius, spacing]: [f32x16<S>; 3],
    ) -> Self {
        let larger = f32x16::splat(simd, view.larger);
        let (radius, spacing) = (radius * larger, spacing * larger);
        Self {
            middles,
            reach,
            radius,
            sigma: view.sigma(spacing, radius),
        }
    }

    #[inline(always)]
    pub(crate) fn bounds(&self, simd: S, view: &View) -> Bounds<S> {
        let splat = |value: f32| f32x16::splat(simd, value);
        let [x, y, z] = self.middles.ray;
        let depth = self.middles.place[2];
        let nearest = depth - self.reach - self.radius;
        // Discs nearer than the group's middle are larger on the screen, and their rays may be longer than the middle's.
        let (grown, longer) = match view.projection {
            Projection::Perspective => {
                let near = splat(view.near);
                let grown = depth / nearest.max(near);
                (grown, grown * (depth / (depth - self.reach).max(near)))
            }
            Projection::Orthographic => (splat(1.0), splat(1.0)),
        };
        let length = x.mul_add(x, y.mul_add(y, z * z)).sqrt() * self.middles.scale;
        let most = splat(MOST_REACH_PX);
        let pixel = splat(single(PIXEL_SIGMA_PX * PIXEL_SIGMA_PX));
        let mut reach = [splat(0.0); 2];
        for (to, focal) in reach.iter_mut().zip(view.focal) {
            let unit = length * focal;
            let blend = self.sigma * unit;
            let blend = blend.mul_add(blend, pixel).sqrt() * single(REACH_SIGMAS) * longer;
            let disc = self.radius.mul_add(unit, splat(LEAST_HALF_AXIS_PX)) * longer;
            // The coverage of neighbouring pixels counts, to half a pixel from their middles.
            let own = blend
                .min(most)
                .max(disc.min(most) + (APRON_PX as f32 + 0.5));
            *to = (self.reach * unit).mul_add(grown, own + ROUNDING_PX);
        }
        Bounds { reach, nearest }
    }
}
