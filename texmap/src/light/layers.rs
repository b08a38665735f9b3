//! Layers above metal and paint, a clear coat and fibres; and the light that passes through paint instead of scattering.
//!
//! A coat is a smooth or rough dielectric with an index of refraction of 1.5, and dims the light of the surface below by its own reflectance (glTF,
//! `KHR_materials_clearcoat`). Fibres reflect by Charlie's distribution with the shadowing of Estevez and Kulla (2017), and dim what lies below by
//! what they reflect of even light (`KHR_materials_sheen`). Suns are lit by the formulas; other light on fibres is taken as even as it
//! is on a matt surface, for their lobe is as wide.
//!
//! Takes what a surface reflects without layers; gives it with them. Limits: emitted light is not dimmed.

use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::Vec3;

use crate::light::environment::Environment;
use crate::light::lobe::{
    DIELECTRIC, EvenResponse, LEAST_COSINE, Shaded, add_suns, load_3, mirrored_at, seen_in_lobe,
};
use crate::light::suns::LitSurface;
use crate::screen::{LANES, Lanes};

/// Layers as light meets them; where a place has none, they are as those of any dielectric.
#[derive(Clone, Copy)]
pub(crate) struct LayerInputs {
    /// False if no place has any.
    pub(crate) used: bool,
    /// The reflectance of the dielectric along the normal.
    pub(crate) dielectric: [Lanes; 3],
    /// As much of its reflection counts; at grazing angles it is all that is reflected.
    pub(crate) specular: Lanes,
    /// How much of a place a coat covers.
    pub(crate) coat: Lanes,
    /// Perceptual roughness.
    pub(crate) coat_roughness: Lanes,
    /// Of length 1, in the world.
    pub(crate) coat_normal: [Lanes; 3],
    /// Mean square of the distance of its normals from their mean.
    pub(crate) coat_variance: Lanes,
    /// Colour of fibres.
    pub(crate) sheen: [Lanes; 3],
    /// Perceptual roughness.
    pub(crate) sheen_roughness: Lanes,
    /// How much of the light that is not reflected passes through.
    pub(crate) glass: Lanes,
    /// The share of it that is left after the body: red, green, blue.
    pub(crate) left: [Lanes; 3],
    /// Given back: the share of the light behind that is seen through a place.
    pub(crate) through: [Lanes; 3],
}

impl Default for LayerInputs {
    fn default() -> Self {
        let none = [0.0; LANES];
        Self {
            used: false,
            dielectric: [[DIELECTRIC; LANES]; 3],
            specular: [1.0; LANES],
            coat: none,
            coat_roughness: none,
            coat_normal: [none; 3],
            coat_variance: none,
            sheen: [none; 3],
            sheen_roughness: none,
            glass: none,
            left: [[1.0; LANES]; 3],
            through: [none; 3],
        }
    }
}

impl LayerInputs {
    /// The reflectance of paint along the normal, and at grazing angles.
    #[inline(always)]
    pub(super) fn paint<S: Simd>(&self, simd: S) -> ([f32x16<S>; 3], f32x16<S>) {
        let specular = f32x16::from_slice(simd, &self.specular);
        (load_3(simd, &self.dielectric), specular)
    }
}

/// A place below its layers.
pub(super) struct SeenByLayers<'a, S: Simd> {
    pub(super) layers: &'a LayerInputs,
    pub(super) normal: [f32x16<S>; 3],
    pub(super) eye: [f32x16<S>; 3],
    /// Between the two.
    pub(super) cosine: f32x16<S>,
    /// Share of light that arrives.
    pub(super) open: f32x16<S>,
    /// Irradiance over pi.
    pub(super) even: [f32x16<S>; 3],
}

