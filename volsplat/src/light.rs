//! Light by the gradient of the field: Lambert's cosine and Phong's highlight, on both sides, and the ramp over its
//! length.
//!
//! Gradients are in the world's directions, so that a stretched grid is lit as it stands in the world, and per unit in which
//! pictures count lengths. A sample without a gradient gets the ambient part alone.
//! Source: B. T. Phong, "Illumination for Computer Generated Pictures", Communications of the ACM 18(6), 1975.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;
use resample_core::Camera;
use resample_core::light::{AMBIENT, DIFFUSE};
use resample_core::narrow::single;

use crate::GradientOpacity;
use crate::look::options::{Light, RenderOptions, Shading};

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

/// A factor of the extinction over the length of the gradient: that of the shortest, and what each piece of the curve adds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GradientCurve {
    first: f32,
    pieces: [Ramp; GradientOpacity::MOST_KNOTS - 1],
    count: usize,
}

/// A piece of a curve, which rises or falls from one length of the gradient to another.
#[derive(Clone, Copy, Debug, Default)]
struct Ramp {
    low: f32,
    /// 1 over the ramp's width.
    scale: f32,
    rise: f32,
}

/// Light on a sample: a factor of its colour, and white to add.
#[derive(Clone, Copy)]
pub(crate) struct Lit<F> {
    pub(crate) body: F,
    pub(crate) highlight: F,
}

/// The byte that stands for full light at a vertex.
pub(crate) const FULL_LIGHT: f32 = 255.0;

/// Factors of the light that keep pictures as bright as without shadows and occlusion; `None` where they are not drawn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gains {
    pub(crate) sun: Option<f32>,
    pub(crate) sky: Option<f32>,
}

impl Gains {
    /// Returns true if neither shadows nor occlusion is drawn.
    pub(crate) fn is_none(&self) -> bool {
        self.sun.is_none() && self.sky.is_none()
    }
}

/// The share of light of this square root, in bytes, times a gain.
#[inline(always)]
pub(crate) fn share_of_light<S: Simd, F: SimdFloat<S, Element = f32>>(
    simd: S,
    root: F,
    gain: f32,
) -> F {
    let root = root * F::splat(simd, 1.0 / FULL_LIGHT);
    root * root * F::splat(simd, gain)
}

impl<F> Lit<F> {
    /// The light on a sample that this share of the light reaches. The ambient light reaches all.
    #[inline(always)]
    pub(crate) fn shadowed<S: Simd>(self, simd: S, sun: F) -> Self
    where
        F: SimdFloat<S, Element = f32>,
    {
        let ambient = F::splat(simd, AMBIENT);
        Self {
            body: (self.body - ambient).mul_add(sun, ambient),
            highlight: self.highlight * sun,
        }
    }

    /// The light on a sample that this share of the sky reaches. With shadows the ambient light is the sky's, else all light is.
    #[inline(always)]
    pub(crate) fn occluded<S: Simd>(self, simd: S, sky: F, has_shadows: bool) -> Self
    where
        F: SimdFloat<S, Element = f32>,
    {
        if has_shadows {
            let ambient = F::splat(simd, AMBIENT);
            return Self {
                body: ambient.mul_add(sky - F::splat(simd, 1.0), self.body),
                highlight: self.highlight,
            };
        }
        Self {
            body: self.body * sky,
            highlight: self.highlight * sky,
        }
    }
}

/// Gradients as directions and lengths.
#[derive(Clone, Copy)]
struct Polar<F, M> {
    /// Lanes that have a direction.
    directed: M,
    /// Unit vectors; 0 where there is no direction.
    direction: [F; 3],
    length: F,
}

/// A gradient as f32, held where differences of two are still finite.
pub(crate) fn gradient_in_f32(gradient: DVec3) -> [f32; 3] {
    let most = DVec3::splat(0.25 * f64::from(f32::MAX));
    gradient.clamp(-most, most).as_vec3().to_array()
}

impl<F, M> Polar<F, M> {
    /// The unit of scalars and of lengths is the user's, so that squares may lie beyond f32 either way: they are taken of
    /// the vector over its largest part.
    #[inline(always)]
    fn new<S: Simd>(simd: S, [x, y, z]: [F; 3]) -> Self
    where
        F: SimdFloat<S, Element = f32, Mask = M>,
        M: Copy + Select<F>,
    {
        let (zero, one) = (F::splat(simd, 0.0), F::splat(simd, 1.0));
        let largest = x.abs().max(y.abs()).max(z.abs());
        // What is smaller has few digits, and no inverse.
        let directed = largest.simd_ge(F::splat(simd, f32::MIN_POSITIVE));
        let inverse = directed.select(one / largest, zero);
        let (x, y, z) = (x * inverse, y * inverse, z * inverse);
        let root = x.mul_add(x, y.mul_add(y, z * z)).sqrt();
        let unit = directed.select(one / root, zero);
        Self {
            directed,
            direction: [x * unit, y * unit, z * unit],
            length: largest * root,
        }
    }
}

