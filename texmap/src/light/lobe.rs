//! Looks around that stand for the lobe of a rough surface, the suns beside them, and how much of both arrives.
//!
//! Sixteen places at a time, for every layer of a surface: the response to even light and the two looks of a lobe come from a table
//! (`reflectance`), the radiance from the blurred surroundings (`around`), small lights from their formula (`suns`), and where the scene blocks light,
//! what it lets through (`blocked`).

use std::f32::consts::PI;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

use crate::light::around::{LookUps, four, level_of_roughness, look_around};
use crate::light::blocked::BlockedLight;
use crate::light::blocked::look::PixelLights;
use crate::light::blocked::place::PlaceLight;
use crate::light::environment::Environment;
use crate::light::reflectance;
use crate::light::suns::{LitSurface, MOST, Sun};
use crate::screen::{LANES, Lanes};

/// The reflectance of a dielectric at normal incidence: an index of refraction of 1.5.
pub(crate) const DIELECTRIC: f32 = 0.04;

/// The smallest cosine between normal and eye: a normal map may turn a surface away.
pub(super) const LEAST_COSINE: f32 = 1e-3;

/// The light around a scene, and how much of it arrives where the scene blocks it.
#[derive(Clone, Copy)]
pub(crate) struct Surrounding<'a> {
    pub(crate) environment: &'a Environment,
    pub(crate) blocked: Option<&'a BlockedLight>,
}

/// Direction to the eye, mirrored at the normal; `cosine` is that of the angle between them.
#[inline(always)]
pub(super) fn mirrored_at<S: Simd>(
    [nx, ny, nz]: [f32x16<S>; 3],
    [vx, vy, vz]: [f32x16<S>; 3],
    cosine: f32x16<S>,
) -> [f32x16<S>; 3] {
    let twice = cosine + cosine;
    [nx * twice - vx, ny * twice - vy, nz * twice - vz]
}

/// Adds the light of the suns to a lobe of a weight, as far as its looks around lack them.
#[inline(always)]
pub(super) fn add_suns<S: Simd>(
    simd: S,
    (environment, shaded): (&Environment, &Shaded<S>),
    (met, looks, weight): (&LitSurface<S>, &LookedAt<S>, f32x16<S>),
    (f0, f90): (&[f32x16<S>; 3], f32x16<S>),
    mirror: &mut [f32x16<S>; 3],
) {
    let splat = |x: f32| f32x16::splat(simd, x);
    for (sun, visible) in environment.suns.iter().zip(&shaded.suns) {
        let [plain, fresnel] = met.lit_by(simd, sun);
        let share = looks.lack(simd, sun) * weight * *visible;
        for k in 0..3 {
            let light = splat(sun.power[k]) * share;
            mirror[k] += (f0[k] * (plain - fresnel) + f90 * fresnel) * light;
        }
    }
}

/// The normal and the mirrored eye.
pub(super) type Directions<S> = ([f32x16<S>; 3], [f32x16<S>; 3]);

/// The levels of two looks around.
pub(super) struct LookedAt<S: Simd> {
    levels: [f32x16<S>; 2],
    part_of_second: f32x16<S>,
}

impl<S: Simd> LookedAt<S> {
    /// The part of a sun that the blurred surroundings of these looks lack.
    #[inline(always)]
    fn lack(&self, simd: S, sun: &Sun) -> f32x16<S> {
        let splat = |x: f32| f32x16::splat(simd, x);
        let (zero, one, whole) = (splat(0.0), splat(1.0), splat((sun.first_level - 1) as f32));
        let first = (self.levels[0] - whole).max(zero).min(one);
        let second = (self.levels[1] - whole).max(zero).min(one);
        (second - first) * self.part_of_second + first
    }
}

/// The radiance that a lobe sees in two looks around.
#[inline(always)]
pub(super) fn seen_in_lobe<S: Simd>(
    simd: S,
    (environment, shaded): (&Environment, &Shaded<S>),
    ((normal, mirrored), even): (&Directions<S>, &EvenResponse),
    count: usize,
) -> ([f32x16<S>; 3], LookedAt<S>) {
    let zero = f32x16::splat(simd, 0.0);
    let mut seen = [[[0.0; LANES]; 3]; 2];
    let mut levels = [zero; 2];
    // No closure around what is called here: it would lose the vectors' instructions.
    for look in 0..2 {
        let turn = f32x16::from_slice(simd, &even.turn[look]);
        let towards = [
            normal[0] + (mirrored[0] - normal[0]) * turn,
            normal[1] + (mirrored[1] - normal[1]) * turn,
            normal[2] + (mirrored[2] - normal[2]) * turn,
        ];
        let roughness = f32x16::from_slice(simd, &even.lobe[look]);
        let at = LookUps::new(simd, &towards, roughness);
        look_around(simd, &environment.blurred, &at, count, &mut seen[look]);
        levels[look] = level_of_roughness(simd, roughness);
    }
    let second = f32x16::from_slice(simd, &even.part_of_second);
    let mut radiance = [zero; 3];
    for (k, sum) in radiance.iter_mut().enumerate() {
        let one = f32x16::from_slice(simd, &seen[0][k]);
        let other = f32x16::from_slice(simd, &seen[1][k]);
        *sum = ((other - one) * second + one) * shaded.lobe;
    }
    let looked = LookedAt {
        levels,
        part_of_second: second,
    };
    (radiance, looked)
}

