//! Looks at the blurred surroundings, sixteen at a time.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, i32x16};
use glam::Vec4;

use super::environment::{Environment, LEVELS, Map};
use crate::screen::lanes::{LANES, Lanes};

/// Where to look.
pub(super) struct Looks {
    /// On the octahedral square, 0..=1.
    x: [f32; LANES],
    y: [f32; LANES],
    /// Level of roughness.
    level: [f32; LANES],
}

impl Looks {
    #[inline(always)]
    pub(super) fn new<S: Simd>(
        simd: S,
        [dx, dy, dz]: &[f32x16<S>; 3],
        roughness: f32x16<S>,
    ) -> Self {
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
        let mut looks = Self {
            x: [0.0; LANES],
            y: [0.0; LANES],
            level: [0.0; LANES],
        };
        (across * half + half).store_slice(&mut looks.x);
        (down * half + half).store_slice(&mut looks.y);
        (roughness * splat((LEVELS - 1) as f32)).store_slice(&mut looks.level);
        looks
    }
}

/// The radiance of the environment.
#[inline(always)]
pub(super) fn look_around<S: Simd>(
    simd: S,
    environment: &Environment,
    at: &Looks,
    count: usize,
    out: &mut [[f32; LANES]; 3],
) {
    let level = f32x16::from_slice(simd, &at.level);
    let first = level.floor().min(f32x16::splat(simd, (LEVELS - 2) as f32));
    let mut shares = [0.0; LANES];
    (level - first).store_slice(&mut shares);
    let levels: i32x16<S> = first.to_int_precise();
    let mut maps = [[&environment.levels[0]; LANES]; 2];
    let mut sides = [[0.0; LANES]; 2];
    for lane in 0..LANES {
        let pair = &environment.levels[levels[lane] as usize..][..2];
        for k in 0..2 {
            maps[k][lane] = &pair[k];
            sides[k][lane] = pair[k].side as f32;
        }
    }
    let fine = InMaps::new(simd, &sides[0], at);
    let coarse = InMaps::new(simd, &sides[1], at);
    for lane in 0..count {
        let near = fine.look(simd, maps[0][lane], lane);
        let far = coarse.look(simd, maps[1][lane], lane);
        let radiance = (far - near).mul_add(f32x4::splat(simd, shares[lane]), near);
        out[0][lane] = radiance[0];
        out[1][lane] = radiance[1];
        out[2][lane] = radiance[2];
    }
}

/// Where to look in one map each.
struct InMaps {
    /// The upper left texel.
    place: [i32; LANES],
    /// Shares of the right and of the lower ones.
    right: Lanes,
    lower: Lanes,
}

impl InMaps {
    #[inline(always)]
    fn new<S: Simd>(simd: S, sides: &Lanes, at: &Looks) -> Self {
        let half = f32x16::splat(simd, 0.5);
        let side = f32x16::from_slice(simd, sides);
        let x = f32x16::from_slice(simd, &at.x) * side + half;
        let y = f32x16::from_slice(simd, &at.y) * side + half;
        let (column, row) = (x.floor().min(side), y.floor().min(side));
        let stride = side + f32x16::splat(simd, 2.0);
        let mut new = Self {
            place: [0; LANES],
            right: [0.0; LANES],
            lower: [0.0; LANES],
        };
        // Whole numbers below 2^24. A place that is no number is at the corner.
        let place: i32x16<S> = (row * stride + column).to_int_precise();
        place.store_slice(&mut new.place);
        (x - column).store_slice(&mut new.right);
        (y - row).store_slice(&mut new.lower);
        new
    }

    #[inline(always)]
    fn look<S: Simd>(&self, simd: S, map: &Map, lane: usize) -> f32x4<S> {
        let place = (self.place[lane] as usize, map.side + 2);
        four(
            simd,
            &map.texels,
            place,
            [self.right[lane], self.lower[lane]],
        )
    }
}

/// The mix of two by two texels.
#[inline(always)]
pub(super) fn four<S: Simd>(
    simd: S,
    texels: &[Vec4],
    (place, stride): (usize, usize),
    [right, lower]: [f32; 2],
) -> f32x4<S> {
    let (top, low) = (
        &texels[place..place + 2],
        &texels[place + stride..place + stride + 2],
    );
    let texel = |texel: &Vec4| f32x4::simd_from(simd, texel.to_array());
    let down = f32x4::splat(simd, lower);
    let left_side = (texel(&low[0]) - texel(&top[0])).mul_add(down, texel(&top[0]));
    let right_side = (texel(&low[1]) - texel(&top[1])).mul_add(down, texel(&top[1]));
    (right_side - left_side).mul_add(f32x4::splat(simd, right), left_side)
}
