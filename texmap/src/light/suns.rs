//! Small bright lights of the surroundings: found in their picture and taken out of it.
//!
//! Seen at an angle, the lobe of a rough surface is long in the plane of incidence and narrow across. Blurred surroundings have round lobes, in
//! which a light that is smaller than the lobe keeps as little as a sixth of its highlight. So such lights are points with an area, and what a
//! surface reflects of them is the model's own formula.
//!
//! A light is what lies within [`CORE_RAD`] of the middle of a bright spot, above what lies around it. The smaller it is, the more of all light it
//! holds and the brighter it is than what is around, the more of it is taken out: all or nothing would make a picture jump when a
//! light changes a little. Limits: [`MOST`] lights; larger ones stay in the picture.

use std::borrow::Cow;
use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::Vec3;
use resample_mesh::scene::Surroundings;

use crate::screen::LANES;

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

/// Radii between which a light becomes too large: the lobes from which it is taken out are four times as wide. A guess.
const LARGE_RAD: [f32; 2] = [0.02, 0.03];

/// Parts of all light, and ratios of brightness to what is around, between which a light begins to count. Guesses: below, nobody
/// misses a highlight.
const PART: [f32; 2] = [0.01, 0.02];
const CONTRAST: [f32; 2] = [8.0, 16.0];

/// Most lights: each is a formula a pixel.
pub(crate) const MOST: usize = 4;

/// Most bright spots that are looked at. A guess.
const MOST_SPOTS: usize = 24;

/// A bright spot of a picture, if it is a light.
struct Spot {
    sun: Sun,
    around: Vec3,
    /// Pixels, and how much of them is taken out.
    core: Vec<usize>,
    share: f32,
}

impl Spot {
    fn strength(&self) -> f32 {
        self.sun.power.element_sum() * self.share
    }

    fn take_out(&self, rgb: &mut [[f32; 3]]) {
        for &at in &self.core {
            rgb[at] = Vec3::from(rgb[at]).lerp(self.around, self.share).to_array();
        }
    }
}

/// Takes lights out of a picture; gives them and what is left, or nothing where there are none.
pub(crate) fn extract_suns(picture: &Surroundings) -> Option<(Vec<Sun>, Surroundings)> {
    let mut spots = spots(picture);
    let strength_order = |a: &Spot, b: &Spot| b.strength().total_cmp(&a.strength());
    spots.sort_by(strength_order);
    // Where there are more, each counts by how much stronger it is than the first that has no place: two that change
    // places are both left in the picture.
    if let Some(first_out) = spots.get(MOST).map(Spot::strength) {
        spots.truncate(MOST);
        for spot in &mut spots {
            spot.share *= (spot.strength() / first_out - 1.0).clamp(0.0, 1.0);
        }
    }
    spots.retain(|spot| spot.share > 0.0);
    let mut rest = (!spots.is_empty()).then(|| picture.clone())?;
    for spot in &spots {
        spot.take_out(&mut rest.rgb);
    }
    let suns = spots.iter().map(|spot| Sun {
        power: spot.sun.power * spot.share,
        ..spot.sun
    });
    Some((suns.collect(), rest))
}

/// The lights among the brightest spots of a picture, one more than have a place.
fn spots(picture: &Surroundings) -> Vec<Spot> {
    let whole = total_light(picture);
    let mut rest = Cow::Borrowed(picture);
    let mut looked_at = vec![false; picture.rgb.len()];
    let mut spots = Vec::new();
    for _ in 0..MOST_SPOTS {
        if spots.len() > MOST {
            break;
        }
        let mut peak = None;
        let mut most = 0.0;
        for (at, pixel) in rest.rgb.iter().enumerate() {
            if bright(pixel) > most && !looked_at[at] {
                (peak, most) = (Some(at), bright(pixel));
            }
        }
        let Some(peak) = peak else { break };
        // No spot that is as bright at most can hold enough light.
        if f64::from(most * PI * CORE_RAD * CORE_RAD) < f64::from(PART[0]) * whole {
            break;
        }
        match spot(&rest, peak, whole) {
            Some(spot) => {
                spot.core.iter().for_each(|&at| looked_at[at] = true);
                spot.take_out(&mut rest.to_mut().rgb);
                spots.push(spot);
            }
            None => leave_aside(&rest, peak, &mut looked_at),
        }
    }
    spots
}