impl<S: Simd> SeenByLayers<'_, S> {
    /// Dims what is reflected below and what passes through, and adds what the layers reflect.
    #[inline(always)]
    pub(super) fn add(
        &self,
        simd: S,
        light: (&Environment, &Shaded<S>),
        count: usize,
        (mirror, through): (&mut [f32x16<S>; 3], &mut [f32x16<S>; 3]),
    ) {
        let any = |lanes: &Lanes| lanes[..count].iter().any(|&part| part > 0.0);
        if self.layers.sheen.iter().any(any) {
            let below = self.add_sheen(simd, light, count, mirror);
            (0..3).for_each(|k| through[k] *= below);
        }
        if any(&self.layers.coat) {
            let below = self.add_coat(simd, light, count, mirror);
            (0..3).for_each(|k| through[k] *= below);
        }
        let left = load_3(simd, &self.layers.left);
        (0..3).for_each(|k| through[k] *= left[k]);
    }

    /// Gives how much of the light below is left.
    #[inline(always)]
    fn add_coat(
        &self,
        simd: S,
        (environment, shaded): (&Environment, &Shaded<S>),
        count: usize,
        mirror: &mut [f32x16<S>; 3],
    ) -> f32x16<S> {
        let splat = |x: f32| f32x16::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let load = |lanes: &Lanes| f32x16::from_slice(simd, lanes);
        let [nx, ny, nz] = load_3(simd, &self.layers.coat_normal);
        let [vx, vy, vz] = self.eye;
        let cosine = nx * vx + ny * vy + nz * vz;
        let mirrored = mirrored_at([nx, ny, nz], [vx, vy, vz], cosine);
        let cosine = cosine.max(splat(LEAST_COSINE)).min(one);
        let roughness = load(&self.layers.coat_roughness);
        let variance = load(&self.layers.coat_variance);
        let widened = environment.reflectance.widened(simd, roughness, variance);
        let amount = load(&self.layers.coat);
        let mut even = EvenResponse::default();
        even.look(simd, environment, (widened, cosine), count);
        let (scale, offset) = even.of_even_light(simd);
        let directions = ([nx, ny, nz], mirrored);
        let (seen, looks) = seen_in_lobe(simd, (environment, shaded), (&directions, &even), count);
        let met = LitSurface {
            normal: [nx, ny, nz],
            eye: self.eye,
            cosine,
            roughness,
            variance,
        };
        let f0 = splat(DIELECTRIC);
        let mut of_suns = [zero; 3];
        add_suns(
            simd,
            (environment, shaded),
            (&met, &looks, f32x16::splat(simd, 1.0)),
            (&[f0; 3], one),
            &mut of_suns,
        );
        let away = one - cosine;
        let away2 = away * away;
        let fresnel = f0 + (one - f0) * away2 * away2 * away;
        let below = one - amount * fresnel;
        let of_even = f0 * scale + offset;
        for k in 0..3 {
            let of_coat = of_even * seen[k] + of_suns[k];
            mirror[k] = mirror[k] * below + of_coat * amount * self.open;
        }
        below
    }

    /// Gives how much of the light below is left.
    #[inline(always)]
    fn add_sheen(
        &self,
        simd: S,
        (environment, shaded): (&Environment, &Shaded<S>),
        count: usize,
        mirror: &mut [f32x16<S>; 3],
    ) -> f32x16<S> {
        let splat = |x: f32| f32x16::splat(simd, x);
        let one = splat(1.0);
        let colour = load_3(simd, &self.layers.sheen);
        let mut cosines = [0.0; LANES];
        self.cosine.store_slice(&mut cosines);
        let mut albedo = [0.0; LANES];
        for lane in 0..count {
            albedo[lane] = sheen_albedo(cosines[lane], self.layers.sheen_roughness[lane]);
        }
        let of_even = f32x16::from_slice(simd, &albedo);
        let most = colour[0].max(colour[1]).max(colour[2]);
        let below = one - most * of_even;
        let mut light = [0, 1, 2].map(|k: usize| self.even[k] * of_even);
        for (sun, visible) in environment.suns.iter().zip(&shaded.suns) {
            let more = self.more_of_sun(simd, sun.direction, of_even, count) * *visible;
            for (sum, power) in light.iter_mut().zip(sun.power.to_array()) {
                *sum += more * splat(power);
            }
        }
        for k in 0..3 {
            mirror[k] = mirror[k] * below + colour[k] * light[k] * self.open;
        }
        below
    }

    /// The share of a sun's power that fibres send to the eye, beyond that which they send of it as of even light.
    #[inline(always)]
    fn more_of_sun(&self, simd: S, sun: Vec3, of_even: f32x16<S>, count: usize) -> f32x16<S> {
        let (mut normal, mut eye) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for k in 0..3 {
            self.normal[k].store_slice(&mut normal[k]);
            self.eye[k].store_slice(&mut eye[k]);
        }
        let mut of_even_by_lane = [0.0; LANES];
        of_even.store_slice(&mut of_even_by_lane);
        let mut more = [0.0; LANES];
        for lane in 0..count {
            let of = |lanes: &[Lanes; 3]| Vec3::from([0, 1, 2].map(|k: usize| lanes[k][lane]));
            let (normal, eye) = (of(&normal), of(&eye));
            let to_light = normal.dot(sun);
            if to_light <= 0.0 {
                continue;
            }
            let to_eye = normal.dot(eye).max(LEAST_COSINE);
            let half = (eye + sun).normalize_or_zero();
            let by_formula = charlie(
                normal.dot(half),
                (to_light, to_eye),
                self.layers.sheen_roughness[lane],
            );
            more[lane] = (by_formula - of_even_by_lane[lane] / PI) * to_light;
        }
        f32x16::from_slice(simd, &more)
    }
}

