//! Small bright lights of the surroundings: found in their picture and taken out of it.
//!
//! Seen at an angle, the lobe of a rough surface is long in the plane of incidence and narrow across. Blurred surroundings have round lobes, in
//! which a light that is smaller than the lobe keeps as little as a sixth of its highlight. So such lights are points with an area, and what a
//! surface reflects of them is the model's own formula.
//!
//! A light is what lies within [`CORE_RAD`] of the brightest pixel, above what lies around it; it counts where it holds a part of all
//! light and is small and much brighter than what is around. Limits: [`MOST`] lights; larger ones stay in the picture.

use std::f32::consts::{PI, TAU};

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::Vec3;
use resample_mesh::scene::Surroundings;

/// A small bright light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sun {
    /// Towards it, of length 1.
    pub(crate) direction: Vec3,
    /// Radiance above what lies around, summed over the solid angle.
    pub(crate) power: Vec3,
    /// The sun's contribution to the square of a lobe's width (alpha): a disc's variance is a quarter of its radius squared along each axis, a
    /// half vector turns by half of that angle, and alpha squared is twice the variance of half vectors.
    pub(crate) alpha2: f32,
}

/// Half the angle of the part of the sky that may be a light, and of the ring around it that is not.
const CORE_RAD: f32 = 0.045;
const RING_RAD: f32 = 0.08;

/// Largest radius of a light: the lobes from which it is taken out are four times as wide. A guess.
const LARGEST_RAD: f32 = 0.03;

/// Least part of all light, and least ratio of brightness to what is around. Guesses: below, nobody misses a highlight.
const LEAST_PART: f32 = 0.01;
const LEAST_CONTRAST: f32 = 8.0;

/// Most lights: each is a formula a pixel.
const MOST: usize = 4;

/// Takes lights out of a picture; gives them and what is left, or nothing where there are none.
pub(crate) fn taken_out(picture: &Surroundings) -> Option<(Vec<Sun>, Surroundings)> {
    let mut rest: Option<Surroundings> = None;
    let mut suns = Vec::new();
    while suns.len() < MOST {
        let from = rest.as_ref().unwrap_or(picture);
        let Some((sun, around, core)) = brightest(from) else {
            break;
        };
        let left = rest.get_or_insert_with(|| picture.clone());
        for at in core {
            left.rgb[at] = around.to_array();
        }
        suns.push(sun);
    }
    Some((suns, rest?))
}

/// The brightest light, what is around it, and its pixels.
fn brightest(picture: &Surroundings) -> Option<(Sun, Vec3, Vec<usize>)> {
    let (width, height) = (picture.width, picture.height);
    let solid = |row: usize| {
        (TAU / width as f32)
            * (PI / height as f32)
            * ((row as f32 + 0.5) / height as f32 * PI).sin()
    };
    let bright = |rgb: &[f32; 3]| rgb[0] + rgb[1] + rgb[2];
    let (mut peak, mut most, mut whole) = (0, 0.0, 0.0f64);
    for (row, pixels) in picture.rgb.chunks_exact(width).enumerate() {
        let mut sum = 0.0f64;
        for (column, pixel) in pixels.iter().enumerate() {
            let light = bright(pixel);
            sum += f64::from(light);
            if light > most {
                (peak, most) = (row * width + column, light);
            }
        }
        whole += sum * f64::from(solid(row));
    }
    let middle = direction(picture, peak);
    let reach = (RING_RAD / PI * height as f32).ceil() as usize + 1;
    let rows = (peak / width).saturating_sub(reach)..(peak / width + reach + 1).min(height);
    let (mut core, mut ring, mut ring_solid) = (Vec::new(), Vec3::ZERO, 0.0);
    for at in rows.start * width..rows.end * width {
        let away = direction(picture, at).distance(middle);
        if away < CORE_RAD {
            core.push(at);
        } else if away < RING_RAD {
            ring += Vec3::from(picture.rgb[at]) * solid(at / width);
            ring_solid += solid(at / width);
        }
    }
    let around = ring / ring_solid.max(f32::MIN_POSITIVE);
    let (mut power, mut centre, mut core_solid) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    let above = |at: usize| (Vec3::from(picture.rgb[at]) - around).max(Vec3::ZERO);
    for &at in &core {
        let light = above(at) * solid(at / width);
        power += light;
        centre += direction(picture, at) * light.element_sum();
        core_solid += solid(at / width);
    }
    let total = power.element_sum();
    let centre = centre.try_normalize()?;
    let mean2 = core.iter().map(|&at| {
        above(at).element_sum()
            * solid(at / width)
            * direction(picture, at).distance_squared(centre)
    });
    // Of a disc it is half of its radius squared.
    let radius2 = 2.0 * mean2.sum::<f32>() / total;
    // Pixels of a coarse picture are larger than a light may be.
    let core_area = PI * CORE_RAD * CORE_RAD;
    let ring_area = PI * RING_RAD * RING_RAD - core_area;
    let is_resolved = core_solid > 0.5 * core_area && ring_solid > 0.5 * ring_area;
    let is_light = is_resolved
        && f64::from(total) > f64::from(LEAST_PART) * whole
        && radius2 < LARGEST_RAD * LARGEST_RAD
        && total > LEAST_CONTRAST * around.element_sum() * core_solid;
    let sun = Sun {
        direction: centre,
        power,
        alpha2: radius2 / 8.0,
    };
    is_light.then_some((sun, around, core))
}