/// Marks what is connected with a pixel and at least half as bright.
fn leave_aside(picture: &Surroundings, from: usize, looked_at: &mut [bool]) {
    let (width, height) = (picture.width, picture.height);
    let least = 0.5 * bright(&picture.rgb[from]);
    let mut open = vec![from];
    looked_at[from] = true;
    while let Some(at) = open.pop() {
        let (x, y) = (at % width, at / width);
        let beside = [
            y * width + (x + 1) % width,
            y * width + (x + width - 1) % width,
            y.saturating_sub(1) * width + x,
            (y + 1).min(height - 1) * width + x,
        ];
        for next in beside {
            if !looked_at[next] && bright(&picture.rgb[next]) >= least {
                looked_at[next] = true;
                open.push(next);
            }
        }
    }
}

fn bright([r, g, b]: &[f32; 3]) -> f32 {
    r + g + b
}

/// Solid angle of a pixel in a row.
fn solid(picture: &Surroundings, row: usize) -> f32 {
    let (width, height) = (picture.width as f32, picture.height as f32);
    (TAU / width) * (PI / height) * ((row as f32 + 0.5) / height * PI).sin()
}

/// All light.
fn total_light(picture: &Surroundings) -> f64 {
    let rows = picture.rgb.chunks_exact(picture.width).enumerate();
    rows.map(|(row, pixels)| {
        let sum: f64 = pixels.iter().map(|pixel| f64::from(bright(pixel))).sum();
        sum * f64::from(solid(picture, row))
    })
    .sum()
}

/// The light around a pixel, above what lies around it.
struct Core {
    pixels: Vec<usize>,
    around: Vec3,
    power: Vec3,
    /// Towards its middle.
    middle: Vec3,
    solid: f32,
    is_resolved: bool,
}

impl Core {
    fn new(picture: &Surroundings, middle: Vec3) -> Option<Self> {
        let (width, height) = (picture.width, picture.height);
        let row = (middle.y.clamp(-1.0, 1.0).acos() / PI * height as f32) as usize;
        let reach = (RING_RAD / PI * height as f32).ceil() as usize + 1;
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(height);
        let (mut pixels, mut ring, mut ring_solid) = (Vec::new(), Vec3::ZERO, 0.0);
        for at in rows.start * width..rows.end * width {
            let away = direction(picture, at).distance(middle);
            let solid = solid(picture, at / width);
            if away < CORE_RAD {
                pixels.push(at);
            } else if away < RING_RAD {
                ring += Vec3::from(picture.rgb[at]) * solid;
                ring_solid += solid;
            }
        }
        let mut core = Self {
            around: ring / ring_solid.max(f32::MIN_POSITIVE),
            pixels,
            power: Vec3::ZERO,
            middle: Vec3::ZERO,
            solid: 0.0,
            is_resolved: false,
        };
        for &at in &core.pixels {
            let light = core.above(picture, at);
            core.power += light;
            core.middle += direction(picture, at) * light.element_sum();
            core.solid += solid(picture, at / width);
        }
        core.middle = core.middle.try_normalize()?;
        // Pixels of a coarse picture are larger than a light may be.
        let core_area = PI * CORE_RAD * CORE_RAD;
        let ring_area = PI * RING_RAD * RING_RAD - core_area;
        core.is_resolved = core.solid > 0.5 * core_area && ring_solid > 0.5 * ring_area;
        Some(core)
    }

    fn above(&self, picture: &Surroundings, at: usize) -> Vec3 {
        let solid = solid(picture, at / picture.width);
        (Vec3::from(picture.rgb[at]) - self.around).max(Vec3::ZERO) * solid
    }
}

/// Looks for the middle of a light, which is not its brightest pixel.
const STEPS: usize = 3;

/// The light around a pixel, as far as it is one.
fn spot(picture: &Surroundings, peak: usize, whole: f64) -> Option<Spot> {
    let mut core = Core::new(picture, direction(picture, peak))?;
    for _ in 0..STEPS {
        core = Core::new(picture, core.middle)?;
    }
    let total = core.power.element_sum();
    let mean2 = core.pixels.iter().map(|&at| {
        core.above(picture, at).element_sum() * direction(picture, at).distance_squared(core.middle)
    });
    // Of a disc it is half of its radius squared.
    let radius2 = 2.0 * mean2.sum::<f32>() / total;
    let part = (f64::from(total) / whole) as f32;
    let contrast = total / (core.around.element_sum() * core.solid).max(f32::MIN_POSITIVE);
    let share =
        rising(PART, part) * rising(CONTRAST, contrast) * (1.0 - rising(LARGE_RAD, radius2.sqrt()));
    let sun = Sun {
        direction: core.middle,
        power: core.power,
        alpha2: radius2 / 8.0,
    };
    (core.is_resolved && share > 0.0).then_some(Spot {
        sun,
        around: core.around,
        core: core.pixels,
        share,
    })
}