/// Three numbers of each place.
#[inline(always)]
pub(super) fn load_3<S: Simd>(simd: S, lanes: &[Lanes; 3]) -> [f32x16<S>; 3] {
    [
        f32x16::from_slice(simd, &lanes[0]),
        f32x16::from_slice(simd, &lanes[1]),
        f32x16::from_slice(simd, &lanes[2]),
    ]
}

/// The light that the scene lets through to sixteen pixels.
pub(super) struct Shaded<'a, S: Simd> {
    /// Lights of places, where the scene blocks them, and those of the pixels.
    pixels: Option<(&'a [PlaceLight], &'a mut PixelLights)>,
    /// The share of each sun that arrives.
    pub(super) suns: [f32x16<S>; MOST],
    /// The share of the light in a lobe that arrives.
    lobe: f32x16<S>,
}

impl<'a, S: Simd> Shaded<'a, S> {
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        around: Surrounding<'a>,
        pixels: &'a mut PixelLights,
        count: usize,
    ) -> Self {
        let one = f32x16::splat(simd, 1.0);
        let mut new = Self {
            pixels: None,
            suns: [one; MOST],
            lobe: one,
        };
        let Some(blocked) = around.blocked.filter(|blocked| !blocked.lights.is_empty()) else {
            return new;
        };
        let suns = &around.environment.suns;
        pixels.find(simd, blocked, suns, count);
        for k in 0..suns.len().min(MOST) {
            new.suns[k] = pixels.sun(simd, k, count);
        }
        new.pixels = Some((&blocked.lights, pixels));
        new
    }

    /// Looks into a lobe, between both of its looks around.
    #[inline(always)]
    pub(super) fn look_into_lobe(
        &mut self,
        simd: S,
        (normal, mirrored): &Directions<S>,
        even: &EvenResponse,
        count: usize,
    ) {
        let Some((lights, pixels)) = &mut self.pixels else {
            return;
        };
        let second = f32x16::from_slice(simd, &even.part_of_second);
        let first_turn = f32x16::from_slice(simd, &even.turn[0]);
        let first_level = f32x16::from_slice(simd, &even.lobe[0]);
        let turn = (f32x16::from_slice(simd, &even.turn[1]) - first_turn) * second + first_turn;
        let level = (f32x16::from_slice(simd, &even.lobe[1]) - first_level) * second + first_level;
        let towards = [
            normal[0] + (mirrored[0] - normal[0]) * turn,
            normal[1] + (mirrored[1] - normal[1]) * turn,
            normal[2] + (mirrored[2] - normal[2]) * turn,
        ];
        let at = LookUps::new(simd, &towards, level);
        self.lobe = pixels.visible(simd, lights, &at, count);
    }

    /// The share of light that maps of occlusion let through, beside what the scene blocks already: they hold that, too.
    #[inline(always)]
    pub(super) fn open(
        &self,
        simd: S,
        (environment, open): (&Environment, f32x16<S>),
        (normal, variance): ([f32x16<S>; 3], f32x16<S>),
        even: &[f32x16<S>; 3],
    ) -> f32x16<S> {
        let one = f32x16::splat(simd, 1.0);
        if self.pixels.is_none() || !open.simd_lt(one).any_true() {
            return open;
        }
        let mut all = [f32x16::splat(simd, 0.0); 3];
        let basis = softened_basis(simd, normal, variance);
        sum_harmonics(simd, &basis, environment, &mut all);
        for sun in &environment.suns {
            let part = sun.mean_cosine(simd, &normal, variance);
            for (sum, power) in all.iter_mut().zip(sun.power.to_array()) {
                *sum += part * f32x16::splat(simd, power / PI);
            }
        }
        let least = f32x16::splat(simd, 1e-6);
        let arriving = (even[0] + even[1] + even[2]).max(least);
        let unblocked = (all[0] + all[1] + all[2]).max(least);
        (open * unblocked / arriving).min(one)
    }
}

