//! The nearest neighbours of sixteen points at a time.
//!
//! Takes a row of places in the tree's order, which lie together, and a distance; gathers all that lies within that of their box, once,
//! and ranks for each point those within the distance. Points that have too few there are left to a search of their own.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, u32x16};
use fearless_simd_macros::simd;
use glam::Vec3;

use crate::cloud::discs::cells::Tree;
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

/// The nearest neighbours of sixteen points.
#[derive(Clone, Debug)]
pub(crate) struct Crowd {
    /// Gathered points.
    at: [Vec<f32>; 3],
    /// Offsets of the nearest ones from each point, nearest first, along x, y and z; the last one means nothing.
    pub(crate) offsets: [[Lanes; NEAR + 1]; 3],
    /// The points that have their neighbours; one bit each.
    pub(crate) found: u64,
}

impl Crowd {
    pub(crate) fn new() -> Self {
        Self {
            at: [Vec::new(), Vec::new(), Vec::new()],
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
        self.at.iter_mut().for_each(Vec::clear);
        let to = &mut self.at;
        let is_complete = tree.for_each_within([low - distance, high + distance], |place: Vec3| {
            for (to, coordinate) in to.iter_mut().zip(place.to_array()) {
                to.push(coordinate);
            }
            to[0].len() < MOST_GATHERED
        });
        if !is_complete {
            return;
        }
        let padded = self.at[0].len().next_multiple_of(LANES);
        for to in &mut self.at {
            to.resize(padded, f32::INFINITY);
        }
        for (lane, place) in places.iter().enumerate() {
            let is_found = rank(
                simd,
                &self.at,
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
    gathered: &[Vec<f32>; 3],
    (at, lane): (Vec3, usize),
    distance: f32,
    offsets: &mut [[Lanes; NEAR + 1]; 3],
) -> bool {
    let mut keys = [u32::MAX; MOST_WITHIN];
    let mut within = [0; MOST_WITHIN];
    let mut count = 0;
    let most = f32x16::splat(simd, distance * distance);
    let [xs, ys, zs] = gathered;
    let rows = xs
        .chunks_exact(LANES)
        .zip(ys.chunks_exact(LANES))
        .zip(zs.chunks_exact(LANES));
    for (row, ((x, y), z)) in rows.enumerate() {
        let x = f32x16::from_slice(simd, x) - at.x;
        let y = f32x16::from_slice(simd, y) - at.y;
        let z = f32x16::from_slice(simd, z) - at.z;
        let square = x.mul_add(x, y.mul_add(y, z * z));
        let mut left = square.simd_le(most).to_bitmask();
        if left == 0 {
            continue;
        }
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
            within[count % MOST_WITHIN] = LANES * row + from;
            count += 1;
        }
    }
    if count < NEAR {
        return false;
    }
    let put = |rank: usize, from: usize, offsets: &mut [[Lanes; NEAR + 1]; 3]| {
        // Those that are too far share the last place, which no one reads: a branch would cost more.
        let rank = rank.min(NEAR);
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