/// From 0 to 1 between two numbers.
fn rising([low, high]: [f32; 2], at: f32) -> f32 {
    ((at - low) / (high - low)).clamp(0.0, 1.0)
}

/// Towards the centre of a pixel: the picture's middle lies towards -z.
fn direction(picture: &Surroundings, at: usize) -> Vec3 {
    let (x, y) = (at % picture.width, at / picture.width);
    let across = ((x as f32 + 0.5) / picture.width as f32 - 0.5) * TAU;
    let (sin, cos) = ((y as f32 + 0.5) / picture.height as f32 * PI).sin_cos();
    Vec3::new(sin * across.sin(), cos, -sin * across.cos())
}

// The reflection of small lights by rough surfaces: the model's own formula, sixteen places at a time.
//
// Facets on a surface with bumps that are too small to be seen are denser or sparser.
//
// Slopes of facets are spread as GGX has it, slopes of bumps as a Gaussian; both together are spread as the two blurred by one another. GGX
// is a mix of Gaussians: with alpha squared a, its density at slope s is the integral of exp(-t) G(s; a / t) over t > 0, where G(s; v) =
// exp(-s^2 / v) / (pi v). A Gaussian of bumps with variance b (sum of both axes) makes each of them G(s; a / t + b). The table holds what this is of
// the plain GGX with alpha squared a + b, which has its tails where the sum has few.

/// Surfaces as a small light meets them.
pub(super) struct LitSurface<S: Simd> {
    pub(super) normal: [f32x16<S>; 3],
    pub(super) eye: [f32x16<S>; 3],
    /// Between the two.
    pub(super) cosine: f32x16<S>,
    pub(super) roughness: f32x16<S>,
    /// Mean square of the distance of normals from their mean.
    pub(super) variance: f32x16<S>,
}

impl<S: Simd> LitSurface<S> {
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
        let added = self.variance + splat(sun.alpha2);
        let sum = alpha * alpha + added;
        let alpha2 = sum.min(one);
        let spread = one + to_half * to_half * (alpha2 - one);
        // Slopes of bumps and of a light's disc have no tails as those of facets have.
        let shape = shape_of_bumps(
            simd,
            added / sum.max(least),
            (one - to_half * to_half) / spread.max(least),
        );
        let dense = shape * alpha2 / (spread * spread * splat(PI)).max(least);
        let smith = |a: f32x16<S>, b: f32x16<S>| a * (b * b * (one - alpha2) + alpha2).sqrt();
        let blocked = smith(to_light, self.cosine) + smith(self.cosine, to_light);
        let plain = dense * to_light * splat(0.5) / blocked.max(least);
        let away = one - tilt;
        let away2 = away * away;
        [plain, plain * away2 * away2 * away]
    }
}

/// Nodes along each side: the shape is smooth, and bilinear between them to 0.3 %.
const SIDE: usize = 33;

/// By b / (a + b), then by s^2 / (a + b + s^2).
static SHAPE: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let share = |k: usize| k as f64 / (SIDE - 1) as f64;
    (0..SIDE * SIDE)
        .map(|node| at(share(node / SIDE), share(node % SIDE)) as f32)
        .collect()
});

/// The density of slopes over that of the plain GGX.
fn at(of_bumps: f64, away: f64) -> f64 {
    if away == 1.0 {
        // Far away only the tails of facets are left.
        return 1.0 - of_bumps;
    }
    let square = away / (1.0 - away);
    let plain = (1.0 + square).powi(-2);
    if of_bumps == 1.0 {
        return (-square).exp() / plain;
    }
    // In units of a + b; over the logarithm of t, where the integrand is smooth and falls off at both ends.
    let (step, count) = (0.1, 240);
    let mut sum = 0.0;
    for k in 0..count {
        let t = (-20.0 + step * f64::from(k)).exp();
        let variance = (1.0 - of_bumps) / t + of_bumps;
        sum += t * (-t - square / variance).exp() / variance;
    }
    sum * step / plain
}

