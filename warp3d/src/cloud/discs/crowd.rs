//! The nearest neighbours of sixteen points at a time.
//!
//! Takes a row of places in the tree's order, which lie together, and a distance; gathers all that lies within that of their box, once,
//! and ranks for each point those within the distance. Points that have too few there are left to a search of their own.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, u32x16};
use fearless_simd_macros::simd;
use glam::Vec3;

use crate::cloud::discs::cells::{LEAF, Place, Tree};
use crate::cloud::lanes::{LANES, Lanes};

/// Points of a fit, the point itself among them: two rings around it on a grid have 8 and 16. A guess.
pub(crate) const NEAR: usize = 13;

/// The neighbour whose distance says how far points lie apart: the first ring has six. Those of the second ring lie past the
/// border of a surface for twice as many points.
pub(crate) const RING: usize = 6;

/// Most points that are gathered for a row.
const MOST_GATHERED: usize = 512;

/// Most points within the distance of one: their place takes the low bits of the key that ranks them.
const MOST_WITHIN: usize = 64;

/// The bits of a key that hold the place.
const PLACE_BITS: u32 = 63;

/// Most leaves that are gathered for a row.
const MOST_LEAVES: usize = MOST_GATHERED / LEAF;

/// The nearest neighbours of sixteen points.
#[derive(Clone, Debug)]
pub(crate) struct Crowd {
    gathered: Gathered,
    /// Offsets of the nearest ones from each point, nearest first, along x, y and z; the last one means nothing.
    pub(crate) offsets: [[Lanes; NEAR + 1]; 3],
    /// The points that have their neighbours; one bit each.
    pub(crate) found: u64,
}

/// Points around a row, leaf by leaf.
#[derive(Clone, Debug)]
struct Gathered {
    leaves: usize,
    /// Places along x, y and z.
    at: [[f32; MOST_GATHERED]; 3],
    /// The corners of the box that each leaf lies in, along x, y and z.
    low: [[f32; MOST_LEAVES]; 3],
    high: [[f32; MOST_LEAVES]; 3],
}

impl Gathered {
    /// Takes up a leaf; false where there is no more room.
    #[inline(always)]
    fn push(&mut self, places: &[Place], [low, high]: [Vec3; 2]) -> bool {
        let leaf = self.leaves % MOST_LEAVES;
        for axis in 0..3 {
            let to = &mut self.at[axis][LEAF * leaf..][..LEAF];
            if places.len() < LEAF {
                to.fill(f32::INFINITY);
            }
            for (to, place) in to.iter_mut().zip(places) {
                *to = place.at[axis];
            }
            self.low[axis][leaf] = low[axis];
            self.high[axis][leaf] = high[axis];
        }
        self.leaves += 1;
        self.leaves < MOST_LEAVES
    }

    /// The leaves whose boxes lie within a distance of a place, whose square is given; one bit each.
    #[inline(always)]
    fn near<S: Simd>(&self, simd: S, at: Vec3, most: f32x16<S>) -> u64 {
        let zero = f32x16::splat(simd, 0.0);
        let mut near = 0;
        for first in (0..self.leaves).step_by(LANES) {
            let mut beyond = [zero; 3];
            for axis in 0..3 {
                let low = f32x16::from_slice(simd, &self.low[axis][first..][..LANES]);
                let high = f32x16::from_slice(simd, &self.high[axis][first..][..LANES]);
                let place = f32x16::splat(simd, at[axis]);
                beyond[axis] = (low - place).max(place - high).max(zero);
            }
            let [x, y, z] = beyond;
            let square = x.mul_add(x, y.mul_add(y, z * z));
            near |= square.simd_le(most).to_bitmask() << first;
        }
        near & u64::MAX >> (64 - self.leaves.clamp(1, 64))
    }
}

impl Crowd {
    pub(crate) fn new() -> Self {
        Self {
            gathered: Gathered {
                leaves: 0,
                at: [[0.0; MOST_GATHERED]; 3],
                low: [[0.0; MOST_LEAVES]; 3],
                high: [[0.0; MOST_LEAVES]; 3],
            },
            offsets: [[[0.0; LANES]; NEAR + 1]; 3],
            found: 0,
        }
    }

