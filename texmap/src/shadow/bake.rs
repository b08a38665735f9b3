//! The light that reaches a place, and what it sees of the sky.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec3;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::light::around::folded;
use crate::light::blocked::bvh::{Rays, Tree, Vector};
use crate::light::blocked::place::{CELLS, COUNTS, HARMONICS, PlaceLight, SIDES, STARTS, cell_of};
use crate::light::blocked::sky::{Part, Sky};
use crate::light::environment::irradiance::basis;
use crate::project::cull::Facing;
use crate::screen::{LANES, Lanes};
use crate::shadow::places::{Mixed, Place};
use resample_core::narrow::{byte, cell, index32};

/// The shares of each part of the sky that sixteen places see.
type Seen = [Lanes];

/// Finds the light of places, and how bright each is, as a part of the even sky.
pub(crate) fn bake(
    (tree, sky): (&Tree, &Sky),
    places: &[Place],
    level: Vectors,
) -> Vec<(PlaceLight, f32)> {
    let per_mean = sky.per_mean();
    by_sixteen(sky, places, |places, seen, count| {
        let mut inside = [0.0; LANES];
        let mut sums = Sums::default();
        dispatch!(level, simd => see(simd, (tree, sky), places, seen));
        dispatch!(level, simd => sum_light(simd, sky, (places, seen), &mut sums));
        let mut found = finished(sky, (places, seen), &sums, count);
        if found.iter().any(|(_, even)| *even == 0.0) {
            dispatch!(level, simd => leave_bodies(simd, (tree, sky), places, &mut inside));
        }
        for ((light, even), inside) in found.iter_mut().zip(inside) {
            if *even == 0.0 && inside > 0.5 {
                light.harmonics[0][COUNTS] = 0.0;
            }
            *even *= per_mean;
        }
        found
    })
}

/// How bright places are, as a part of the even sky.
pub(crate) fn brightness((tree, sky): (&Tree, &Sky), places: &[Place], level: Vectors) -> Vec<f32> {
    let per_mean = sky.per_mean();
    by_sixteen(sky, places, |places, seen, count| {
        dispatch!(level, simd => see(simd, (tree, sky), places, seen));
        let mut sums = [0.0; LANES];
        for (part, seen) in sky.parts.iter().zip(seen) {
            for ((sum, seen), normal) in sums.iter_mut().zip(seen).zip(&places.normals) {
                *sum += *seen * part.light.element_sum() * part.direction.dot(*normal).max(0.0);
            }
        }
        sums[..count].iter().map(|sum| sum * per_mean).collect()
    })
}

/// Calls `find` for sixteen places beside each other after the other; gives what it found in the order of the places.
fn by_sixteen<T: Clone + Send + Sync>(
    sky: &Sky,
    places: &[Place],
    find: impl Fn(&PlaceLanes, &mut Seen, usize) -> Vec<T> + Sync,
) -> Vec<T> {
    // Rays from places beside each other meet the same boxes.
    let order = along_curve(places);
    let found: Vec<T> = order
        .par_chunks(LANES)
        .map_init(
            || vec![[0.0; LANES]; sky.parts.len()],
            |seen, order| {
                let lanes = PlaceLanes::new(order.iter().map(|&i| places[i as usize]));
                find(&lanes, seen, order.len())
            },
        )
        .flatten_iter()
        .collect();
    let mut at_place = vec![0; order.len()];
    for (at, &place) in order.iter().enumerate() {
        at_place[place as usize] = at;
    }
    at_place.iter().map(|&at| found[at].clone()).collect()
}

/// The order of places along a curve through cells of space.
fn along_curve(places: &[Place]) -> Vec<u32> {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for place in places {
        (low, high) = (low.min(place.position), high.max(place.position));
    }
    let per_unit = 1023.0 / (high - low).max_element().max(f32::MIN_POSITIVE);
    let code = |place: &Place| {
        let cell = ((place.position - low) * per_unit)
            .to_array()
            .map(|x| index32(cell(x)));
        let mut code = 0_u32;
        for bit in (0..10).rev() {
            for part in cell {
                code = code << 1 | (part >> bit & 1);
            }
        }
        code
    };
    let mut coded: Vec<(u32, u32)> = (0..)
        .zip(places)
        .map(|(at, place)| (code(place), at))
        .collect();
    coded.sort_unstable();
    coded.into_iter().map(|(_, at)| at).collect()
}

/// Up to sixteen places.
struct PlaceLanes {
    position: [Lanes; 3],
    normal: [Lanes; 3],
    normals: [Vec3; LANES],
    /// 1 where there is a place.
    is_place: Lanes,
    /// 1 where its side is a back.
    is_back: Lanes,
}