/// The density of facets under bumps, by their part of the sum of variances, and by s^2 / (a + b + s^2).
#[inline(always)]
fn shape_of_bumps<S: Simd>(simd: S, of_bumps: f32x16<S>, away: f32x16<S>) -> f32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    let last = (SIDE - 1) as f32;
    let scaled = |v: f32x16<S>| v.max(splat(0.0)).min(splat(1.0)) * splat(last);
    let (mut rows, mut columns) = ([0.0; LANES], [0.0; LANES]);
    scaled(of_bumps).store_slice(&mut rows);
    scaled(away).store_slice(&mut columns);
    let table = &**SHAPE;
    let mut out = [1.0; LANES];
    for lane in 0..LANES {
        let row = (rows[lane] as usize).min(SIDE - 2);
        let column = (columns[lane] as usize).min(SIDE - 2);
        let (down, right) = (rows[lane] - row as f32, columns[lane] - column as f32);
        let first = row * SIDE + column;
        let mixed = |place: usize| table[place] + (table[place + 1] - table[place]) * right;
        let (top, low) = (mixed(first), mixed(first + SIDE));
        out[lane] = top + (low - top) * down;
    }
    f32x16::from_slice(simd, &out)
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
        let found = extract_suns(&sky(&[(first, 0.01, 4000.0), (second, 0.015, 900.0)]));
        let (suns, rest) = found.expect("two lights");
        assert_eq!(suns.len(), 2);
        assert!(suns[0].direction.distance(first.normalize()) < 1e-3);
        let disc = PI * 0.01 * 0.01 * 4000.0;
        let power = suns[0].power.x;
        assert!((power / disc - 1.0).abs() < 0.1, "{power} of {disc}");
        assert!(rest.rgb.iter().all(|pixel| pixel[0] < 0.6), "an even sky");
        assert!(
            extract_suns(&sky(&[(first, 0.2, 4000.0)])).is_none(),
            "a large lamp"
        );
        assert!(
            extract_suns(&sky(&[(first, 0.01, 2.0)])).is_none(),
            "a dim one"
        );
        assert!(extract_suns(&sky(&[])).is_none(), "an even sky");
    }

    #[test]
    fn without_bumps_the_shape_is_that_of_facets() {
        for k in 0..10 {
            let found = at(0.0, f64::from(k) / 10.0);
            assert!((found - 1.0).abs() < 1e-6, "{k}: {found}");
        }
    }

    #[test]
    fn no_facets_are_lost_whatever_the_bumps() {
        // The density over all slopes: the integral of shape * (1 + y)^-2 over y is that of shape over z = y / (1 + y).
        for of_bumps in [0.1, 0.5, 0.9] {
            let count = 2000;
            let place = |k: i32| (f64::from(k) + 0.5) / f64::from(count);
            let sum: f64 = (0..count).map(|k| at(of_bumps, place(k))).sum();
            let mean = sum / f64::from(count);
            assert!((mean - 1.0).abs() < 1e-3, "{of_bumps}: {mean}");
        }
    }

    #[test]
    fn bumps_blur_the_density_of_slopes() {
        // The GGX blurred by brute force along a line through its middle.
        let (a, b) = (0.04f64, 0.02f64);
        let facets = |x: f64, y: f64| a / (std::f64::consts::PI * (a + x * x + y * y).powi(2));
        for s in [0.0, 0.1, 0.3, 0.6] {
            let (step, reach) = (0.005, 120);
            let (mut sum, mut whole) = (0.0, 0.0);
            for i in -reach..=reach {
                for j in -reach..=reach {
                    let (x, y) = (f64::from(i) * step, f64::from(j) * step);
                    let weight = (-(x * x + y * y) / b).exp();
                    sum += weight * facets(s - x, y);
                    whole += weight;
                }
            }
            let all = a + b;
            let plain = all / (std::f64::consts::PI * (all + s * s).powi(2));
            let found = plain * at(b / all, s * s / (all + s * s));
            let truth = sum / whole;
            assert!(
                (found / truth - 1.0).abs() < 1e-3,
                "slope {s}: {found} of {truth}"
            );
        }
    }
}
