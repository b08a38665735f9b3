//! What metal and roughness make of the light around the scene, sixteen places at a time.
//!
//! The model of glTF 2.0, appendix B: a matt layer below GGX, a metal, or the mix of what both give. Light of the environment is split: radiance blurred
//! by the lobe, times the reflectance of even light (Karis 2013), with the light that bounces more than once between
//! facets, and what is left for the matt layer, after Fdez-Agüera (2019). What a footprint covers counts by its variances:
//! that of normals widens the lobe (Tokuyoshi and Kaplanyan 2019; Toksvig 2005), and roughnesses far apart are two lobes.
//!
//! Takes [`Inputs`]; gives reflected light, linear. Metal and paint in one footprint each have their own mean colour and, as `lobes` says, their own
//! roughness. Limits: within each, colour and roughness are taken to be independent.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, i32x16};
use fearless_simd_macros::simd;
use glam::Vec4;

use super::environment::{Environment, LEVELS, Map, WITHOUT_SUNS};
pub(crate) use super::inputs::Inputs;
use super::lobes::{Lobe, Varied};
use super::reflectance;
use super::suns::Met;
use crate::lanes::{LANES, Lanes};

/// What a dielectric reflects at normal incidence: an index of refraction of 1.5.
const DIELECTRIC: f32 = 0.04;

/// The least metal whose colour is known apart from that of paint.
const LEAST_METAL: f32 = 1e-3;

/// The smallest cosine between normal and eye: a normal map may turn a surface away.
const LEAST_COSINE: f32 = 1e-3;

/// Reflects light at the first `count` places.
#[simd]
pub(crate) fn reflect<S: Simd>(
    simd: S,
    environment: &Environment,
    inputs: &Inputs,
    count: usize,
    out: &mut [Vec4; LANES],
) {
    let splat = |x: f32| f32x16::splat(simd, x);
    let load = |lanes: &Lanes| f32x16::from_slice(simd, lanes);
    let (zero, one) = (splat(0.0), splat(1.0));
    let [nx, ny, nz] = load_3(simd, &inputs.normal);
    let [vx, vy, vz] = load_3(simd, &inputs.eye);
    let cosine = nx * vx + ny * vy + nz * vz;
    let twice = cosine + cosine;
    let mirrored = [nx * twice - vx, ny * twice - vy, nz * twice - vz];
    let cosine = cosine.max(splat(LEAST_COSINE)).min(one);
    let variance = load(&inputs.variance);
    let metal = load(&inputs.metal);
    let base = load_3(simd, &inputs.base);
    let with_metal = load_3(simd, &inputs.base_with_metal);
    let of_metal = metal.simd_gt(splat(LEAST_METAL));
    let per_metal = of_metal.select(one / metal.max(splat(LEAST_METAL)), zero);
    let metals = [0, 1, 2].map(|k: usize| (base[k] + with_metal[k] * per_metal).max(zero));
    let varied = Varied {
        metal,
        roughness: load(&inputs.roughness),
        variance: load(&inputs.roughness_variance),
        with_metal: load(&inputs.roughness_with_metal),
    };
    let (lobes, count_of_lobes) = varied.lobes(simd);
    let mut mirror = [zero; 3];
    let mut once = Once::new(simd);
    for lobe in &lobes[..count_of_lobes] {
        let widened = environment
            .reflectance
            .widened(simd, lobe.roughness, variance);
        let mut even = Even::default();
        even.look(simd, environment, (widened, cosine), count);
        let scale = f32x16::from_slice(simd, &even.scale);
        let offset = f32x16::from_slice(simd, &even.offset);
        let turn = f32x16::from_slice(simd, &even.turn);
        let towards = [
            nx + (mirrored[0] - nx) * turn,
            ny + (mirrored[1] - ny) * turn,
            nz + (mirrored[2] - nz) * turn,
        ];
        let level = f32x16::from_slice(simd, &even.lobe);
        let at = Looks::new(simd, &towards, level);
        let mut seen = [[0.0; LANES]; 3];
        look_around(simd, environment, &at, count, &mut seen);
        once.add(lobe, (scale, offset), lobe.metal - metal);
        let dielectric = splat(DIELECTRIC);
        let f0 = metals.map(|metals| dielectric + (metals - dielectric) * lobe.metal);
        for k in 0..3 {
            let radiance = f32x16::from_slice(simd, &seen[k]);
            mirror[k] += (f0[k] * scale + offset) * radiance * lobe.weight;
        }
        let met = Met {
            normal: [nx, ny, nz],
            eye: [vx, vy, vz],
            cosine,
            roughness: lobe.roughness,
            variance,
        };
        add_suns(
            simd,
            environment,
            (&met, level, lobe.weight),
            &f0,
            &mut mirror,
        );
    }
    let mut even = [zero; 3];
    irradiance(simd, environment, [nx, ny, nz], variance, &mut even);
    // Each of the two is whole by itself; light that bounces is no line in f0, so that their mix is not that of a mixed f0.
    let paint = one - metal;
    let per_paint = one / paint.max(splat(LEAST_METAL));
    let of_metal = once.of(per_metal);
    let of_paint = once.of(zero - per_paint);
    let (first, often_of_paint) = of_paint.again(simd, splat(DIELECTRIC));
    let below = (one - first - often_of_paint).max(zero);
    let often_of_paint = often_of_paint * paint;
    let open = load(&inputs.open);
    let mut rgb = [[0.0; LANES]; 3];
    for k in 0..3 {
        let (_, often_of_metal) = of_metal.again(simd, metals[k]);
        let often = often_of_paint + often_of_metal * metal;
        let matt = base[k] * (below * paint) - with_metal[k] * below;
        let sum = mirror[k] + (often + matt.max(zero)) * even[k];
        (sum * open).store_slice(&mut rgb[k]);
    }
    for lane in 0..count {
        out[lane] = Vec4::new(rgb[0][lane], rgb[1][lane], rgb[2][lane], 0.0);
    }
}

