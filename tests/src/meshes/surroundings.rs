//! Light of surroundings on metal and roughness by brute force: the glTF 2.0 model summed over many directions, in f64.
//!
//! Specular light is summed over GGX half vectors with Smith's height-correlated shadowing and Schlick's Fresnel term, matt light
//! over the cosine; light between facets and what is left for the matt layer follow from the same sums (Fdez-Agüera 2019). No
//! light is blurred beforehand, and nothing is looked up in a table. Shares no formula with the renderer but the model.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use texmap::scene::Surroundings;

/// A surface that light falls on.
#[derive(Clone, Copy, Debug)]
pub struct Reflector {
    /// Linear base colour.
    pub base: DVec3,
    /// 0 to 1.
    pub metal: f64,
    /// Perceptual roughness, above 0.
    pub roughness: f64,
}

/// The reflectance of a dielectric along its normal.
const DIELECTRIC: DVec3 = DVec3::splat(0.04);

/// Surroundings with lamps, walls and colours, by a formula: `height` rows.
pub fn lamps(height: usize) -> Surroundings {
    let width = 2 * height;
    let pixel = |at: usize| {
        let (x, y) = (at % width, at / width);
        let across = ((x as f64 + 0.5) / width as f64 - 0.5) * TAU;
        let down = (y as f64 + 0.5) / height as f64 * PI;
        let d = DVec3::new(
            down.sin() * across.sin(),
            down.cos(),
            -down.sin() * across.cos(),
        );
        let lamp = |towards: DVec3, width: f64| {
            let angle = d.dot(towards.normalize()).clamp(-1.0, 1.0).acos();
            1.0 / (1.0 + (angle / width).powi(8))
        };
        let sky = DVec3::new(0.25, 0.3, 0.4) * (1.0 + 0.6 * d.y);
        let light = sky
            + DVec3::new(2.5, 2.4, 2.2) * lamp(DVec3::new(-0.5, 0.7, 0.8), 0.35)
            + DVec3::new(0.6, 0.9, 1.6) * lamp(DVec3::new(0.9, 0.1, 0.3), 0.3)
            + DVec3::new(1.2, 0.7, 0.4) * lamp(DVec3::new(0.2, -0.3, -1.0), 0.5);
        light.as_vec3().to_array()
    };
    Surroundings {
        width,
        height,
        rgb: (0..width * height).map(pixel).collect(),
    }
}

/// Radiance from a direction of unit length, bilinear.
pub fn radiance(from: &Surroundings, d: DVec3) -> DVec3 {
    let (width, height) = (from.width as i64, from.height as i64);
    let x = (d.x.atan2(-d.z) / TAU + 0.5) * width as f64 - 0.5;
    let y = d.y.clamp(-1.0, 1.0).acos() / PI * height as f64 - 0.5;
    let texel = |i: i64, j: i64| {
        let at = j.clamp(0, height - 1) * width + i.rem_euclid(width);
        DVec3::from(from.rgb[at as usize].map(f64::from))
    };
    let (i, j) = (x.floor() as i64, y.floor() as i64);
    let (s, t) = (x - x.floor(), y - y.floor());
    let row = |j: i64| texel(i, j) * (1.0 - s) + texel(i + 1, j) * s;
    row(j) * (1.0 - t) + row(j + 1) * t
}

/// Light that a surface with a unit normal sends to the eye; `count` directions for each sum.
pub fn reflected(
    from: &Surroundings,
    surface: &Reflector,
    at: (DVec3, DVec3),
    count: usize,
) -> DVec3 {
    reflected_of(|direction| radiance(from, direction), surface, at, count)
}

/// As [`reflected`], of any radiance by direction: 0 where something stands before the surroundings.
pub fn reflected_of(
    radiance: impl Fn(DVec3) -> DVec3,
    surface: &Reflector,
    at: (DVec3, DVec3),
    count: usize,
) -> DVec3 {
    below_layers(radiance, surface, (DIELECTRIC, 1.0), at, count)
}

