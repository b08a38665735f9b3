//! Shadows of small bright lights: they are too sharp for places on surfaces, so every pixel follows rays of its own.

use std::f32::consts::TAU;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::Vec3;

use crate::light::blocked::bvh::{Rays, Tree, Vector};
use crate::light::suns::Sun;
use crate::screen::LANES;

/// Rays to the disc of a light: the first, and all of them where the first disagree. With 16, steps of a half shadow are a sixteenth of its light.
const FIRST: usize = 4;
const ALL: usize = 16;

/// The share of a light that reaches places.
#[inline(always)]
pub(crate) fn sun_visible<S: Simd>(simd: S, tree: &Tree, sun: &Sun, from: Vector<S>) -> f32x16<S> {
    let splat = |x: f32| f32x16::splat(simd, x);
    let (side, up) = sun.direction.any_orthonormal_pair();
    let radius = (8.0 * sun.alpha2).sqrt();
    let mut sum = splat(0.0);
    for ray in 0..ALL {
        let towards = on_disc(ray, radius, (sun.direction, side, up));
        let mut light = [1.0; LANES];
        tree.block_in(simd, &Rays::new(simd, from, towards), &mut light);
        sum += f32x16::from_slice(simd, &light);
        if ray + 1 == FIRST {
            let mixed = sum.simd_gt(splat(0.01)) & sum.simd_lt(splat(FIRST as f32 - 0.01));
            if !mixed.any_true() {
                return sum * splat(1.0 / FIRST as f32);
            }
        }
    }
    sum * splat(1.0 / ALL as f32)
}

/// The direction towards a place on a disc: a spiral by the golden angle, whose first places are spread out, too.
fn on_disc(ray: usize, radius: f32, (middle, side, up): (Vec3, Vec3, Vec3)) -> Vec3 {
    const GOLDEN: f32 = 0.381_966;
    // Every fourth place of the spiral comes first.
    let place = ray % FIRST * (ALL / FIRST) + ray / FIRST;
    let away = radius * ((place as f32 + 0.5) / ALL as f32).sqrt();
    let (sin, cos) = (place as f32 * GOLDEN * TAU).sin_cos();
    middle + side * (away * cos) + up * (away * sin)
}