/// What a footprint reflects of even light at once: means over its lobes, and how both go with metal.
struct Once<S: Simd> {
    scale: f32x16<S>,
    offset: f32x16<S>,
    scale_with_metal: f32x16<S>,
    offset_with_metal: f32x16<S>,
}

impl<S: Simd> Once<S> {
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
    fn of(&self, per_share: f32x16<S>) -> Part<S> {
        Part {
            scale: self.scale + self.scale_with_metal * per_share,
            offset: self.offset + self.offset_with_metal * per_share,
        }
    }
}

/// What a part of a footprint reflects of even light.
struct Part<S: Simd> {
    scale: f32x16<S>,
    offset: f32x16<S>,
}

impl<S: Simd> Part<S> {
    /// What leaves at once, and what leaves after it has bounced between facets.
    #[inline(always)]
    fn again(&self, simd: S, f0: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        let one = f32x16::splat(simd, 1.0);
        let bounced = one - (self.scale + self.offset);
        let once = f0 * self.scale + self.offset;
        let average = f0 + (one - f0) * f32x16::splat(simd, 1.0 / 21.0);
        (once, once * average * bounced / (one - average * bounced))
    }
}

/// Adds the light of the suns, as far as the looks around of this lobe lack them.
#[inline(always)]
fn add_suns<S: Simd>(
    simd: S,
    environment: &Environment,
    (met, level, weight): (&Met<S>, f32x16<S>, f32x16<S>),
    f0: &[f32x16<S>; 3],
    mirror: &mut [f32x16<S>; 3],
) {
    let splat = |x: f32| f32x16::splat(simd, x);
    let lacking = level * splat((LEVELS - 1) as f32) - splat((WITHOUT_SUNS - 1) as f32);
    let lacking = lacking.max(splat(0.0)).min(splat(1.0));
    for sun in &environment.suns {
        let [plain, fresnel] = met.lit_by(simd, sun);
        for k in 0..3 {
            let light = splat(sun.power[k]) * lacking * weight;
            mirror[k] += (f0[k] * (plain - fresnel) + fresnel) * light;
        }
    }
}

/// Three numbers of each place.
#[inline(always)]
fn load_3<S: Simd>(simd: S, lanes: &[Lanes; 3]) -> [f32x16<S>; 3] {
    [
        f32x16::from_slice(simd, &lanes[0]),
        f32x16::from_slice(simd, &lanes[1]),
        f32x16::from_slice(simd, &lanes[2]),
    ]
}

/// Irradiance over pi; normals that vary see less of its change.
#[inline(always)]
fn irradiance<S: Simd>(
    simd: S,
    environment: &Environment,
    [x, y, z]: [f32x16<S>; 3],
    variance: f32x16<S>,
    out: &mut [f32x16<S>; 3],
) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (zero, one) = (splat(0.0), splat(1.0));
    let first = (one - splat(0.5) * variance).max(zero);
    let second = (one - splat(1.5) * variance).max(zero);
    let basis = [
        one,
        x * first,
        y * first,
        z * first,
        x * y * second,
        y * z * second,
        z * x * second,
        (splat(3.0) * y * y - one) * second,
        (z * z - x * x) * second,
    ];
    for (part, light) in basis.iter().zip(&environment.irradiance) {
        let [r, g, b] = light.to_array();
        out[0] = part.mul_add(splat(r), out[0]);
        out[1] = part.mul_add(splat(g), out[1]);
        out[2] = part.mul_add(splat(b), out[2]);
    }
    for sum in out {
        *sum = sum.max(zero);
    }
}

/// Where to look.
struct Looks {
    /// On the octahedral square, 0..=1.
    x: [f32; LANES],
    y: [f32; LANES],
    /// Level of roughness.
    level: [f32; LANES],
}

impl Looks {
    #[inline(always)]
    fn new<S: Simd>(simd: S, [dx, dy, dz]: &[f32x16<S>; 3], roughness: f32x16<S>) -> Self {
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

/// What a surface makes of even light; see [`reflectance::Reflectance`].
#[derive(Default)]
struct Even {
    scale: [f32; LANES],
    offset: [f32; LANES],
    turn: [f32; LANES],
    lobe: [f32; LANES],
}

impl Even {
    #[inline(always)]
    fn look<S: Simd>(
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
            let table = &environment.reflectance.table;
            let even = four(simd, table, (place, reflectance::SIDE), share);
            self.scale[lane] = even[0];
            self.offset[lane] = even[1];
            self.turn[lane] = even[2];
            self.lobe[lane] = even[3];
        }
    }
}

/// The radiance of the environment.
#[inline(always)]
fn look_around<S: Simd>(
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
fn four<S: Simd>(
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