/// Towards the centre of a pixel: the picture's middle lies towards -z.
fn direction(picture: &Surroundings, at: usize) -> Vec3 {
    let (x, y) = (at % picture.width, at / picture.width);
    let across = ((x as f32 + 0.5) / picture.width as f32 - 0.5) * TAU;
    let (sin, cos) = ((y as f32 + 0.5) / picture.height as f32 * PI).sin_cos();
    Vec3::new(sin * across.sin(), cos, -sin * across.cos())
}

/// Surfaces as a small light meets them.
pub(super) struct Met<S: Simd> {
    pub(super) normal: [f32x16<S>; 3],
    pub(super) eye: [f32x16<S>; 3],
    /// Between the two.
    pub(super) cosine: f32x16<S>,
    pub(super) roughness: f32x16<S>,
    /// Mean square of the distance of normals from their mean.
    pub(super) variance: f32x16<S>,
}

impl<S: Simd> Met<S> {
    /// The share of a light's power that a surface of reflectance 1 returns, and the part of it that Schlick's term weighs.
    #[inline(always)]
    pub(super) fn lit_by(&self, simd: S, sun: &Sun) -> [f32x16<S>; 2] {
        let splat = |v: f32| f32x16::splat(simd, v);
        let (zero, one, least) = (splat(0.0), splat(1.0), splat(1e-7));
        let light = sun.direction.to_array().map(splat);
        let dot = |a: &[f32x16<S>; 3], b: &[f32x16<S>; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let half = [0, 1, 2].map(|k: usize| self.eye[k] + light[k]);
        let per_length = one / dot(&half, &half).sqrt().max(least);
        let to_light = dot(&self.normal, &light).max(zero);
        let to_half = (dot(&self.normal, &half) * per_length).max(zero).min(one);
        let tilt = (dot(&self.eye, &half) * per_length).max(zero).min(one);
        let alpha = self.roughness * self.roughness;
        // Slopes of normals add to those of facets; alpha squared is the sum of the variances along both axes.
        let alpha2 = (alpha * alpha + self.variance + splat(sun.alpha2)).min(one);
        let spread = one + to_half * to_half * (alpha2 - one);
        let dense = alpha2 / (spread * spread * splat(PI)).max(least);
        let smith = |a: f32x16<S>, b: f32x16<S>| a * (b * b * (one - alpha2) + alpha2).sqrt();
        let blocked = smith(to_light, self.cosine) + smith(self.cosine, to_light);
        let plain = dense * to_light * splat(0.5) / blocked.max(least);
        let away = one - tilt;
        let away2 = away * away;
        [plain, plain * away2 * away2 * away]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(lights: &[(Vec3, f32, f32)]) -> Surroundings {
        let mut sky = Surroundings {
            width: 720,
            height: 360,
            rgb: vec![[0.5; 3]; 720 * 360],
        };
        for at in 0..sky.rgb.len() {
            let d = direction(&sky, at);
            for &(towards, radius, light) in lights {
                if d.distance(towards.normalize()) < radius {
                    sky.rgb[at] = [light; 3];
                }
            }
        }
        sky
    }

    #[test]
    fn small_bright_lights_are_taken_out_and_large_or_dim_ones_stay() {
        let (first, second) = (Vec3::new(0.3, 0.8, 0.2), Vec3::new(-1.0, 0.1, 0.4));
        let found = taken_out(&sky(&[(first, 0.01, 4000.0), (second, 0.015, 900.0)]));
        let (suns, rest) = found.expect("two lights");
        assert_eq!(suns.len(), 2);
        assert!(suns[0].direction.distance(first.normalize()) < 1e-3);
        let disc = PI * 0.01 * 0.01 * 4000.0;
        let power = suns[0].power.x;
        assert!((power / disc - 1.0).abs() < 0.1, "{power} of {disc}");
        assert!(rest.rgb.iter().all(|pixel| pixel[0] < 0.6), "an even sky");
        assert!(
            taken_out(&sky(&[(first, 0.2, 4000.0)])).is_none(),
            "a large lamp"
        );
        assert!(
            taken_out(&sky(&[(first, 0.01, 2.0)])).is_none(),
            "a dim one"
        );
        assert!(taken_out(&sky(&[])).is_none(), "an even sky");
    }
}
