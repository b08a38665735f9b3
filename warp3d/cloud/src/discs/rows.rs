//! Planes and discs of sixteen points at a time, where nothing is unusual: flat, and all around covered with neighbours.
//!
//! Takes the offsets of neighbours, returns normals, spacings and radii. Lengths are in units of the distance of the farthest
//! neighbour. The plane is that of `fit`, found by rotations (Jacobi); the radius is that of `voronoi`, found from all crossings of two
//! borders of the point's part.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use fearless_simd_macros::simd;

use crate::discs::crowd::{NEAR, RING};
use crate::lanes::{LANES, Lanes, Triple, dot};

/// Sweeps of rotations: the rest off the diagonal is squared by each, and is below f32's rounding after four.
const SWEEPS: usize = 4;

/// Borders of a point's part: those to its neighbours, and the end of the surface.
const BORDERS: usize = NEAR;

/// Points that lie on a line, nearly: the lesser width of their plane against the farthest neighbour.
const LEAST_WIDTH: f32 = 1e-2;

/// A crossing is a corner of a point's part if it lies beyond no other border by more than this, for rounding.
const BEYOND: f32 = 1e-4;

/// Directions in which a part may be open.
const DIRECTIONS: [[f32; 2]; 8] = {
    const H: f32 = std::f32::consts::FRAC_1_SQRT_2;
    [
        [1.0, 0.0],
        [H, H],
        [0.0, 1.0],
        [-H, H],
        [-1.0, 0.0],
        [-H, -H],
        [0.0, -1.0],
        [H, -H],
    ]
};

/// Where a disc is usual, and how large it is; `prepare` says why.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub(crate) rough: f32,
    pub(crate) whole_mean: f32,
    pub(crate) half_mean: f32,
    pub(crate) least_apart: f32,
    pub(crate) border_spacings: f32,
    pub(crate) reach_margin: f32,
    pub(crate) most_reach_spacings: f32,
}

/// The discs of sixteen points.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// The points that are usual; one bit each.
    pub(crate) usual: u64,
    pub(crate) normal: [Lanes; 3],
    /// World units, as all below.
    pub(crate) reach: Lanes,
    pub(crate) radius: Lanes,
    pub(crate) spacing: Lanes,
    pub(crate) thickness: Lanes,
}

/// A plane for each point.
struct Planes<S: Simd> {
    normal: Triple<S>,
    along: [Triple<S>; 2],
    /// Variances along the normal, and the lesser one in the plane.
    variances: [f32x16<S>; 2],
}