/// As [`reflected_of`], of paint that reflects `f0` along the normal and `f90` at grazing angles.
fn below_layers(
    radiance: impl Fn(DVec3) -> DVec3,
    surface: &Reflector,
    (paint, f90): (DVec3, f64),
    (normal, eye): (DVec3, DVec3),
    count: usize,
) -> DVec3 {
    let (side, above) = normal.any_orthonormal_pair();
    let world = |v: DVec3| side * v.x + above * v.y + normal * v.z;
    let to_eye = normal.dot(eye).max(1e-3);
    let f0 = paint.lerp(surface.base, surface.metal);
    let mixed_f90 = DVec3::splat(f90 + (1.0 - f90) * surface.metal);
    let alpha = surface.roughness.powi(2);
    let (mut specular, mut irradiance) = (DVec3::ZERO, DVec3::ZERO);
    let (mut scale, mut offset) = (0.0, 0.0);
    for k in 0..count {
        let (u, v) = lattice(k, count);
        let (sin, cos) = (TAU * v).sin_cos();
        let matt = DVec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt());
        irradiance += radiance(world(matt)) / count as f64;
        let cosine2 = (1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u);
        let sine = (1.0 - cosine2).sqrt();
        let half = world(DVec3::new(sine * cos, sine * sin, cosine2.sqrt()));
        let to_half = half.dot(eye);
        let light = half * (2.0 * to_half) - eye;
        let to_light = normal.dot(light);
        if to_light <= 0.0 || to_half <= 0.0 {
            continue;
        }
        let smith = |a: f64, b: f64| a * (b * b * (1.0 - alpha * alpha) + alpha * alpha).sqrt();
        let visible = 0.5 / (smith(to_light, to_eye) + smith(to_eye, to_light));
        let weight = 4.0 * visible * to_light * to_half / cosine2.sqrt() / count as f64;
        let fresnel = (1.0 - to_half).powi(5);
        scale += weight * (1.0 - fresnel);
        offset += weight * fresnel;
        let share = f0 * (1.0 - fresnel) + mixed_f90 * fresnel;
        specular += share * weight * radiance(light);
    }
    let lost = 1.0 - scale - offset;
    let again = |f0: DVec3, f90: f64| {
        let once = f0 * scale + DVec3::splat(offset * f90);
        let average = f0 + (DVec3::splat(f90) - f0) / 21.0;
        (once, once * average * lost / (DVec3::ONE - average * lost))
    };
    // As the standard has it, the mix of the dielectric's and the metal's result; what is reflected once is a line in f0.
    let (once, often) = again(paint, f90);
    let dielectric = often + surface.base * (DVec3::ONE - once - often);
    let (_, metal) = again(surface.base, 1.0);
    specular + dielectric.lerp(metal, surface.metal) * irradiance
}

/// The light that a surface sends to the eye from a small light of radiance times solid angle 1, reflected once.
pub fn of_small_light(surface: &Reflector, (normal, eye): (DVec3, DVec3), light: DVec3) -> DVec3 {
    let (to_light, to_eye) = (normal.dot(light), normal.dot(eye));
    if to_light <= 0.0 || to_eye <= 0.0 {
        return DVec3::ZERO;
    }
    let half = (light + eye).normalize();
    let alpha2 = surface.roughness.powi(4);
    let spread = 1.0 + normal.dot(half).powi(2) * (alpha2 - 1.0);
    let dense = alpha2 / (PI * spread * spread);
    let smith = |a: f64, b: f64| a * (b * b * (1.0 - alpha2) + alpha2).sqrt();
    let visible = 0.5 / (smith(to_light, to_eye) + smith(to_eye, to_light));
    let fresnel = (1.0 - half.dot(eye)).powi(5);
    let f0 = DIELECTRIC.lerp(surface.base, surface.metal);
    (f0 * (1.0 - fresnel) + DVec3::splat(fresnel)) * (dense * visible * to_light)
}

/// Layers above a surface, and how its paint reflects.
#[derive(Clone, Copy, Debug)]
pub struct Above {
    /// Reflectance of paint along the normal.
    pub f0: DVec3,
    /// Reflectance of paint at grazing angles.
    pub f90: f64,
    /// Amount of a coat and its roughness.
    pub coat: [f64; 2],
    /// Colour of fibres.
    pub sheen: DVec3,
    /// Their roughness.
    pub sheen_roughness: f64,
}

impl Default for Above {
    fn default() -> Self {
        Self {
            f0: DIELECTRIC,
            f90: 1.0,
            coat: [0.0, 1.0],
            sheen: DVec3::ZERO,
            sheen_roughness: 1.0,
        }
    }
}

