//! Blurred surroundings as maps on a square, and looks at them, sixteen at a time.
//!
//! The square is the octahedral map, whose pole is +y. A direction divided by the sum of its parts' sizes lies on an octahedron; the upper half of it unfolds to a diamond, the
//! lower half to the four corners of the square around it (Engelhardt and Dachsbacher 2008). Neighbours on the sphere are
//! neighbours on the square, except at its border, where one side continues on itself turned round.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16, i32x16};
use glam::{Vec3, Vec4};

use crate::screen::{LANES, Lanes};

/// Roughnesses for which radiance is kept; see [`roughness_of_level`].
pub(crate) const LEVELS: usize = 13;

/// How much of the way from 0 to 1 roughness goes with the level; the rest goes with its square. Levels of narrow lobes differ most, so they lie closer
/// together. Chosen on balls of all roughnesses in a room of lamps, as good between levels as at them.
const LINEAR: f32 = 0.3;

/// The roughness of a level.
pub(crate) fn roughness_of_level(level: f32) -> f32 {
    let share = level / (LEVELS - 1) as f32;
    share * (LINEAR + (1.0 - LINEAR) * share)
}

/// The level of a roughness.
#[inline(always)]
pub(super) fn level_of_roughness<S: Simd>(simd: S, roughness: f32x16<S>) -> f32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    let root = (roughness * splat(4.0 * (1.0 - LINEAR)) + splat(LINEAR * LINEAR)).sqrt();
    let per_share = (LEVELS - 1) as f32 * 0.5 / (1.0 - LINEAR);
    ((root - splat(LINEAR)) * splat(per_share)).max(splat(0.0))
}

/// Maps of radiance behind one another, each with the next rougher one: both are looked at together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blurred {
    /// Rows of `side` + 2 pairs of texels, level by level; the last level has no map of its own.
    pairs: Vec<[f32; 8]>,
    /// Where each level begins, and texels along its side without the border.
    starts: Vec<i32>,
    sides: Vec<f32>,
}

impl Blurred {
    /// Adds a level: its texels, and those of the next at the same places.
    pub(crate) fn push(&mut self, side: usize, texels: impl Iterator<Item = [Vec4; 2]>) {
        self.starts.push(self.pairs.len() as i32);
        self.sides.push(side as f32);
        self.pairs.extend(texels.map(|[own, next]| {
            let ([a, b, c, d], [e, f, g, h]) = (own.to_array(), next.to_array());
            [a, b, c, d, e, f, g, h]
        }));
    }

    /// All texels.
    #[cfg(test)]
    pub(crate) fn texels(&self) -> &[[f32; 8]] {
        &self.pairs
    }
}

/// Where to look.
pub(crate) struct LookUps {
    /// On the octahedral square, 0..=1.
    x: [f32; LANES],
    y: [f32; LANES],
    /// Level of roughness.
    level: [f32; LANES],
}

impl LookUps {
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, directions: &[f32x16<S>; 3], roughness: f32x16<S>) -> Self {
        let [x, y] = places_on_square(simd, directions);
        let mut looks = Self {
            x: [0.0; LANES],
            y: [0.0; LANES],
            level: [0.0; LANES],
        };
        x.store_slice(&mut looks.x);
        y.store_slice(&mut looks.y);
        level_of_roughness(simd, roughness).store_slice(&mut looks.level);
        looks
    }

    /// On the octahedral square, 0..=1.
    #[inline(always)]
    pub(crate) fn on_square(&self, lane: usize) -> [f32; 2] {
        [self.x[lane], self.y[lane]]
    }

    #[inline(always)]
    pub(crate) fn roughness(&self, lane: usize) -> f32 {
        roughness_of_level(self.level[lane])
    }
}