/// Fits discs to the offsets of neighbours, nearest first.
#[simd]
pub(crate) fn fitted<S: Simd>(simd: S, offsets: &[[Lanes; NEAR]; 3], limits: &Limits) -> Row {
    let splat = |value: f32| f32x16::splat(simd, value);
    let (zero, one) = (splat(0.0), splat(1.0));
    let place = |number: usize| {
        [
            f32x16::from_slice(simd, &offsets[0][number]),
            f32x16::from_slice(simd, &offsets[1][number]),
            f32x16::from_slice(simd, &offsets[2][number]),
        ]
    };
    let last = place(NEAR - 1);
    let reach = dot(&last, &last).sqrt();
    let unit = one / reach.max(splat(f32::MIN_POSITIVE));
    let mut places = [[zero; 3]; NEAR];
    for (number, to) in places.iter_mut().enumerate() {
        let [x, y, z] = place(number);
        *to = [x * unit, y * unit, z * unit];
    }
    let planes = Planes::of(simd, &places);
    let [thickness, width] = planes.variances.map(|v| v.max(zero).sqrt());
    let mut flat = [[zero; 2]; NEAR];
    let (mut sum_x, mut sum_y) = (zero, zero);
    for (to, place) in flat.iter_mut().zip(&places) {
        *to = [dot(place, &planes.along[0]), dot(place, &planes.along[1])];
        sum_x += to[0];
        sum_y += to[1];
    }
    let (x, y) = (sum_x * (1.0 / NEAR as f32), sum_y * (1.0 / NEAR as f32));
    let mean = x.mul_add(x, y * y).sqrt();
    let over = zero - one / mean.max(splat(f32::MIN_POSITIVE));
    let outward = [x * over, y * over];
    let one_sided = (mean - limits.whole_mean) * (1.0 / (limits.half_mean - limits.whole_mean));
    let part = one - one_sided.max(zero).min(one) * 0.5;
    let ring = dot(&places[RING], &places[RING]);
    // The circle through a neighbour holds the point itself and half of that neighbour beside those within.
    let area = part * ring * (std::f32::consts::PI / (RING as f32 + 0.5));
    let spacing = area.sqrt();
    let mut past = zero;
    for [x, y] in &flat {
        past = past.max(outward[0].mul_add(*x, outward[1] * *y));
    }
    let past = past + spacing * limits.border_spacings;
    let mut borders = [[zero; 2]; BORDERS];
    let apart = spacing * spacing * limits.least_apart;
    for (to, [x, y]) in borders.iter_mut().zip(&flat[1..]) {
        let square = x.mul_add(*x, *y * *y);
        // A border is held as what, times a place on it, is 1.
        let over = square.simd_gt(apart).select(splat(2.0) / square, zero);
        *to = [*x * over, *y * over];
    }
    let over = one / past;
    borders[BORDERS - 1] = [outward[0] * over, outward[1] * over];
    let most = spacing * (limits.most_reach_spacings / limits.reach_margin);
    let farthest = farthest(simd, &borders, most);
    let radius = farthest.mul_add(splat(limits.reach_margin), thickness);
    let radius = radius
        .max(spacing * 0.5)
        .min(spacing * limits.most_reach_spacings);
    let usual = thickness.simd_le(width * limits.rough)
        & width.simd_gt(splat(LEAST_WIDTH))
        & past.simd_ge(radius)
        & spacing.simd_gt(zero)
        & reach.simd_lt(splat(f32::INFINITY));
    let put = |value: f32x16<S>| {
        let mut lanes = [0.0; LANES];
        value.store_slice(&mut lanes);
        lanes
    };
    let [nx, ny, nz] = planes.normal;
    Row {
        usual: usual.to_bitmask(),
        normal: [put(nx), put(ny), put(nz)],
        reach: put(reach),
        radius: put(radius * reach),
        spacing: put(spacing * reach),
        thickness: put(thickness * reach),
    }
}

/// The farthest corner of a part, or `most` where it goes as far.
#[simd]
fn farthest<S: Simd>(simd: S, borders: &[[f32x16<S>; 2]; BORDERS], most: f32x16<S>) -> f32x16<S> {
    let splat = |value: f32| f32x16::splat(simd, value);
    let zero = splat(0.0);
    let mut square = zero;
    for second in 1..BORDERS {
        let [bx, by] = borders[second];
        for [ax, ay] in &borders[..second] {
            let across = ax.mul_add(by, zero - *ay * bx);
            let (wx, wy) = (by - *ay, *ax - bx);
            let turned = across.simd_lt(zero);
            let (wx, wy) = (turned.select(zero - wx, wx), turned.select(zero - wy, wy));
            let across = across.abs();
            let limit = across * (1.0 + BEYOND);
            let mut is_corner = across.simd_gt(splat(1e-12));
            for (number, [x, y]) in borders.iter().enumerate() {
                is_corner &= x.mul_add(wx, *y * wy).simd_le(limit);
                if number == 3 && !is_corner.any_true() {
                    break;
                }
            }
            let far = wx.mul_add(wx, wy * wy) / (across * across);
            square = is_corner.select(square.max(far), square);
        }
    }
    let mut is_open = mask32x16::splat(simd, false);
    for [x, y] in DIRECTIONS {
        let (x, y) = (most * x, most * y);
        let mut is_inside = mask32x16::splat(simd, true);
        for [a, b] in borders {
            is_inside &= a.mul_add(x, *b * y).simd_le(splat(1.0));
        }
        is_open |= is_inside;
    }
    let far = square.sqrt().min(most);
    // A part without any corner is open, too.
    (is_open | square.simd_le(zero)).select(most, far)
}

