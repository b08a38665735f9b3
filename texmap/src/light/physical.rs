//! Reflection of the surroundings by metal and roughness, sixteen places at a time.
//!
//! The model of glTF 2.0, appendix B: a matt layer below GGX, a metal, or the mix of what both give. Light of the environment is split: radiance blurred
//! by the lobe, times the reflectance of even light (Karis 2013), with the light that bounces more than once between
//! facets, and what is left for the matt layer, after Fdez-Agüera (2019). What a footprint covers counts by its variances:
//! that of normals widens the lobe (Tokuyoshi and Kaplanyan 2019; Toksvig 2005), and roughnesses far apart are two lobes.
//!
//! Takes [`Inputs`]; gives reflected light, linear. Metal and paint in one footprint each have their own mean colour and, as [`Lobe`] says, their own
//! roughness. Limits: within each, colour and roughness are taken to be independent.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec4;

use crate::light::blocked::look::PixelLights;
use crate::light::environment::Environment;
use crate::light::layers::{LayerInputs, SeenByLayers};
use crate::light::lobe::{
    DIELECTRIC, Directions, EvenResponse, LEAST_COSINE, Shaded, Surrounding, add_suns, irradiance,
    load_3, mirrored_at, seen_in_lobe,
};
use crate::light::suns::LitSurface;
use crate::screen::{LANES, Lanes};

/// The least metal whose colour is known apart from that of paint.
const LEAST_METAL: f32 = 1e-3;

/// Surfaces as light meets them.
pub(crate) struct Inputs {
    /// Of length 1, in the world.
    pub(crate) normal: [Lanes; 3],
    /// Towards the eye, of length 1.
    pub(crate) eye: [Lanes; 3],
    /// Base colour, straight.
    pub(crate) base: [Lanes; 3],
    pub(crate) metal: Lanes,
    /// Covariances with metal, of base colour and of roughness: 0 where a footprint has one of each.
    pub(crate) base_with_metal: [Lanes; 3],
    pub(crate) roughness_with_metal: Lanes,
    /// Perceptual roughness: mean and variance.
    pub(crate) roughness: Lanes,
    pub(crate) roughness_variance: Lanes,
    /// Share of light that arrives.
    pub(crate) open: Lanes,
    /// Mean square of the distance of normals from their mean.
    pub(crate) variance: Lanes,
    /// Layers beside metal and paint.
    pub(crate) layers: LayerInputs,
    /// Where the scene blocks light.
    pub(crate) pixels: PixelLights,
}

impl Default for Inputs {
    fn default() -> Self {
        Self {
            normal: [[0.0; LANES]; 3],
            eye: [[0.0; LANES]; 3],
            base: [[0.0; LANES]; 3],
            metal: [0.0; LANES],
            base_with_metal: [[0.0; LANES]; 3],
            roughness_with_metal: [0.0; LANES],
            roughness: [0.0; LANES],
            roughness_variance: [0.0; LANES],
            open: [1.0; LANES],
            variance: [0.0; LANES],
            layers: LayerInputs::default(),
            pixels: PixelLights::default(),
        }
    }
}

/// Reflects light at the first `count` places.
#[inline(always)]
pub(crate) fn reflect<S: Simd>(
    simd: S,
    around: Surrounding,
    inputs: &mut Inputs,
    count: usize,
    out: &mut [Vec4; LANES],
) {
    // Surfaces of metal and paint alone do without the rest of the code.
    match inputs.layers.used {
        false => reflect_metal_and_paint(simd, around, inputs, count, out),
        true => reflect_layers(simd, around, inputs, count, out),
    }
}

#[simd]
fn reflect_metal_and_paint<S: Simd>(
    simd: S,
    around: Surrounding,
    inputs: &mut Inputs,
    count: usize,
    out: &mut [Vec4; LANES],
) {
    reflect_of::<S, false>(simd, around, inputs, count, out);
}