/// The least roughness of fibres: below, they reflect nothing but at grazing angles. A guess.
const LEAST_ROUGHNESS: f32 = 0.07;

/// The share of radiance that fibres of colour 1 send from light to eye, by the cosines of the normal with the half vector, with the light and
/// with the eye.
fn charlie(to_half: f32, (to_light, to_eye): (f32, f32), roughness: f32) -> f32 {
    let alpha = roughness.max(LEAST_ROUGHNESS).powi(2);
    let sine2 = (1.0 - to_half * to_half).max(0.0);
    let dense = (2.0 + 1.0 / alpha) * sine2.powf(0.5 / alpha) / TAU;
    let blocked = 1.0 + shadowing(to_light, alpha) + shadowing(to_eye, alpha);
    (dense / (4.0 * to_light * to_eye * blocked)).clamp(0.0, MOST)
}

/// Most of a ratio whose denominator may be 0.
const MOST: f32 = 1e4;

/// The fit of Estevez and Kulla (2017), of the shadowing of fibres.
fn shadowing(cosine: f32, alpha: f32) -> f32 {
    // From their table: the numbers of smooth fibres and of rough ones.
    const SMOOTH: [f32; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
    const ROUGH: [f32; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
    let part = (1.0 - alpha).powi(2);
    let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|k: usize| ROUGH[k] + (SMOOTH[k] - ROUGH[k]) * part);
    let fit = |x: f32| a / (1.0 + b * x.powf(c)) + d * x + e;
    if cosine < 0.5 {
        fit(cosine).exp()
    } else {
        (2.0 * fit(0.5) - fit(1.0 - cosine)).exp()
    }
}

/// Nodes along each side.
const SIDE: usize = 32;

/// The share of even light that fibres of colour 1 reflect: by roughness, then by the cosine with the eye.
static ALBEDO: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let share = |k: usize| k as f32 / (SIDE - 1) as f32;
    (0..SIDE * SIDE)
        .map(|node| albedo(share(node % SIDE), share(node / SIDE)))
        .collect()
});

/// The mean over directions of light, on a lattice that is dense where light grazes.
fn albedo(cosine: f32, roughness: f32) -> f32 {
    let to_eye = cosine.max(LEAST_COSINE);
    let eye = Vec3::new((1.0 - to_eye * to_eye).sqrt(), 0.0, to_eye);
    // Enough for 1e-3, as the tests say.
    let (rows, columns) = (32, 64);
    let mut sum = 0.0;
    for k in 0..rows * columns {
        let part = ((k / columns) as f32 + 0.5) / rows as f32;
        // Half of the circle stands for the other.
        let turn = ((k % columns) as f32 + 0.5) / columns as f32 * PI;
        let to_light = part * part;
        let sine = (1.0 - to_light * to_light).max(0.0).sqrt();
        let light = Vec3::new(sine * turn.cos(), sine * turn.sin(), to_light);
        let half = (eye + light).normalize_or_zero();
        sum += charlie(half.z, (to_light, to_eye), roughness) * to_light * 2.0 * part;
    }
    (sum * TAU / (rows * columns) as f32).min(1.0)
}

/// The share of even light that fibres reflect, bilinear.
fn sheen_albedo(cosine: f32, roughness: f32) -> f32 {
    let last = (SIDE - 1) as f32;
    let [row, column] = [roughness, cosine].map(|at| at.clamp(0.0, 1.0) * last);
    let first = |at: f32| (at as usize).min(SIDE - 2);
    let (i, j) = (first(row), first(column));
    let (down, right) = (row - i as f32, column - j as f32);
    let table = &**ALBEDO;
    let across = |i: usize| {
        let at = i * SIDE + j;
        table[at] + (table[at + 1] - table[at]) * right
    };
    across(i) + (across(i + 1) - across(i)) * down
}