/// Where directions of any length lie on the octahedral square, 0..=1 along both sides.
#[inline(always)]
fn places_on_square<S: Simd>(simd: S, [dx, dy, dz]: &[f32x16<S>; 3]) -> [f32x16<S>; 2] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (zero, one, half) = (splat(0.0), splat(1.0), splat(0.5));
    let size = one / (dx.abs() + dy.abs() + dz.abs());
    let (x, z) = (*dx * size, *dz * size);
    let (x_side, z_side) = (
        x.simd_ge(zero).select(one, splat(-1.0)),
        z.simd_ge(zero).select(one, splat(-1.0)),
    );
    let upper = dy.simd_ge(zero);
    let across = upper.select(x, (one - z.abs()) * x_side);
    let down = upper.select(z, (one - x.abs()) * z_side);
    [across * half + half, down * half + half]
}

/// The radiance of the surroundings.
#[inline(always)]
pub(super) fn look_around<S: Simd>(
    simd: S,
    blurred: &Blurred,
    at: &LookUps,
    count: usize,
    out: &mut [[f32; LANES]; 3],
) {
    let level = f32x16::from_slice(simd, &at.level);
    let first = level.floor().min(f32x16::splat(simd, (LEVELS - 2) as f32));
    let place = [
        f32x16::from_slice(simd, &at.x),
        f32x16::from_slice(simd, &at.y),
    ];
    let mut shares = [0.0; LANES];
    (level - first).store_slice(&mut shares);
    let levels: i32x16<S> = first.to_int_precise();
    let (mut starts, mut sides) = ([0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let level = levels[lane] as usize;
        starts[lane] = blurred.starts[level];
        sides[lane] = blurred.sides[level];
    }
    let places = MapTaps::new(simd, (&starts, &sides), place);
    for lane in 0..count {
        let place = (places.place[lane] as usize, places.stride[lane] as usize);
        let shares_of_texels = [places.right[lane], places.lower[lane]];
        let (near, far) = four(simd, &blurred.pairs, place, shares_of_texels).split();
        let radiance = (far - near).mul_add(f32x4::splat(simd, shares[lane]), near);
        out[0][lane] = radiance[0];
        out[1][lane] = radiance[1];
        out[2][lane] = radiance[2];
    }
}

/// Adds the radiance of one map and of the next one, each times a weight.
#[inline(always)]
pub(super) fn add_from_level<S: Simd>(
    simd: S,
    (blurred, level): (&Blurred, usize),
    towards: &[f32x16<S>; 3],
    [of_level, of_next]: [f32; 2],
    sums: &mut [f32x4<S>; LANES],
) {
    let (starts, sides) = (
        [blurred.starts[level]; LANES],
        [blurred.sides[level]; LANES],
    );
    let places = MapTaps::new(simd, (&starts, &sides), places_on_square(simd, towards));
    let (of_level, of_next) = (f32x4::splat(simd, of_level), f32x4::splat(simd, of_next));
    for (lane, sum) in sums.iter_mut().enumerate() {
        let place = (places.place[lane] as usize, places.stride[lane] as usize);
        let shares_of_texels = [places.right[lane], places.lower[lane]];
        let (near, far) = four(simd, &blurred.pairs, place, shares_of_texels).split();
        *sum = far.mul_add(of_next, near.mul_add(of_level, *sum));
    }
}

/// Where to look in one map each.
struct MapTaps {
    /// The upper left texel, and those from one row to the next.
    place: [i32; LANES],
    stride: [i32; LANES],
    /// Shares of the right and of the lower ones.
    right: Lanes,
    lower: Lanes,
}

impl MapTaps {
    #[inline(always)]
    fn new<S: Simd>(
        simd: S,
        (starts, sides): (&[i32; LANES], &Lanes),
        [x, y]: [f32x16<S>; 2],
    ) -> Self {
        let half = f32x16::splat(simd, 0.5);
        let side = f32x16::from_slice(simd, sides);
        let (x, y) = (x * side + half, y * side + half);
        let (column, row) = (x.floor().min(side), y.floor().min(side));
        let stride = side + f32x16::splat(simd, 2.0);
        let mut new = Self {
            place: [0; LANES],
            stride: [0; LANES],
            right: [0.0; LANES],
            lower: [0.0; LANES],
        };
        // Whole numbers below 2^24. A place that is no number is at the corner.
        let place: i32x16<S> = (row * stride + column).to_int_precise();
        (place + i32x16::from_slice(simd, starts)).store_slice(&mut new.place);
        let stride: i32x16<S> = stride.to_int_precise();
        stride.store_slice(&mut new.stride);
        (x - column).store_slice(&mut new.right);
        (y - row).store_slice(&mut new.lower);
        new
    }
}

/// The mix of two by two nodes of eight numbers each.
#[inline(always)]
pub(super) fn four<S: Simd>(
    simd: S,
    nodes: &[[f32; 8]],
    (place, stride): (usize, usize),
    [right, lower]: [f32; 2],
) -> f32x8<S> {
    let (top, low) = (
        &nodes[place..place + 2],
        &nodes[place + stride..place + stride + 2],
    );
    let down = f32x8::splat(simd, lower);
    let (a, b) = (
        f32x8::from_slice(simd, &top[0]),
        f32x8::from_slice(simd, &top[1]),
    );
    let (c, d) = (
        f32x8::from_slice(simd, &low[0]),
        f32x8::from_slice(simd, &low[1]),
    );
    let left_side = (c - a).mul_add(down, a);
    let right_side = (d - b).mul_add(down, b);
    (right_side - left_side).mul_add(f32x8::splat(simd, right), left_side)
}

/// Where a direction lies on the square, -1..=1 along both sides.
#[inline(always)]
pub(crate) fn square_from_direction(d: Vec3) -> [f32; 2] {
    let size = d.x.abs() + d.y.abs() + d.z.abs();
    let (x, z) = (d.x / size, d.z / size);
    if d.y >= 0.0 {
        [x, z]
    } else {
        [(1.0 - z.abs()).copysign(x), (1.0 - x.abs()).copysign(z)]
    }
}

/// The direction at a place of the square, in any length.
pub(crate) fn direction_from_square([x, z]: [f32; 2]) -> Vec3 {
    let y = 1.0 - x.abs() - z.abs();
    if y >= 0.0 {
        Vec3::new(x, y, z)
    } else {
        Vec3::new((1.0 - z.abs()).copysign(x), y, (1.0 - x.abs()).copysign(z))
    }
}

/// The direction at the centre of texel (x, y) of `side` times `side`.
pub(crate) fn direction_of_texel([x, y]: [usize; 2], side: usize) -> Vec3 {
    let place = |k: usize| (2 * k + 1) as f32 / side as f32 - 1.0;
    direction_from_square([place(x), place(y)])
}

/// The texel inside the square that continues it at (x, y), which may lie one texel outside.
pub(crate) fn folded([x, y]: [isize; 2], side: usize) -> [usize; 2] {
    let last = side as isize - 1;
    let (mut x, mut y) = (x, y);
    if x < 0 || x > last {
        (x, y) = (x.clamp(0, last), last - y);
    }
    if y < 0 || y > last {
        (x, y) = (last - x, y.clamp(0, last));
    }
    [x as usize, y as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_come_back() {
        for side in [2, 5, 16] {
            for at in 0..side * side {
                let texel = [at % side, at / side];
                let direction = direction_of_texel(texel, side);
                let [x, y] = square_from_direction(direction.normalize());
                let back = [x, y].map(|p| ((p + 1.0) * 0.5 * side as f32) as usize);
                assert_eq!(back, texel, "of {side}");
            }
        }
    }

    #[test]
    fn the_border_continues_on_the_sphere() {
        let side = 64;
        for k in 0..64_isize {
            for (outside, beside) in [
                ([-1, k], [0, k]),
                ([64, k], [63, k]),
                ([k, -1], [k, 0]),
                ([k, 64], [k, 63]),
            ] {
                let inside = direction_of_texel(beside.map(|at| at as usize), side).normalize();
                let next = direction_of_texel(folded(outside, side), side).normalize();
                assert!(
                    inside.dot(next) > 0.99,
                    "{outside:?} is far from {beside:?}: {inside} {next}"
                );
            }
        }
    }
}