#[simd]
fn reflect_layers<S: Simd>(
    simd: S,
    around: Surrounding,
    inputs: &mut Inputs,
    count: usize,
    out: &mut [Vec4; LANES],
) {
    reflect_of::<S, true>(simd, around, inputs, count, out);
}

/// Reflects light; without `LAYERS` only metal and plain paint do.
#[inline(always)]
fn reflect_of<S: Simd, const LAYERS: bool>(
    simd: S,
    around: Surrounding,
    inputs: &mut Inputs,
    count: usize,
    out: &mut [Vec4; LANES],
) {
    let environment = around.environment;
    let load = |lanes: &Lanes| f32x16::from_slice(simd, lanes);
    let place = Place::new(simd, inputs);
    let footprint = Footprint::new::<LAYERS>(simd, inputs);
    let (lobes, count_of_lobes) = moments(simd, inputs, footprint.metal).lobes(simd);
    let open = load(&inputs.open);
    let mut shaded = Shaded::new(simd, around, &mut inputs.pixels, count);
    let mut mirror = [f32x16::splat(simd, 0.0); 3];
    let mut once = SingleScattering::new(simd);
    for (number, lobe) in lobes[..count_of_lobes].iter().enumerate() {
        let mut even = EvenResponse::default();
        let reflectance = &environment.reflectance;
        let widened = reflectance.widened(simd, lobe.roughness, place.variance);
        even.look(simd, environment, (widened, place.cosine), count);
        // Lobes of one footprint lie around one direction: the first is looked into for both.
        if number == 0 {
            shaded.look_into_lobe(simd, &place.directions(), &even, count);
        }
        let light = (environment, &shaded);
        once.add(lobe, even.of_even_light(simd), lobe.metal - footprint.metal);
        footprint.add_lobe::<LAYERS>(simd, light, (&place, lobe, &even), count, &mut mirror);
    }
    let mut even = [f32x16::splat(simd, 0.0); 3];
    let towards = (place.normal, place.variance);
    irradiance(simd, (environment, &shaded), towards, count, &mut even);
    let glass = LAYERS.then(|| load(&inputs.layers.glass));
    let (further, mut through) = footprint.multiple_scattering(simd, &once, glass);
    let open = shaded.open(simd, (environment, open), towards, &even);
    for k in 0..3 {
        mirror[k] = (mirror[k] + further[k] * even[k]) * open;
    }
    if LAYERS {
        let seen = SeenByLayers {
            layers: &inputs.layers,
            normal: place.normal,
            eye: place.eye,
            cosine: place.cosine,
            open,
            even,
        };
        let light = (environment, &shaded);
        seen.add(simd, light, count, (&mut mirror, &mut through));
        for (part, lanes) in through.iter().zip(&mut inputs.layers.through) {
            part.store_slice(lanes);
        }
    }
    store_colours(&mirror, &mut out[..count]);
}

/// How surfaces lie to the eye.
struct Place<S: Simd> {
    normal: [f32x16<S>; 3],
    eye: [f32x16<S>; 3],
    /// The direction to the eye, mirrored at the normal.
    mirrored: [f32x16<S>; 3],
    /// Between normal and eye.
    cosine: f32x16<S>,
    /// Mean square of the distance of normals from their mean.
    variance: f32x16<S>,
}

impl<S: Simd> Place<S> {
    #[inline(always)]
    fn new(simd: S, inputs: &Inputs) -> Self {
        let splat = |x: f32| f32x16::splat(simd, x);
        let normal = load_3(simd, &inputs.normal);
        let eye = load_3(simd, &inputs.eye);
        let cosine = normal[0] * eye[0] + normal[1] * eye[1] + normal[2] * eye[2];
        Self {
            normal,
            eye,
            mirrored: mirrored_at(normal, eye, cosine),
            cosine: cosine.max(splat(LEAST_COSINE)).min(splat(1.0)),
            variance: f32x16::from_slice(simd, &inputs.variance),
        }
    }

