//! The discs of a group that a tile needs.
//!
//! Takes groups that are listed for the tile, gathers those of their discs that may touch it and are not hidden, and fills vectors with
//! discs of several groups: half of a group lies in other tiles.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;

use crate::discs::prepare::{Disc, NO_DISC};
use crate::draw::bounds::Balls;
use crate::draw::groups::Group;
use crate::draw::sizes::TILE_PX;
use crate::draw::view::View;
use crate::lanes::{LANES, Lanes};

/// The discs of a group, copied from where they lie far apart in memory.
#[derive(Clone, Debug)]
pub(crate) struct Fetched {
    count: usize,
    discs: [Disc; LANES],
    /// The first disc of the group's block: its place, and that in camera space.
    base: ([f32; 3], [f32; 3]),
}

/// The discs of a group that are needed.
pub(crate) struct Chosen {
    /// One bit each.
    pub(crate) needed: u64,
    /// Their middles in camera space.
    pub(crate) place: [Lanes; 3],
}

impl Fetched {
    pub(crate) fn new() -> Self {
        Self {
            count: 0,
            discs: [NO_DISC; LANES],
            base: ([0.0; 3], [0.0; 3]),
        }
    }

    /// Copies the discs of a group.
    #[inline(always)]
    pub(crate) fn fill(&mut self, view: &View, group: &Group) {
        self.base = view.base(group);
        self.count = group.count as usize;
        if view.groups.every == 1 {
            let discs = &view.discs[group.first as usize..];
            self.discs[..self.count].copy_from_slice(&discs[..self.count]);
        } else {
            let discs = view.groups.discs(view.discs, group);
            for (to, disc) in self.discs.iter_mut().zip(discs) {
                *to = *disc;
            }
        }
    }

    pub(crate) fn discs(&self) -> &[Disc; LANES] {
        &self.discs
    }

    /// Finds the discs that may touch the tile whose first pixel is `first`, not farther than `far`.
    #[simd]
    pub(crate) fn chosen<S: Simd>(
        &self,
        simd: S,
        view: &View,
        first: [usize; 2],
        far: f32,
    ) -> Chosen {
        let splat = |value: f32| f32x16::splat(simd, value);
        let (from, base) = self.base;
        let mut offset = [[0.0; LANES]; 3];
        let mut radius = [0.0; LANES];
        let mut spacing = [0.0; LANES];
        for (lane, disc) in self.discs.iter().enumerate() {
            for axis in 0..3 {
                offset[axis][lane] = disc.position[axis] - from[axis];
            }
            radius[lane] = disc.radius;
            spacing[lane] = disc.spacing;
        }
        let base = [splat(base[0]), splat(base[1]), splat(base[2])];
        let place = view.places(simd, &offset, &base);
        let from = [first[0] as f64, first[1] as f64];
        let load = |lanes: &Lanes| f32x16::from_slice(simd, lanes);
        let sizes = [splat(0.0), load(&radius), load(&spacing)];
        let balls = Balls::new(simd, view, view.middles(simd, place, from), sizes);
        let bounds = balls.bounds(simd, view);
        let mut needed = place[2].simd_gt(splat(view.near)) & bounds.nearest.simd_le(splat(far));
        for axis in 0..2 {
            let (at, reach) = (balls.middles.at[axis], bounds.reach[axis]);
            let side = TILE_PX as f32;
            needed &= (at + reach).simd_gt(splat(0.0)) & (at - reach).simd_lt(splat(side));
        }
        let mut chosen = Chosen {
            needed: needed.to_bitmask() & u64::MAX >> (64 - self.count.clamp(1, LANES)),
            place: [[0.0; LANES]; 3],
        };
        for (to, place) in chosen.place.iter_mut().zip(place) {
            place.store_slice(to);
        }
        chosen
    }
}