impl GradientCurve {
    /// That of a picture that counts lengths in `unit`, world units.
    pub(crate) fn new(curve: &GradientOpacity, unit: f64) -> Self {
        let knots = curve.scaled(unit).knots;
        let mut pieces = [Ramp::default(); GradientOpacity::MOST_KNOTS - 1];
        let pairs = knots.windows(2).zip(&mut pieces);
        pairs.for_each(|(pair, piece)| *piece = Ramp::new(pair[0], pair[1]));
        Self {
            first: knots.first().map_or(1.0, |knot| single(knot[1])),
            pieces,
            count: knots.len().saturating_sub(1),
        }
    }

    /// The factor of one sample.
    pub(crate) fn of_gradient(&self, gradient: [f32; 3]) -> f32 {
        let [x, y, z] = gradient.map(f64::from);
        let length = single(DVec3::new(x, y, z).length().min(f64::from(f32::MAX)));
        let pieces = self.pieces[..self.count].iter();
        let factor = pieces.fold(self.first, |sum, piece| {
            sum + piece.rise * ((length - piece.low) * piece.scale).clamp(0.0, 1.0)
        });
        factor.clamp(0.0, 1.0)
    }

    /// The factors of samples with these gradients.
    #[inline(always)]
    pub(crate) fn factor<S: Simd, F: SimdFloat<S, Element = f32>>(
        &self,
        simd: S,
        gradient: [F; 3],
    ) -> F {
        let (zero, one) = (F::splat(simd, 0.0), F::splat(simd, 1.0));
        let length = Polar::new(simd, gradient).length;
        let mut factor = F::splat(simd, self.first);
        for piece in &self.pieces[..self.count] {
            let low = F::splat(simd, piece.low);
            let share = (length - low) * F::splat(simd, piece.scale);
            factor += share.max(zero).min(one) * F::splat(simd, piece.rise);
        }
        factor.max(zero).min(one)
    }
}

impl Ramp {
    fn new([low, from]: [f64; 2], [high, to]: [f64; 2]) -> Self {
        Self {
            low: single(low),
            // A ramp narrower than f32 knows is a step.
            scale: single((1.0 / (high - low)).min(f64::from(f32::MAX))),
            rise: single(to - from),
        }
    }
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
        Some(Self {
            light: light.normalize_or(DVec3::Z).as_vec3().to_array(),
            specular,
        })
    }

    /// Returns true if light depends on where the eye is.
    #[inline(always)]
    pub(crate) fn has_highlight(&self) -> bool {
        self.specular != 0.0
    }

    /// Lights samples with these gradients, seen along these unit rays; both in the world. Rays count only for a highlight.
    #[inline(always)]
    pub(crate) fn light<S: Simd, F: SimdFloat<S, Element = f32>>(
        &self,
        simd: S,
        gradient: [F; 3],
        ray: [F; 3],
    ) -> Lit<F> {
        let [x, y, z] = self.light;
        let light = [F::splat(simd, x), F::splat(simd, y), F::splat(simd, z)];
        let zero = F::splat(simd, 0.0);
        let Polar {
            directed,
            direction: normal,
            ..
        } = Polar::new(simd, gradient);
        // Either side is lit: the normal is the one that faces the light.
        let signed = dot(normal, light);
        let body = signed
            .abs()
            .mul_add(F::splat(simd, DIFFUSE), F::splat(simd, AMBIENT));
        if !self.has_highlight() {
            return Lit {
                body,
                highlight: zero,
            };
        }
        // The mirrored light is 2 (n.l) n - l, whichever side n is on.
        let twice = signed * F::splat(simd, 2.0);
        let mirrored = [
            normal[0].mul_add(twice, -light[0]),
            normal[1].mul_add(twice, -light[1]),
            normal[2].mul_add(twice, -light[2]),
        ];
        let towards_eye = (-dot(mirrored, ray)).max(zero);
        let shine = directed.select(power(towards_eye), zero);
        Lit {
            body,
            highlight: shine * F::splat(simd, self.specular),
        }
    }
}

#[inline(always)]
fn dot<S: Simd, F: SimdFloat<S>>(a: [F; 3], b: [F; 3]) -> F {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// The highlight's power, 2^4 + 2^2 = 20, by squaring.
#[inline(always)]
fn power<S: Simd, F: SimdFloat<S>>(x: F) -> F {
    squared(x, SPECULAR_POWER_LOG2[0]) * squared(x, SPECULAR_POWER_LOG2[1])
}

#[inline(always)]
fn squared<S: Simd, F: SimdFloat<S>>(mut x: F, times: u32) -> F {
    for _ in 0..times {
        x = x * x;
    }
    x
}