    #[inline(always)]
    fn directions(&self) -> Directions<S> {
        (self.normal, self.mirrored)
    }
}

/// The moments of metal and roughness in each footprint.
#[inline(always)]
fn moments<S: Simd>(simd: S, inputs: &Inputs, metal: f32x16<S>) -> FootprintMoments<S> {
    let load = |lanes: &Lanes| f32x16::from_slice(simd, lanes);
    FootprintMoments {
        metal,
        roughness: load(&inputs.roughness),
        variance: load(&inputs.roughness_variance),
        with_metal: load(&inputs.roughness_with_metal),
    }
}

/// Stores the colours of as many places as `out` has, with an alpha of 0.
#[inline(always)]
fn store_colours<S: Simd>(colours: &[f32x16<S>; 3], out: &mut [Vec4]) {
    let mut rgb = [[0.0; LANES]; 3];
    for k in 0..3 {
        colours[k].store_slice(&mut rgb[k]);
    }
    for (lane, colour) in out.iter_mut().enumerate() {
        *colour = Vec4::new(rgb[0][lane], rgb[1][lane], rgb[2][lane], 0.0);
    }
}

/// One over the share of metal, 0 where there is none, and the colour of the metal in a footprint.
#[inline(always)]
fn colours_of_metal<S: Simd>(
    simd: S,
    metal: f32x16<S>,
    base: &[f32x16<S>; 3],
    with_metal: &[f32x16<S>; 3],
) -> (f32x16<S>, [f32x16<S>; 3]) {
    let splat = |x: f32| f32x16::splat(simd, x);
    let (zero, one) = (splat(0.0), splat(1.0));
    let is_metal = metal.simd_gt(splat(LEAST_METAL));
    let per_metal = is_metal.select(one / metal.max(splat(LEAST_METAL)), zero);
    let metals = [
        (base[0] + with_metal[0] * per_metal).max(zero),
        (base[1] + with_metal[1] * per_metal).max(zero),
        (base[2] + with_metal[2] * per_metal).max(zero),
    ];
    (per_metal, metals)
}

/// The metal and the paint of footprints, for the light that leaves them late.
struct Footprint<S: Simd> {
    /// The reflectance of paint along its normal and at grazing angles.
    paint_f0: [f32x16<S>; 3],
    paint_f90: f32x16<S>,
    metal: f32x16<S>,
    /// One over it; 0 where there is none.
    per_metal: f32x16<S>,
    metals: [f32x16<S>; 3],
    base: [f32x16<S>; 3],
    with_metal: [f32x16<S>; 3],
}

impl<S: Simd> Footprint<S> {
    #[inline(always)]
    fn new<const LAYERS: bool>(simd: S, inputs: &Inputs) -> Self {
        let metal = f32x16::from_slice(simd, &inputs.metal);
        let base = load_3(simd, &inputs.base);
        let with_metal = load_3(simd, &inputs.base_with_metal);
        let (per_metal, metals) = colours_of_metal(simd, metal, &base, &with_metal);
        let (paint_f0, paint_f90) = match LAYERS {
            true => inputs.layers.paint(simd),
            false => (
                [f32x16::splat(simd, DIELECTRIC); 3],
                f32x16::splat(simd, 1.0),
            ),
        };
        Self {
            paint_f0,
            paint_f90,
            metal,
            per_metal,
            metals,
            base,
            with_metal,
        }
    }