impl<S: Simd> Planes<S> {
    #[simd]
    fn of(simd: S, places: &[Triple<S>; NEAR]) -> Self {
        let splat = |value: f32| f32x16::splat(simd, value);
        let (zero, one) = (splat(0.0), splat(1.0));
        let (mut sums, mut squares, mut mixed) = ([zero; 3], [zero; 3], [zero; 3]);
        for [x, y, z] in places {
            sums = [sums[0] + *x, sums[1] + *y, sums[2] + *z];
            squares = [
                x.mul_add(*x, squares[0]),
                y.mul_add(*y, squares[1]),
                z.mul_add(*z, squares[2]),
            ];
            // Each is numbered by the axis that it lacks.
            mixed = [
                y.mul_add(*z, mixed[0]),
                x.mul_add(*z, mixed[1]),
                x.mul_add(*y, mixed[2]),
            ];
        }
        let share = 1.0 / NEAR as f32;
        let mean = sums.map(|sum| sum * share);
        let mut values =
            [0, 1, 2].map(|axis: usize| squares[axis] * share - mean[axis] * mean[axis]);
        let mut rest = [
            mixed[0] * share - mean[1] * mean[2],
            mixed[1] * share - mean[0] * mean[2],
            mixed[2] * share - mean[0] * mean[1],
        ];
        let mut axes = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
        for _ in 0..SWEEPS {
            for [p, q, r] in [[0, 1, 2], [0, 2, 1], [1, 2, 0]] {
                let off = rest[r];
                let is_off = off.abs().simd_gt(splat(1e-20));
                let ratio = (values[q] - values[p]) * 0.5 / is_off.select(off, one);
                let tangent = one / (ratio.abs() + ratio.mul_add(ratio, one).sqrt());
                let tangent = ratio.simd_lt(zero).select(zero - tangent, tangent);
                let tangent = is_off.select(tangent, zero);
                let cosine = one / tangent.mul_add(tangent, one).sqrt();
                let sine = tangent * cosine;
                values[p] -= tangent * off;
                values[q] += tangent * off;
                rest[r] = zero;
                // The one that lacks q joins p and r, and the one that lacks p joins q and r.
                let (pr, qr) = (rest[q], rest[p]);
                rest[q] = cosine * pr - sine * qr;
                rest[p] = sine * pr + cosine * qr;
                let (before, after) = (axes[p], axes[q]);
                axes[p] = mixed_axes([before, after], [cosine, zero - sine]);
                axes[q] = mixed_axes([before, after], [sine, cosine]);
            }
        }
        let [a, b, c] = values;
        let first = a.simd_le(b) & a.simd_le(c);
        let second = !first & b.simd_le(c);
        let pick = |x: Triple<S>, y: Triple<S>, mask: mask32x16<S>| {
            [
                mask.select(x[0], y[0]),
                mask.select(x[1], y[1]),
                mask.select(x[2], y[2]),
            ]
        };
        let [u, v, w] = axes;
        let one_width = first.select(b, a);
        let other_width = (first | second).select(c, b);
        Self {
            normal: pick(u, pick(v, w, second), first),
            along: [pick(v, u, first), pick(w, v, first | second)],
            variances: [a.min(b).min(c), one_width.min(other_width)],
        }
    }
}

#[inline(always)]
fn mixed_axes<S: Simd>([a, b]: [Triple<S>; 2], [first, second]: [f32x16<S>; 2]) -> Triple<S> {
    [
        a[0].mul_add(first, b[0] * second),
        a[1].mul_add(first, b[1] * second),
        a[2].mul_add(first, b[2] * second),
    ]
}
