//! Shading of a sample by the gradient of the field: Lambert's cosine and Phong's highlight, on both sides.
//!
//! The gradient at a sample is the trilinear mix of central differences at the voxels, in world units, so that a
//! stretched grid is lit as it stands in the world. A sample without a gradient gets the ambient part alone.
//! Source: B. T. Phong, "Illumination for Computer Generated Pictures", Communications of the ACM 18(6), 1975.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::DVec3;
use resample_core::Camera;

use crate::options::{Light, RenderOptions, Shading};

/// Share of a sample's colour that it shows without light, and the share that follows the cosine: they add up to 1,
/// so that a surface that faces the light keeps its colour. The split is a habit of volume renderers, not derived.
const AMBIENT: f32 = 0.3;
const DIFFUSE: f32 = 0.7;

/// Strength of the highlight, white, and its exponent. Habits too.
const SPECULAR: f32 = 0.2;
const SPECULAR_POWER_LOG2: [u32; 2] = [4, 2];

/// How samples of a frame are lit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadeSettings {
    /// Unit direction towards the light, in the world.
    light: [f32; 3],
    specular: f32,
}

/// What light makes of a sample: a factor of its colour, and white to add.
#[derive(Clone, Copy)]
pub(crate) struct Lit<S: Simd> {
    pub(crate) body: f32x8<S>,
    pub(crate) highlight: f32x8<S>,
}

impl ShadeSettings {
    /// The settings of a frame; `None` where nothing is shaded.
    pub(crate) fn new(options: &RenderOptions, camera: &Camera) -> Option<Self> {
        let specular = match options.shading {
            Shading::None => return None,
            Shading::Lambert => 0.0,
            Shading::Phong => SPECULAR,
        };
        let light = match options.light {
            Light::Headlight => -camera.forward_in_world(),
            Light::Towards(direction) => direction,
        };
        Some(Self { light: light.normalize_or(DVec3::Z).as_vec3().to_array(), specular })
    }

    /// Lights samples with these gradients, seen along these unit rays; both in the world.
    #[inline(always)]
    pub(crate) fn light<S: Simd>(&self, simd: S, gradient: [f32x8<S>; 3], ray: [f32x8<S>; 3]) -> Lit<S> {
        let constant = |v: f32| f32x8::splat(simd, v);
        let dot = |a: [f32x8<S>; 3], b: [f32x8<S>; 3]| a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]));
        let light = self.light.map(constant);
        let length2 = dot(gradient, gradient);
        // Too small to have a direction in f32: the cosine is then 0.
        let directed = length2.simd_gt(constant(f32::MIN_POSITIVE));
        let inverse = directed.select(constant(1.0) / length2.sqrt(), constant(0.0));
        // Either side is lit: the normal is the one that faces the light.
        let signed = dot(gradient, light) * inverse;
        let cosine = signed.abs();
        let body = cosine.mul_add(constant(DIFFUSE), constant(AMBIENT));
        if self.specular == 0.0 {
            return Lit { body, highlight: constant(0.0) };
        }
        // The mirrored light is 2 (n.l) n - l; with the sign of n chosen, (n.l) n is (g.l) g / |g|^2.
        let normal_part = (signed * inverse) * constant(2.0);
        let mirrored: [f32x8<S>; 3] = std::array::from_fn(|k| gradient[k].mul_add(normal_part, -light[k]));
        let towards_eye = (-dot(mirrored, ray)).max(constant(0.0));
        let shine = directed.select(power(towards_eye), constant(0.0));
        Lit { body, highlight: shine * constant(self.specular) }
    }
}

/// The highlight's power, 2^4 + 2^2 = 20, by squaring.
#[inline(always)]
fn power<S: Simd>(x: f32x8<S>) -> f32x8<S> {
    let squared = |mut x: f32x8<S>, times: u32| {
        for _ in 0..times {
            x = x * x;
        }
        x
    };
    squared(x, SPECULAR_POWER_LOG2[0]) * squared(x, SPECULAR_POWER_LOG2[1])
}