    /// Adds the light that a lobe reflects once.
    #[inline(always)]
    fn add_lobe<const LAYERS: bool>(
        &self,
        simd: S,
        light: (&Environment, &Shaded<S>),
        (place, lobe, even): (&Place<S>, &Lobe<S>, &EvenResponse),
        count: usize,
        mirror: &mut [f32x16<S>; 3],
    ) {
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let (scale, offset) = even.of_even_light(simd);
        let (seen, looks) = seen_in_lobe(simd, light, (&place.directions(), even), count);
        let mut f0 = [zero; 3];
        // Reflected at grazing angles.
        let f90 = match LAYERS {
            true => self.paint_f90 + (one - self.paint_f90) * lobe.metal,
            false => one,
        };
        for k in 0..3 {
            f0[k] = self.paint_f0[k] + (self.metals[k] - self.paint_f0[k]) * lobe.metal;
            mirror[k] += (f0[k] * scale + f90 * offset) * seen[k] * lobe.weight;
        }
        let met = LitSurface {
            normal: place.normal,
            eye: place.eye,
            cosine: place.cosine,
            roughness: lobe.roughness,
            variance: place.variance,
        };
        add_suns(simd, light, (&met, &looks, lobe.weight), (&f0, f90), mirror);
    }

    /// The shares of even light that bounce between facets, or scatter below the surface, before they leave; and those that pass
    /// through the surface instead, as much as `glass` of them. Without it paint reflects alike in all colours.
    #[inline(always)]
    fn multiple_scattering(
        &self,
        simd: S,
        once: &SingleScattering<S>,
        glass: Option<f32x16<S>>,
    ) -> ([f32x16<S>; 3], [f32x16<S>; 3]) {
        let splat = |x: f32| f32x16::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        // Each of the two is whole by itself; light that bounces is no line in f0, so that their mix is not that of a mixed f0.
        let paint = one - self.metal;
        let per_paint = one / paint.max(splat(LEAST_METAL));
        let of_metal = once.of(self.per_metal);
        let of_paint = once.of(zero - per_paint);
        let (mut further, mut through) = ([zero; 3], [zero; 3]);
        let mut scattered = of_paint.scattered(simd, (self.paint_f0[0], self.paint_f90));
        for (k, further) in further.iter_mut().enumerate() {
            if glass.is_some() {
                scattered = of_paint.scattered(simd, (self.paint_f0[k], self.paint_f90));
            }
            let (first, often_of_paint) = scattered;
            let below = (one - first - often_of_paint).max(zero);
            let (_, often_of_metal) = of_metal.scattered(simd, (self.metals[k], one));
            let often = often_of_paint * paint + often_of_metal * self.metal;
            let matt = self.base[k] * (below * paint) - self.with_metal[k] * below;
            let matt = matt.max(zero);
            *further = often + matt;
            if let Some(glass) = glass {
                through[k] = matt * glass;
                *further -= through[k];
            }
        }
        (further, through)
    }
}

/// The reflection of even light by a footprint: means over its lobes, and how both go with metal.
struct SingleScattering<S: Simd> {
    scale: f32x16<S>,
    offset: f32x16<S>,
    scale_with_metal: f32x16<S>,
    offset_with_metal: f32x16<S>,
}

impl<S: Simd> SingleScattering<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self {
            scale: zero,
            offset: zero,
            scale_with_metal: zero,
            offset_with_metal: zero,
        }
    }

    #[inline(always)]
    fn add(
        &mut self,
        lobe: &Lobe<S>,
        (scale, offset): (f32x16<S>, f32x16<S>),
        more_metal: f32x16<S>,
    ) {
        let (scale, offset) = (scale * lobe.weight, offset * lobe.weight);
        self.scale += scale;
        self.offset += offset;
        self.scale_with_metal += scale * more_metal;
        self.offset_with_metal += offset * more_metal;
    }

    /// Scale and offset of a part of the footprint: of the metal by one over its share, of the paint by the same, negative.
    #[inline(always)]
    fn of(&self, per_share: f32x16<S>) -> EvenReflection<S> {
        EvenReflection {
            scale: self.scale + self.scale_with_metal * per_share,
            offset: self.offset + self.offset_with_metal * per_share,
        }
    }
}

/// The reflection of even light by a part of a footprint.
struct EvenReflection<S: Simd> {
    scale: f32x16<S>,
    offset: f32x16<S>,
}