impl PlaceLanes {
    fn new(places: impl Iterator<Item = Place>) -> Self {
        let mut new = Self {
            position: [[0.0; LANES]; 3],
            normal: [[0.0; LANES]; 3],
            normals: [Vec3::Y; LANES],
            is_place: [0.0; LANES],
            is_back: [0.0; LANES],
        };
        for (lane, place) in places.enumerate() {
            for axis in 0..3 {
                new.position[axis][lane] = place.position[axis];
                new.normal[axis][lane] = place.normal[axis];
            }
            new.normals[lane] = place.normal;
            new.is_place[lane] = 1.0;
            new.is_back[lane] = if place.side == Facing::Back { 1.0 } else { 0.0 };
        }
        new
    }
}

/// One direction of so many shows whether a back side sees the sky: most are inside of closed bodies. A place behind a hole
/// through which less than a 64th of the sky shines may be missed.
const PROBES: usize = 8;

/// The share of light that arrives from each part of the sky; 0 below the horizon.
#[simd]
fn see<S: Simd>(simd: S, (tree, sky): (&Tree, &Sky), places: &PlaceLanes, seen: &mut Seen) {
    let zero = f32x16::splat(simd, 0.0);
    let from = Vector::load(simd, &places.position);
    let normal = Vector::load(simd, &places.normal);
    let mut open = f32x16::from_slice(simd, &places.is_place);
    let back = f32x16::from_slice(simd, &places.is_back);
    if back.simd_gt(zero).any_true() {
        let mut probed = open - back;
        for (part, seen) in sky.parts.iter().zip(&mut *seen).step_by(PROBES) {
            look(simd, tree, (&from, &normal), (part, back), seen);
            probed = probed.max(f32x16::from_slice(simd, seen));
        }
        open = probed.simd_gt(zero).select(open, zero);
    }
    for (part, seen) in sky.parts.iter().zip(seen) {
        look(simd, tree, (&from, &normal), (part, open), seen);
    }
}

/// The share of the light of a part of the sky that arrives at those places where `open` is 1.
#[inline(always)]
fn look<S: Simd>(
    simd: S,
    tree: &Tree,
    (from, normal): (&Vector<S>, &Vector<S>),
    (part, open): (&Part, f32x16<S>),
    seen: &mut Lanes,
) {
    let zero = f32x16::splat(simd, 0.0);
    let towards = Vector::splat(simd, part.direction);
    let light = normal.dot(&towards).simd_gt(zero).select(open, zero);
    light.store_slice(seen);
    if light.simd_gt(zero).any_true() {
        tree.block_in(simd, &Rays::new(simd, *from, part.direction), seen);
    }
}

/// Directions of which one tells whether a place is inside of a body.
const CROSSINGS: usize = 16;

/// How many bodies a ray leaves more often than it enters them, on the mean of some directions: 1 inside of a body.
#[simd]
fn leave_bodies<S: Simd>(
    simd: S,
    (tree, sky): (&Tree, &Sky),
    places: &PlaceLanes,
    inside: &mut Lanes,
) {
    let from = Vector::load(simd, &places.position);
    for part in sky.parts.iter().step_by(CROSSINGS) {
        tree.cross_in(simd, &Rays::new(simd, from, part.direction), inside);
    }
    let per_part = f32x16::splat(simd, CROSSINGS as f32 / sky.parts.len() as f32);
    (f32x16::from_slice(simd, inside) * per_part).store_slice(inside);
}

/// Sums over the sky for sixteen places.
struct Sums {
    /// Red, green and blue of each harmonic.
    harmonics: [[Lanes; 3]; HARMONICS],
    /// Irradiance over pi.
    exact: [Lanes; 3],
}

impl Default for Sums {
    fn default() -> Self {
        Self {
            harmonics: [[[0.0; LANES]; 3]; HARMONICS],
            exact: [[0.0; LANES]; 3],
        }
    }
}

/// Sums what is seen of the sky.
#[simd]
fn sum_light<S: Simd>(simd: S, sky: &Sky, (places, seen): (&PlaceLanes, &Seen), sums: &mut Sums) {
    let zero = f32x16::splat(simd, 0.0);
    let normal = Vector::load(simd, &places.normal);
    let mut harmonics = [[zero; 3]; HARMONICS];
    let mut exact = [zero; 3];
    for (part, seen) in sky.parts.iter().zip(seen) {
        let seen = f32x16::from_slice(simd, seen);
        if !seen.simd_gt(zero).any_true() {
            continue;
        }
        for (sums, own) in harmonics.iter_mut().zip(&part.harmonics) {
            for (sum, own) in sums.iter_mut().zip(own) {
                *sum = f32x16::splat(simd, *own).mul_add(seen, *sum);
            }
        }
        let cosine = normal.dot(&Vector::splat(simd, part.direction)).max(zero) * seen;
        for (sum, own) in exact.iter_mut().zip(part.light.to_array()) {
            *sum = f32x16::splat(simd, own).mul_add(cosine, *sum);
        }
    }
    let found = harmonics.as_flattened().iter();
    for (found, sum) in found.zip(sums.harmonics.as_flattened_mut()) {
        found.store_slice(sum);
    }
    for (found, sum) in exact.iter().zip(&mut sums.exact) {
        found.store_slice(sum);
    }
}