/// As [`reflected`], through layers: a coat and fibres as the extensions of glTF have them.
pub fn reflected_through(
    from: &Surroundings,
    (surface, above): (&Reflector, &Above),
    (normal, eye): (DVec3, DVec3),
    count: usize,
) -> DVec3 {
    let light = |direction: DVec3| radiance(from, direction);
    let at = (normal, eye);
    let mut sum = below_layers(light, surface, (above.f0, above.f90), at, count);
    let to_eye = normal.dot(eye).max(1e-3);
    if above.sheen != DVec3::ZERO {
        let (mut albedo, mut fibres) = (0.0, DVec3::ZERO);
        let (side, up) = normal.any_orthonormal_pair();
        for k in 0..count {
            // Even in the square root of the cosine, which is dense where fibres shine.
            let (u, v) = lattice(k, count);
            let cosine = u * u;
            let sine = (1.0 - cosine * cosine).sqrt();
            let (sin, cos) = (TAU * v).sin_cos();
            let direction = side * (sine * cos) + up * (sine * sin) + normal * cosine;
            let half = (direction + eye).normalize();
            let share = charlie(normal.dot(half), [cosine, to_eye], above.sheen_roughness);
            let part = share * cosine * 2.0 * u * TAU / count as f64;
            albedo += part;
            fibres += light(direction) * part;
        }
        sum = sum * (1.0 - above.sheen.max_element() * albedo) + above.sheen * fibres;
    }
    let [amount, roughness] = above.coat;
    let glass = Reflector {
        base: DVec3::ZERO,
        metal: 0.0,
        roughness,
    };
    let coat = once_reflected(light, &glass, at, count);
    let fresnel = 0.04 + 0.96 * (1.0 - to_eye).powi(5);
    sum * (1.0 - amount * fresnel) + coat * amount
}

/// Light that a dielectric reflects once.
fn once_reflected(
    radiance: impl Fn(DVec3) -> DVec3,
    surface: &Reflector,
    (normal, eye): (DVec3, DVec3),
    count: usize,
) -> DVec3 {
    let (side, above) = normal.any_orthonormal_pair();
    let alpha2 = surface.roughness.powi(4);
    let mut sum = DVec3::ZERO;
    for k in 0..count {
        let (u, v) = lattice(k, count);
        let (sin, cos) = (TAU * v).sin_cos();
        let cosine2 = (1.0 - u) / (1.0 + (alpha2 - 1.0) * u);
        let sine = (1.0 - cosine2).sqrt();
        let half = side * (sine * cos) + above * (sine * sin) + normal * cosine2.sqrt();
        let light = half * (2.0 * half.dot(eye)) - eye;
        if normal.dot(light) <= 0.0 || half.dot(eye) <= 0.0 {
            continue;
        }
        // Over the density of half vectors per direction of light.
        let density = alpha2 / (PI * (1.0 + cosine2 * (alpha2 - 1.0)).powi(2)) * cosine2.sqrt()
            / (4.0 * half.dot(eye));
        let share = of_small_light(surface, (normal, eye), light);
        sum += share * radiance(light) / density / count as f64;
    }
    sum
}

/// Charlie's distribution with the shadowing of Estevez and Kulla, over four times both cosines.
fn charlie(to_half: f64, cosines: [f64; 2], roughness: f64) -> f64 {
    let alpha = roughness * roughness;
    let dense =
        (2.0 + 1.0 / alpha) * (1.0 - to_half * to_half).max(0.0).sqrt().powf(1.0 / alpha) / TAU;
    let part = (1.0 - alpha).powi(2);
    let mix = |rough: f64, smooth: f64| rough * (1.0 - part) + smooth * part;
    let line = |x: f64| {
        mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * x.powf(mix(0.19823, 0.16801)))
            + mix(-1.97760, -1.27393) * x
            + mix(-4.32054, -4.85967)
    };
    let lambda = |cosine: f64| match cosine < 0.5 {
        true => line(cosine).exp(),
        false => (2.0 * line(0.5) - line(1.0 - cosine)).exp(),
    };
    let [light, eye] = cosines;
    dense / (1.0 + lambda(light) + lambda(eye)) / (4.0 * light * eye).max(1e-12)
}

/// Fills the unit square evenly.
fn lattice(k: usize, count: usize) -> (f64, f64) {
    let golden = 0.618_033_988_749_894_9;
    ((k as f64 + 0.5) / count as f64, (k as f64 * golden).fract())
}