    /// Finds the neighbours of the places from `first` on that lie within `distance`.
    #[inline(always)]
    pub(crate) fn find<S: Simd>(
        &mut self,
        simd: S,
        tree: &Tree,
        (first, count): (usize, usize),
        distance: f32,
    ) {
        self.found = 0;
        let places = &tree.places[first..first + count];
        let (mut low, mut high) = (places[0].at, places[0].at);
        for place in places {
            low = low.min(place.at);
            high = high.max(place.at);
        }
        self.gathered.leaves = 0;
        let within = [low - distance, high + distance];
        let gathered = &mut self.gathered;
        if !tree.for_each_leaf(within, |places, bounds| gathered.push(places, bounds)) {
            return;
        }
        for (lane, place) in places.iter().enumerate() {
            let is_found = rank(
                simd,
                &self.gathered,
                (place.at, lane),
                distance,
                &mut self.offsets,
            );
            self.found |= u64::from(is_found) << lane;
        }
    }
}

/// Ranks the gathered points within a distance of a place by their distance; false where too few or too many are.
#[simd]
fn rank<S: Simd>(
    simd: S,
    gathered: &Gathered,
    (at, lane): (Vec3, usize),
    distance: f32,
    offsets: &mut [[Lanes; NEAR + 1]; 3],
) -> bool {
    let mut keys = [u32::MAX; MOST_WITHIN];
    let mut within = [0; MOST_WITHIN];
    let mut count = 0;
    let most = f32x16::splat(simd, distance * distance);
    let [xs, ys, zs] = &gathered.at;
    let mut leaves = gathered.near(simd, at, most);
    while leaves != 0 {
        let first = leaves.trailing_zeros() as usize % MOST_LEAVES * LEAF;
        leaves &= leaves - 1;
        let x = f32x16::from_slice(simd, &xs[first..first + LEAF]) - at.x;
        let y = f32x16::from_slice(simd, &ys[first..first + LEAF]) - at.y;
        let z = f32x16::from_slice(simd, &zs[first..first + LEAF]) - at.z;
        let square = x.mul_add(x, y.mul_add(y, z * z));
        let mut left = square.simd_le(most).to_bitmask();
        if count + left.count_ones() as usize > MOST_WITHIN {
            return false;
        }
        let mut squares = [0.0f32; LANES];
        square.store_slice(&mut squares);
        while left != 0 {
            let from = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            // Distances are ranked to 17 bits; the place among those within decides beyond them.
            let key = squares[from].to_bits() & !PLACE_BITS | count as u32;
            keys[count % MOST_WITHIN] = key;
            within[count % MOST_WITHIN] = first + from;
            count += 1;
        }
    }
    if count < NEAR {
        return false;
    }
    let put = |rank: usize, from: usize, offsets: &mut [[Lanes; NEAR + 1]; 3]| {
        // Those that are too far share the last place, which no one reads: a branch would cost more.
        let (rank, from, lane) = (rank.min(NEAR), from % MOST_GATHERED, lane % LANES);
        offsets[0][rank][lane] = xs[from] - at.x;
        offsets[1][rank][lane] = ys[from] - at.y;
        offsets[2][rank][lane] = zs[from] - at.z;
    };
    let few = [
        u32x16::from_slice(simd, &keys[..LANES]),
        u32x16::from_slice(simd, &keys[LANES..2 * LANES]),
    ];
    let is_few = count <= 2 * LANES;
    for (&key, &from) in keys.iter().zip(&within).take(count) {
        let key = u32x16::splat(simd, key);
        let nearer = |group: u32x16<S>| group.simd_lt(key).to_bitmask().count_ones() as usize;
        let mut rank = nearer(few[0]) + nearer(few[1]);
        if !is_few {
            for group in keys[2 * LANES..].chunks_exact(LANES) {
                rank += nearer(u32x16::from_slice(simd, group));
            }
        }
        put(rank, from, offsets);
    }
    true
}
