//! The nearest neighbours of sixteen points at a time.
//!
//! Takes a leaf of the tree, whose places lie together, and a distance; gathers the leaves within that of it, once, and keeps for each point
//! a sorted list of the nearest ones: all sixteen lists take up a gathered point at once. Points that have too few within the distance are left
//! to a search of their own.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, u32x16};
use fearless_simd_macros::simd;
use glam::Vec3;

use crate::discs::cells::{LEAF, Place, Tree};
use crate::lanes::{LANES, Lanes};

/// Points of a fit, the point itself among them: two rings around it on a grid have 8 and 16. A guess.
pub(crate) const NEAR: usize = 13;

/// The neighbour whose distance says how far points lie apart: the first ring has six. Those of the second ring lie past the
/// border of a surface for twice as many points.
pub(crate) const RING: usize = 6;

/// Most leaves that are gathered for a row.
const MOST_LEAVES: usize = 32;

/// Most points that are gathered for a row: 512.
const MOST_GATHERED: usize = MOST_LEAVES * LEAF;

/// The low bits of a key, which hold the place among the gathered points.
const PLACE_BITS: u32 = 511;

/// In place of points that a leaf lacks: far from all others, with a finite square.
const NOWHERE: f32 = 3e18;

/// The nearest neighbours of sixteen points.
#[derive(Clone, Debug)]
pub(crate) struct Crowd {
    gathered: Gathered,
    /// Offsets of the nearest ones from each point, nearest first, along x, y and z.
    pub(crate) offsets: [[Lanes; NEAR]; 3],
    /// The points that have their neighbours; one bit each.
    pub(crate) found: u64,
}

/// Points around a row, leaf by leaf.
#[derive(Clone, Debug)]
struct Gathered {
    leaves: usize,
    /// The leaf that is the row itself.
    own: usize,
    /// Places along x, y and z.
    at: [[f32; MOST_GATHERED]; 3],
    /// The box that each leaf lies in.
    bounds: [[Vec3; 2]; MOST_LEAVES],
}

/// The keys of the nearest points, least first: squared distances, whose low bits say which points they are.
type Keys<S> = [f32x16<S>; NEAR];

impl Gathered {
    /// Takes up a leaf; false where there is no more room.
    #[inline(always)]
    fn push(&mut self, places: &[Place], bounds: [Vec3; 2]) -> bool {
        let leaf = self.leaves % MOST_LEAVES;
        for axis in 0..3 {
            let to = &mut self.at[axis][LEAF * leaf..][..LEAF];
            if places.len() < LEAF {
                to.fill(NOWHERE);
            }
            for (to, place) in to.iter_mut().zip(places) {
                *to = place.at[axis];
            }
        }
        self.bounds[leaf] = bounds;
        self.leaves += 1;
        self.leaves < MOST_LEAVES
    }
}

impl Crowd {
    pub(crate) fn new() -> Self {
        Self {
            gathered: Gathered {
                leaves: 0,
                own: 0,
                at: [[0.0; MOST_GATHERED]; 3],
                bounds: [[Vec3::ZERO; 2]; MOST_LEAVES],
            },
            offsets: [[[0.0; LANES]; NEAR]; 3],
            found: 0,
        }
    }

    /// Finds the neighbours of the places of a leaf, the first of which has this slot, that lie within `distance`.
    #[inline(always)]
    pub(crate) fn find<S: Simd>(&mut self, simd: S, tree: &Tree, first: usize, distance: f32) {
        self.found = 0;
        let places = tree.leaf(first);
        let (mut low, mut high) = (places[0].at, places[0].at);
        for place in places {
            low = low.min(place.at);
            high = high.max(place.at);
        }
        let gathered = &mut self.gathered;
        gathered.leaves = 0;
        let is_complete = tree.for_each_leaf([low - distance, high + distance], |slot, bounds| {
            if slot == first {
                gathered.own = gathered.leaves;
            }
            gathered.push(tree.leaf(slot), bounds)
        });
        if !is_complete {
            return;
        }
        let own = gathered.own % MOST_LEAVES * LEAF;
        let most = f32x16::splat(simd, distance * distance);
        let [xs, ys, zs] = &gathered.at;
        let at = [
            f32x16::from_slice(simd, &xs[own..own + LEAF]),
            f32x16::from_slice(simd, &ys[own..own + LEAF]),
            f32x16::from_slice(simd, &zs[own..own + LEAF]),
        ];
        let keys = nearest(simd, gathered, at, most);
        self.found = keys[NEAR - 1].simd_lt(most).to_bitmask();
        let [to_x, to_y, to_z] = &mut self.offsets;
        let ranked = keys.iter().zip(to_x).zip(to_y).zip(to_z);
        for (((key, to_x), to_y), to_z) in ranked {
            let mut from = [0u32; LANES];
            let place = key.bitcast::<u32x16<S>>() & PLACE_BITS;
            place.store_slice(&mut from);
            for (lane, &from) in from.iter().enumerate() {
                let from = from as usize % MOST_GATHERED;
                to_x[lane] = xs[from] - xs[own + lane];
                to_y[lane] = ys[from] - ys[own + lane];
                to_z[lane] = zs[from] - zs[own + lane];
            }
        }
    }
}

/// The keys of the gathered points nearest to each of sixteen places, nearer than where the square is `most`, which fills the rest.
#[simd]
fn nearest<S: Simd>(simd: S, gathered: &Gathered, at: [f32x16<S>; 3], most: f32x16<S>) -> Keys<S> {
    let zero = f32x16::splat(simd, 0.0);
    let mut keys = [most; NEAR];
    let others = (0..gathered.leaves).filter(|leaf| *leaf != gathered.own);
    // The row's own points are the nearest, and keep most others out of the lists.
    for leaf in std::iter::once(gathered.own).chain(others) {
        let [low, high] = gathered.bounds[leaf % MOST_LEAVES];
        let x = (at[0] - high.x).max(zero - at[0] + low.x).max(zero);
        let y = (at[1] - high.y).max(zero - at[1] + low.y).max(zero);
        let z = (at[2] - high.z).max(zero - at[2] + low.z).max(zero);
        let square = x.mul_add(x, y.mul_add(y, z * z));
        if !square.simd_lt(keys[NEAR - 1]).any_true() {
            continue;
        }
        let first = leaf % MOST_LEAVES * LEAF;
        for (number, bits) in (first..first + LEAF).zip(first as u32..) {
            let x = at[0] - gathered.at[0][number];
            let y = at[1] - gathered.at[1][number];
            let z = at[2] - gathered.at[2][number];
            let square = x.mul_add(x, y.mul_add(y, z * z));
            // Distances are ranked to 14 bits; the place decides beyond them.
            let ranked = square.bitcast::<u32x16<S>>() & !PLACE_BITS | bits;
            let key: f32x16<S> = ranked.bitcast();
            if key.simd_lt(keys[NEAR - 1]).any_true() {
                insert(&mut keys, key);
            }
        }
    }
    keys
}

/// Puts a key into each sorted list, from which the greatest falls.
#[inline(always)]
fn insert<S: Simd>(keys: &mut Keys<S>, mut key: f32x16<S>) {
    for kept in keys {
        let less = kept.min(key);
        key = kept.max(key);
        *kept = less;
    }
}