/// The functions that irradiance is a sum of; normals that vary see less of its change.
#[inline(always)]
pub(super) fn softened_basis<S: Simd>(
    simd: S,
    [x, y, z]: [f32x16<S>; 3],
    variance: f32x16<S>,
) -> [f32x16<S>; 9] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (zero, one) = (splat(0.0), splat(1.0));
    let first = (one - splat(0.5) * variance).max(zero);
    let second = (one - splat(1.5) * variance).max(zero);
    [
        one,
        x * first,
        y * first,
        z * first,
        x * y * second,
        y * z * second,
        z * x * second,
        (splat(3.0) * y * y - one) * second,
        (z * z - x * x) * second,
    ]
}

/// Irradiance over pi.
#[inline(always)]
pub(super) fn irradiance<S: Simd>(
    simd: S,
    (environment, shaded): (&Environment, &Shaded<S>),
    (normal, variance): ([f32x16<S>; 3], f32x16<S>),
    count: usize,
    out: &mut [f32x16<S>; 3],
) {
    let zero = f32x16::splat(simd, 0.0);
    let basis = softened_basis(simd, normal, variance);
    if let Some((_, pixels)) = &shaded.pixels {
        let mut by_lane = [[0.0; LANES]; 9];
        for (function, lanes) in basis.iter().zip(&mut by_lane) {
            function.store_slice(lanes);
        }
        pixels.irradiance(simd, &by_lane, count, out);
    } else {
        sum_harmonics(simd, &basis, environment, out);
        for sum in out.iter_mut() {
            *sum = sum.max(zero);
        }
    }
    add_matt_suns(simd, (environment, shaded), (normal, variance), out);
}

/// Adds irradiance over pi of all light but the suns'.
#[inline(always)]
fn sum_harmonics<S: Simd>(
    simd: S,
    basis: &[f32x16<S>; 9],
    environment: &Environment,
    out: &mut [f32x16<S>; 3],
) {
    for (part, light) in basis.iter().zip(&environment.irradiance) {
        for (sum, light) in out.iter_mut().zip(light.to_array()) {
            *sum = part.mul_add(f32x16::splat(simd, light), *sum);
        }
    }
}

/// Adds irradiance over pi of the suns.
#[inline(always)]
fn add_matt_suns<S: Simd>(
    simd: S,
    (environment, shaded): (&Environment, &Shaded<S>),
    (normal, variance): ([f32x16<S>; 3], f32x16<S>),
    out: &mut [f32x16<S>; 3],
) {
    for (sun, visible) in environment.suns.iter().zip(&shaded.suns) {
        let part = sun.mean_cosine(simd, &normal, variance) * *visible;
        for (sum, power) in out.iter_mut().zip(sun.power.to_array()) {
            *sum += part * f32x16::splat(simd, power / PI);
        }
    }
}

/// The response of a surface to even light; see [`reflectance::Reflectance`].
#[derive(Default)]
pub(super) struct EvenResponse {
    pub(super) scale: Lanes,
    pub(super) offset: Lanes,
    part_of_second: Lanes,
    /// Of both looks.
    turn: [Lanes; 2],
    lobe: [Lanes; 2],
}

impl EvenResponse {
    /// Scale and offset: of even light f0 times the one and f90 times the other come back.
    #[inline(always)]
    pub(super) fn of_even_light<S: Simd>(&self, simd: S) -> (f32x16<S>, f32x16<S>) {
        let load = |lanes: &Lanes| f32x16::from_slice(simd, lanes);
        (load(&self.scale), load(&self.offset))
    }

    #[inline(always)]
    pub(super) fn look<S: Simd>(
        &mut self,
        simd: S,
        environment: &Environment,
        (roughness, cosine): (f32x16<S>, f32x16<S>),
        count: usize,
    ) {
        let last = f32x16::splat(simd, (reflectance::SIDE - 1) as f32);
        let (mut columns, mut rows) = ([0.0; LANES], [0.0; LANES]);
        (cosine * last).store_slice(&mut columns);
        (roughness * last).store_slice(&mut rows);
        for lane in 0..count {
            let last = reflectance::SIDE - 2;
            let column = (columns[lane] as usize).min(last);
            let row = (rows[lane] as usize).min(last);
            let share = [columns[lane] - column as f32, rows[lane] - row as f32];
            let place = row * reflectance::SIDE + column;
            let at = (place, reflectance::SIDE);
            let even = four(simd, &environment.reflectance.table, at, share);
            self.scale[lane] = even[0];
            self.offset[lane] = even[1];
            self.part_of_second[lane] = even[2];
            for look in 0..2 {
                self.turn[look][lane] = even[3 + 2 * look];
                self.lobe[look][lane] = even[4 + 2 * look];
            }
        }
    }
}