impl<S: Simd> EvenReflection<S> {
    /// The light that leaves at once, and the light that leaves after it has bounced between facets.
    #[inline(always)]
    fn scattered(&self, simd: S, (f0, f90): (f32x16<S>, f32x16<S>)) -> (f32x16<S>, f32x16<S>) {
        let one = f32x16::splat(simd, 1.0);
        let bounced = one - (self.scale + self.offset);
        let once = f0 * self.scale + f90 * self.offset;
        let average = f0 + (f90 - f0) * f32x16::splat(simd, 1.0 / 21.0);
        (once, once * average * bounced / (one - average * bounced))
    }
}

// A footprint whose roughness or metal varies, as one or two lobes.
//
// Takes the mean of metal, the mean and the variance of roughness, and the covariance of both; gives roughnesses, each with a weight and a
// metal of its own, that have these moments. Two lobes lie a deviation to either side of the mean, half of the footprint each, as
// far as their metals lie within 0..=1; where roughness follows metal the weights move until one lobe is all metal or all
// paint. So rough silver beside smooth paint are those two, and not two mixtures of both.

/// Variance of roughness from which on it is two lobes: below, they differ by less than a level of the environment.
const TWO_LOBES: f32 = 0.0016;

/// The least part of a footprint that is a lobe of its own.
const LEAST_PART: f32 = 1e-3;

/// Added to squares that may be 0.
const TINY: f32 = 1e-20;

/// One of the lobes.
pub(super) struct Lobe<S: Simd> {
    pub(super) weight: f32x16<S>,
    pub(super) roughness: f32x16<S>,
    pub(super) metal: f32x16<S>,
}

/// Means, variance and covariance over a footprint.
struct FootprintMoments<S: Simd> {
    pub(super) metal: f32x16<S>,
    pub(super) roughness: f32x16<S>,
    /// Variance of roughness.
    pub(super) variance: f32x16<S>,
    /// Covariance of roughness and metal.
    pub(super) with_metal: f32x16<S>,
}

impl<S: Simd> FootprintMoments<S> {
    /// The lobes, and how many of them differ.
    #[inline(always)]
    pub(super) fn lobes(&self, simd: S) -> ([Lobe<S>; 2], usize) {
        let splat = |x: f32| f32x16::splat(simd, x);
        let (zero, one, tiny) = (splat(0.0), splat(1.0), splat(TINY));
        let apart = self.variance.simd_gt(splat(TWO_LOBES));
        if !apart.any_true() {
            let lobe = |weight| Lobe {
                weight,
                roughness: self.roughness.max(zero).min(one),
                metal: self.metal,
            };
            return ([lobe(one), lobe(zero)], 1);
        }
        let spread = apart.select(self.variance.max(zero).sqrt(), zero);
        let paint = one - self.metal;
        // How far metals move with a deviation of roughness; at most as far as two values can.
        let most = (self.metal * paint).max(zero).sqrt();
        let moved = apart.select(self.with_metal / spread.max(splat(1e-6)), zero);
        let moved = moved.max(zero - most).min(most);
        let moved2 = moved * moved;
        let is_up = moved.simd_gt(zero);
        let above = is_up.select(paint, self.metal);
        let below = is_up.select(self.metal, paint);
        // The rougher lobe's part: it has no more metal than 1 and no less than 0, and so has the other.
        let least = moved2 / (moved2 + above * above + tiny);
        let greatest = (below * below + tiny) / (moved2 + below * below + tiny);
        let part = splat(0.5).max(least).min(greatest);
        let part = part.max(splat(LEAST_PART)).min(splat(1.0 - LEAST_PART));
        let odds = ((one - part) / part).sqrt();
        let lobe = |weight: f32x16<S>, away: f32x16<S>| Lobe {
            weight,
            roughness: (self.roughness + spread * away).max(zero).min(one),
            metal: (self.metal + moved * away).max(zero).min(one),
        };
        ([lobe(part, odds), lobe(one - part, zero - one / odds)], 2)
    }
}