/// The light of places from sums, and the light on each, red, green and blue together.
fn finished(
    sky: &Sky,
    (places, seen): (&PlaceLanes, &Seen),
    sums: &Sums,
    count: usize,
) -> Vec<(PlaceLight, f32)> {
    let mut maps = vec![[0; CELLS]; count];
    visibility_maps(sky, (places, seen), &mut maps);
    let finished = |(lane, visible): (usize, [u8; CELLS])| {
        let mut harmonics = [[0.0; 4]; HARMONICS];
        let basis = basis(places.normals[lane]);
        let mut smooth = [0.0; 3];
        for ((own, sums), basis) in harmonics.iter_mut().zip(&sums.harmonics).zip(basis) {
            for k in 0..3 {
                own[k] = sums[k][lane];
                smooth[k] += basis * own[k];
            }
        }
        // The harmonics follow normal maps; where there is none, light is as it was summed.
        for (k, smooth) in smooth.into_iter().enumerate() {
            harmonics[0][k] += sums.exact[k][lane] - smooth;
        }
        harmonics[0][COUNTS] = 1.0;
        let even = (0..3).map(|k| sums.exact[k][lane]).sum();
        (PlaceLight { harmonics, visible }, even)
    };
    maps.into_iter().enumerate().map(finished).collect()
}

/// The shares of light that arrive from around each direction.
fn visibility_maps(sky: &Sky, (places, seen): (&PlaceLanes, &Seen), maps: &mut [[u8; CELLS]]) {
    const SIDE: usize = SIDES[0];
    let zero = [[0.0_f32; LANES]; SIDE * SIDE];
    let (mut sums, mut whole) = (Box::new(zero), Box::new(zero));
    for (part, seen) in sky.parts.iter().zip(seen) {
        let (sums, whole) = (&mut sums[part.cell], &mut whole[part.cell]);
        for lane in 0..LANES {
            let above = if part.direction.dot(places.normals[lane]) > 0.0 {
                part.weight
            } else {
                0.0
            };
            whole[lane] += above;
            sums[lane] += above * seen[lane];
        }
    }
    for (lane, maps) in maps.iter_mut().enumerate() {
        let normal = places.normals[lane];
        let share = |at: usize| (whole[at][lane] > 0.0).then(|| sums[at][lane] / whole[at][lane]);
        let (mut all_seen, mut all) = (0.0, 1e-9);
        for at in 0..SIDE * SIDE {
            all_seen += sums[at][lane];
            all += whole[at][lane];
        }
        // What lies below the horizon is not blocked, for a lobe counts only what is above. So it is filled with its mirror image.
        let mut map: Vec<f32> = (0..SIDE * SIDE)
            .map(|at| {
                share(at).unwrap_or_else(|| {
                    let direction = sky.cells[at];
                    let mirrored = direction - normal * (2.0 * direction.dot(normal)).min(0.0);
                    share(cell_of(mirrored)).unwrap_or(all_seen / all)
                })
            })
            .collect();
        for (&side, start) in SIDES.iter().zip(STARTS) {
            if side < SIDE {
                map = halved(&map, side);
            }
            let stride = side + 2;
            for (y, row) in maps[start..start + stride * stride]
                .chunks_exact_mut(stride)
                .enumerate()
            {
                let is_inside = (1..=side).contains(&y);
                for (x, cell) in row.iter_mut().enumerate() {
                    let at = if is_inside && (1..=side).contains(&x) {
                        [x - 1, y - 1]
                    } else {
                        folded([x, y].map(|k| isize::try_from(k).unwrap_or(0) - 1), side)
                    };
                    *cell = byte(map[at[1] * side + at[0]] * 255.0);
                }
            }
        }
    }
}

/// The means of two by two cells.
fn halved(map: &[f32], side: usize) -> Vec<f32> {
    let at = |x: usize, y: usize| map[y * 2 * side + x];
    let mean = |k: usize| {
        let [x, y] = [2 * (k % side), 2 * (k / side)];
        0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))
    };
    (0..side * side).map(mean).collect()
}

/// Adds the places whose light is mixed of that of others.
pub(crate) fn mix(places: &mut Vec<PlaceLight>, mixed: &[Mixed]) {
    for one in mixed {
        let [a, b] = one.of.map(|i| &places[i as usize]);
        let mut new = a.clone();
        for (new, other) in new
            .harmonics
            .as_flattened_mut()
            .iter_mut()
            .zip(b.harmonics.as_flattened())
        {
            *new += (other - *new) * one.share;
        }
        for (new, other) in new.visible.iter_mut().zip(b.visible) {
            let own = f32::from(*new);
            *new = byte(own + (f32::from(other) - own) * one.share);
        }
        places.push(new);
    }
}
