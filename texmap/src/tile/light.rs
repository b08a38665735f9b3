//! The light of surroundings on pixels that are laid as points, and on what backward methods look up.
//!
//! Pixels wait until a vector of them is full; light is then reflected for all of them together. Each counts by the means of its maps
//! over its whole footprint and by the variance of normals there.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::{Vec3, Vec4};
use resample_core::dispatch;
use resample_mesh::scene::{AlphaMode, CoatNormals};

use crate::light::blocked::look::OnTriangle;
use crate::light::layers::LayerInputs;
use crate::light::lobe::Surrounding;
use crate::light::physical::{Inputs, reflect};
use crate::prepare::layers::{Layers, Shares};
use crate::prepare::maps::{mean_normal, variance_magnified, variance_within};
use crate::prepare::{
    COAT, GLASS, MAPS, METALS, NORMALS, PreparedPhysical, REFLECTION, ROUGHNESS, SHEEN,
};
use crate::project::surface::{Batch, MapPlanes, Surface, SurfaceMaps};
use crate::screen::{LANES, Lanes, value};
use crate::texture::ellipse::PIXEL_VARIANCE;
use crate::tile::task::Tile;
use crate::tile::texels::{BASE, EMISSIVE, FIRST_MAP, Texels, look_up_batch};

/// A surface's own colour, and what its light is multiplied by and what is added to it.
struct UnlitColour {
    pub(crate) base: Vec3,
    /// The factor of the base texture's texel.
    factor: Vec3,
    pub(crate) scale: f32,
    /// Emitted light, premultiplied, and alpha.
    pub(crate) added: Vec4,
}

/// The colour of a surface from its base and emissive texture, before light.
#[inline(always)]
fn unlit_colour(
    tile: &Tile,
    surface: &Surface,
    at: [f32; 2],
    (base, emissive): (Vec4, Vec4),
) -> UnlitColour {
    let material = surface.material(tile.frame.scene);
    let factor = surface.factor(at);
    let per_alpha = if base.w > 0.0 { 1.0 / base.w } else { 0.0 };
    let (weight, alpha) = match material.alpha {
        AlphaMode::Opaque => (1.0, 1.0),
        AlphaMode::Mask { .. } => (per_alpha, 1.0),
        AlphaMode::Blend => (per_alpha, (factor.w * base.w).min(1.0)),
    };
    UnlitColour {
        base: (factor * base * weight).truncate(),
        factor: (factor * weight).truncate(),
        scale: alpha,
        added: (surface.emissive_colour * emissive * alpha)
            .truncate()
            .extend(alpha),
    }
}

/// Pixels that wait for their light.
#[derive(Default)]
pub(crate) struct LightBatch {
    inputs: Inputs,
    pixels: [Pixel; LANES],
    count: usize,
}

/// A pixel that waits.
#[derive(Clone, Copy, Default)]
struct Pixel {
    place: usize,
    scale: f32,
    added: Vec4,
}

/// The surface in a pixel.
pub(crate) struct SurfaceSample<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) at_px: [f32; 2],
    pub(crate) base: Vec4,
    pub(crate) emissive: Vec4,
    pub(crate) maps: [Vec4; MAPS],
    pub(crate) normals: NormalMap,
}

/// A normal map under a pixel.
#[derive(Clone, Copy)]
pub(crate) enum NormalMap {
    /// Its texel is the mean of many.
    Minified,
    /// Its texel is the mean of few.
    Magnified {
        /// Texels across the pixel, squared, the mean of both axes.
        side2: f32,
    },
    /// Its texel is that of the pixel's middle.
    LookedUp {
        /// Texels along the longer axis of the pixel, squared.
        long2: f32,
    },
}

/// The normals of a surface under a pixel.
pub(crate) struct Normals {
    /// Their mean, in the world, of length 1.
    normal: Vec3,
    /// Mean square of their distance from it; and how much of that is the mesh's own.
    variance: f32,
    of_surface: f32,
}

/// Normals may vary by so many times the square of a lobe's width (alpha) under a pixel that is lit once. A trade, measured on DamagedHelmet at 300x300 beside
/// Mitsuba: 3 gives 38.2 dB by day and 33.5 in a room with lamps, 0 gives 38.3 and 33.6, and no limit 35.0 and 28.9. Frames of the helmet take up to a fifth longer
/// with 3 than without a limit.
const MOST_VARIANCE: f32 = 3.0;

/// A variance of normals that no mirror shows: it turns reflections by 0.6 degrees, about a texel of the sharpest surroundings.
const LEAST_VARIANCE: f32 = 3e-5;

impl Normals {
    pub(crate) fn new(sample: &SurfaceSample, maps: &SurfaceMaps) -> Self {
        let (mut normal, mut variance) = (Vec3::Z, 0.0);
        if maps.maps[NORMALS].is_some() {
            let texel = sample.maps[NORMALS];
            (normal, variance) = mean_normal(texel);
            match sample.normals {
                NormalMap::Minified => (),
                NormalMap::Magnified { side2 } => variance = variance_magnified(texel, side2),
                NormalMap::LookedUp { long2 } => variance = variance_within(texel, long2),
            }
        }
        let (normal, slopes) = turned(sample.surface, maps, sample.at_px, normal);
        let of_surface = slopes * PIXEL_VARIANCE;
        Self {
            normal,
            variance: variance + of_surface,
            of_surface,
        }
    }

    /// Returns true if they vary too much for one lobe around their mean.
    pub(crate) fn outdo_lobe(&self, tile: &Tile, sample: &SurfaceSample) -> bool {
        let material = sample.surface.material(tile.frame.scene);
        let (Some(maps), Some(physical)) = (&sample.surface.maps, &material.physical) else {
            return false;
        };
        let mut roughness = physical.roughness;
        if maps.maps[ROUGHNESS].is_some() {
            roughness *= sample.maps[ROUGHNESS].y;
        }
        if let Some(layers) = physical.layers.filter(|layers| layers.coat > 0.0)
            && layers.coat_normals == CoatNormals::AsBelow
        {
            roughness = roughness.min(layers.coat_roughness);
        }
        self.variance > MOST_VARIANCE * roughness.powi(4) + LEAST_VARIANCE
    }
}

impl LightBatch {
    /// Adds a pixel, `weight` of it, by its place in the tile.
    pub(crate) fn add(
        &mut self,
        tile: &Tile,
        (place, weight): (usize, f32),
        (sample, normals): (&SurfaceSample, &Normals),
        rgba: &mut [[f32; 4]],
    ) {
        let surface = sample.surface;
        let (Some(maps), Some(physical)) =
            (&surface.maps, &surface.material(tile.frame.scene).physical)
        else {
            return;
        };
        let lane = self.count;
        let own = unlit_colour(tile, surface, sample.at_px, (sample.base, sample.emissive));
        put(physical, maps, (&sample.maps, &own), lane, &mut self.inputs);
        let Normals {
            normal,
            variance,
            of_surface,
        } = *normals;
        let rays = &tile.view.rays;
        let eye = -Vec3::new(
            value(&rays[0], sample.at_px),
            value(&rays[1], sample.at_px),
            value(&rays[2], sample.at_px),
        )
        .normalize_or_zero();
        for k in 0..3 {
            self.inputs.normal[k][lane] = normal[k];
            self.inputs.eye[k][lane] = eye[k];
        }
        self.inputs.variance[lane] = variance;
        if let Some(layers) = &physical.layers {
            let (coat, variance) = match layers.coat_normals {
                CoatNormals::AsBelow => (normal, variance),
                CoatNormals::Smooth => {
                    let of_mesh = [0, 1, 2].map(|k: usize| value(&surface.normal[k], sample.at_px));
                    let of_mesh = Vec3::from(of_mesh).normalize_or_zero();
                    (of_mesh, of_surface)
                }
            };
            let above = &mut self.inputs.layers;
            for k in 0..3 {
                above.coat_normal[k][lane] = coat[k];
            }
            above.coat_variance[lane] = variance;
        }
        if let Some(on) = on_triangle(tile, (surface, maps)) {
            self.inputs.pixels.put_pixel(lane, &on, sample.at_px);
        }
        self.pixels[lane] = Pixel {
            place,
            scale: own.scale * weight,
            added: own.added * weight,
        };
        self.count += 1;
        if self.count == LANES {
            self.finish(tile, rgba);
        }
    }

    /// Lights all pixels that wait.
    pub(crate) fn finish(&mut self, tile: &Tile, rgba: &mut [[f32; 4]]) {
        let count = std::mem::take(&mut self.count);
        let Some(around) = surrounding(tile).filter(|_| count > 0) else {
            return;
        };
        let mut lit = [Vec4::ZERO; LANES];
        let inputs = &mut self.inputs;
        dispatch!(tile.frame.simd, simd => reflect(simd, around, inputs, count, &mut lit));
        if self.inputs.layers.used {
            // The next batch may hold places without layers.
            self.inputs.layers = LayerInputs::default();
        }
        for (pixel, lit) in self.pixels[..count].iter().zip(lit) {
            let sum = &mut rgba[pixel.place];
            *sum = (Vec4::from(*sum) + lit * pixel.scale + pixel.added).to_array();
        }
    }
}

/// The value of a pixel or sub-pixel on a surface: filtered textures times factors, lit, premultiplied.
#[inline(always)]
pub(crate) fn lit(
    tile: &Tile,
    surface: &Surface,
    at: [f32; 2],
    base: Vec4,
    emissive: Vec4,
) -> Vec4 {
    shaded(
        tile,
        surface,
        at,
        surface.light_at(&tile.view, at),
        base,
        emissive,
    )
}

/// As [`lit`], where the light that is reflected is known.
#[inline(always)]
pub(crate) fn shaded(
    tile: &Tile,
    surface: &Surface,
    at: [f32; 2],
    light: f32,
    base: Vec4,
    emissive: Vec4,
) -> Vec4 {
    let material = surface.material(tile.frame.scene);
    let factor = surface.factor(at);
    // Textures of materials with alpha are premultiplied; what their factor's alpha makes of it is still to do.
    let (weight, alpha) = match material.alpha {
        AlphaMode::Opaque => (1.0, 1.0),
        AlphaMode::Mask { .. } => (if base.w > 0.0 { 1.0 / base.w } else { 0.0 }, 1.0),
        AlphaMode::Blend => (factor.w, (factor.w * base.w).min(1.0)),
    };
    let emitted = surface.emissive_colour * emissive * alpha;
    (factor * base * (weight * light) + emitted)
        .truncate()
        .extend(alpha)
}

/// The light around the scene.
fn surrounding<'a>(tile: &'a Tile) -> Option<Surrounding<'a>> {
    let scene = tile.frame.scene;
    Some(Surrounding {
        environment: scene.environment.as_deref()?,
        blocked: tile.frame.blocked,
    })
}

/// A surface with places where light is known.
#[inline(always)]
fn on_triangle<'a>(
    tile: &'a Tile,
    (surface, maps): (&'a Surface, &'a SurfaceMaps),
) -> Option<OnTriangle<'a>> {
    let blocked = tile.frame.blocked?;
    Some(OnTriangle {
        grids: &blocked.grids,
        triangle: maps.lit.as_ref()?,
        over_w: &surface.over_w,
        above: blocked.above,
    })
}

/// A normal of tangent space in the world, and how much the surface's own normal changes from pixel to pixel, squared.
fn turned(surface: &Surface, maps: &SurfaceMaps, at: [f32; 2], normal: Vec3) -> (Vec3, f32) {
    let place = |planes: &[[f32; 3]; 3]| {
        Vec3::new(
            value(&planes[0], at),
            value(&planes[1], at),
            value(&planes[2], at),
        )
    };
    let own = place(&surface.normal);
    let per_length = own.length_recip();
    if !per_length.is_finite() {
        return (Vec3::ZERO, 0.0);
    }
    let up = own * per_length;
    let mut slopes = 0.0;
    for axis in 0..2 {
        let slope = Vec3::from([0, 1, 2].map(|k: usize| surface.normal[k][axis])) * per_length;
        slopes += slope.reject_from_normalized(up).length_squared();
    }
    let tangent = place(&maps.tangent).normalize_or_zero();
    let bitangent = up.cross(tangent) * maps.side;
    let turned = tangent * normal.x + bitangent * normal.y + up * normal.z;
    (turned.normalize_or_zero(), slopes)
}

/// Puts all but normals into what light meets.
#[inline(always)]
fn put(
    physical: &PreparedPhysical,
    maps: &SurfaceMaps,
    (texels, own): (&[Vec4; MAPS], &UnlitColour),
    at: usize,
    inputs: &mut Inputs,
) {
    for k in 0..3 {
        inputs.base[k][at] = own.base[k];
    }
    let (mut roughness, mut metal, mut variance) = (physical.roughness, physical.metal, 0.0);
    if maps.maps[ROUGHNESS].is_some() {
        let [_, rough, of_metal, square] = texels[ROUGHNESS].to_array();
        variance = (square - rough * rough).max(0.0) * roughness * roughness;
        roughness *= rough;
        metal *= of_metal;
    }
    let mut with_metal = Vec4::ZERO;
    if maps.maps[METALS].is_some() {
        let factor = own.factor.extend(physical.roughness) * physical.metal;
        with_metal = texels[METALS] * factor - own.base.extend(roughness) * metal;
    }
    for k in 0..3 {
        inputs.base_with_metal[k][at] = with_metal[k];
    }
    inputs.roughness_with_metal[at] = with_metal.w;
    if let Some(layers) = &physical.layers {
        put_layers(layers, (texels, &maps.maps), at, inputs);
    }
    inputs.roughness[at] = roughness;
    inputs.roughness_variance[at] = variance;
    inputs.metal[at] = metal;
    inputs.open[at] = match physical.occlusion.filter(|&map| maps.maps[map].is_some()) {
        Some(map) => 1.0 + physical.occlusion_strength * (texels[map].x - 1.0),
        None => 1.0,
    };
}

/// Puts layers, and how the dielectric reflects, into what light meets.
fn put_layers(
    layers: &Layers,
    (texels, maps): (&[Vec4; MAPS], &[Option<MapPlanes>; MAPS]),
    at: usize,
    inputs: &mut Inputs,
) {
    // A mesh without coordinates has no texels.
    let shares = |map: usize, shares: Shares| match maps[map] {
        Some(_) => shares,
        None => Shares::default(),
    };
    let number = |has: bool, texel: f32| if has { texel } else { 1.0 };
    let colour = |map: usize, has: bool| match has {
        true => texels[map].truncate(),
        false => Vec3::ONE,
    };
    let of = shares(REFLECTION, layers.reflection);
    let specular = layers.specular * number(of.has_second, texels[REFLECTION].w);
    let dielectric = layers.reflectance * colour(REFLECTION, of.has_first) * specular;
    let above = &mut inputs.layers;
    above.used = true;
    for k in 0..3 {
        above.dielectric[k][at] = dielectric[k];
    }
    above.specular[at] = specular;
    let of = shares(COAT, layers.coated);
    above.coat[at] = layers.coat * number(of.has_first, texels[COAT].x);
    above.coat_roughness[at] = layers.coat_roughness * number(of.has_second, texels[COAT].y);
    let of = shares(SHEEN, layers.of_sheen);
    let sheen = layers.sheen * colour(SHEEN, of.has_first);
    for k in 0..3 {
        above.sheen[k][at] = sheen[k];
    }
    above.sheen_roughness[at] = layers.sheen_roughness * number(of.has_second, texels[SHEEN].w);
    let of = shares(GLASS, layers.of_glass);
    above.glass[at] = layers.glass * number(of.has_first, texels[GLASS].x);
    if layers.absorbed != Vec3::ZERO {
        let left = (-layers.absorbed * number(of.has_second, texels[GLASS].y)).exp();
        for k in 0..3 {
            above.left[k][at] = left[k];
        }
    }
}

// The colours of a batch of sub-pixels: textures looked up, lit.
//
// Under the light of surroundings the maps of light become what light meets, in vectors.

/// Storage for a batch.
#[derive(Default)]
pub(crate) struct BatchBuffers {
    texels: Texels,
    inputs: Inputs,
    /// The shares of red, green and blue that are seen through each place of a glass batch; for others alpha says it.
    pub(crate) through: Option<[[f32; 3]; LANES]>,
}

impl BatchBuffers {
    /// Begins another surface.
    #[inline(always)]
    pub(crate) fn begin_surface(&mut self) {
        self.inputs.pixels.forget();
        if self.inputs.layers.used {
            self.inputs.layers = LayerInputs::default();
        }
        self.through = None;
    }
}

/// The premultiplied colours of a batch, in `out`.
#[inline(always)]
pub(crate) fn shade_batch<S: Simd>(
    tile: &Tile,
    simd: S,
    (surface, batch): (&Surface, &Batch),
    buffers: &mut BatchBuffers,
    out: &mut [Vec4; LANES],
) {
    look_up_batch(simd, tile, (surface, batch), &mut buffers.texels);
    if let Some(maps) = &surface.maps {
        reflect_batch(tile, simd, (surface, maps, batch), buffers, out);
        return;
    }
    let mut light = [1.0; LANES];
    batch
        .light(simd, (surface, &tile.view))
        .store_slice(&mut light);
    let [base, emissive] = [BASE, EMISSIVE].map(|k| &buffers.texels.colours[k]);
    let material = surface.material(tile.frame.scene);
    let plain = material.alpha == AlphaMode::Opaque && surface.emissive_colour == Vec4::ZERO;
    if plain && surface.colours.is_none() {
        let factor = material.base_colour;
        for k in 0..batch.count {
            out[k] = (factor * base[k] * light[k]).truncate().extend(1.0);
        }
        return;
    }
    for k in 0..batch.count {
        out[k] = shaded(tile, surface, batch.at(k), light[k], base[k], emissive[k]);
    }
}

/// The light of surroundings on a batch whose textures are looked up.
#[inline(always)]
fn reflect_batch<S: Simd>(
    tile: &Tile,
    simd: S,
    (surface, maps, batch): (&Surface, &SurfaceMaps, &Batch),
    buffers: &mut BatchBuffers,
    out: &mut [Vec4; LANES],
) {
    let BatchBuffers {
        texels,
        inputs,
        through,
    } = buffers;
    let (Some(around), Some(physical)) = (
        surrounding(tile),
        &surface.material(tile.frame.scene).physical,
    ) else {
        return;
    };
    let (mut scales, mut added) = ([0.0; LANES], [Vec4::ZERO; LANES]);
    let on = on_triangle(tile, (surface, maps));
    for k in 0..batch.count {
        let of = |texture: usize| texels.colours[texture][k];
        let own = unlit_colour(tile, surface, batch.at(k), (of(BASE), of(EMISSIVE)));
        let of_maps = std::array::from_fn(|map| of(FIRST_MAP + map));
        put(physical, maps, (&of_maps, &own), k, inputs);
        (scales[k], added[k]) = (own.scale, own.added);
        if let Some(on) = &on {
            inputs.pixels.put_subpixel(k, on, batch.at(k));
        }
    }
    take_normals(maps, batch.count, texels, inputs);
    turn_normals(tile, simd, (surface, maps, batch), inputs);
    if let Some(layers) = &physical.layers
        && layers.coat_normals == CoatNormals::AsBelow
    {
        inputs.layers.coat_normal = inputs.normal;
        inputs.layers.coat_variance = inputs.variance;
    }
    reflect(simd, around, inputs, batch.count, out);
    for k in 0..batch.count {
        out[k] = out[k] * scales[k] + added[k];
    }
    let is_glass = (physical.layers.as_ref()).is_some_and(|layers| layers.glass > 0.0);
    *through = is_glass.then(|| seen_through(&inputs.layers.through, &mut out[..batch.count]));
}

/// The shares of light behind that are seen through places of glass; their alpha becomes what no colour is seen through.
fn seen_through(through: &[Lanes; 3], colours: &mut [Vec4]) -> [[f32; 3]; LANES] {
    let mut seen = [[0.0; 3]; LANES];
    for (k, (colour, seen)) in colours.iter_mut().zip(&mut seen).enumerate() {
        let cover = colour.w;
        *seen = [0, 1, 2].map(|part: usize| 1.0 - cover + cover * through[part][k]);
        colour.w = 1.0 - seen[0].min(seen[1]).min(seen[2]);
    }
    seen
}

/// Turns normals from tangent space into the world, and adds the variance of the surface's own.
#[inline(always)]
fn turn_normals<S: Simd>(
    tile: &Tile,
    simd: S,
    (surface, maps, batch): (&Surface, &SurfaceMaps, &Batch),
    inputs: &mut Inputs,
) {
    let splat = |x: f32| f32x16::splat(simd, x);
    let zero = splat(0.0);
    let normal = batch.on_3(simd, &surface.normal);
    let tangent = batch.on_3(simd, &maps.tangent);
    let ray = batch.on_3(simd, &tile.view.rays);
    let per_length = one_over_length(simd, &normal);
    let mut slopes = zero;
    for axis in 0..2 {
        let [a, b, c] = [0, 1, 2].map(|k: usize| surface.normal[k][axis]);
        let along =
            (normal[0] * splat(a) + normal[1] * splat(b) + normal[2] * splat(c)) * per_length;
        slopes += splat(a * a + b * b + c * c) - along * along;
    }
    let footprint = tile.frame.filter.spacing_px.powi(2) / 12.0;
    let own = slopes.max(zero) * per_length * per_length * splat(footprint);
    let variance = f32x16::from_slice(simd, &inputs.variance) + own;
    variance.store_slice(&mut inputs.variance);
    let per_tangent = one_over_length(simd, &tangent);
    let per_ray = one_over_length(simd, &ray);
    let (mut n, mut t) = ([zero; 3], [zero; 3]);
    for k in 0..3 {
        n[k] = normal[k] * per_length;
        t[k] = tangent[k] * per_tangent;
        (zero - ray[k] * per_ray).store_slice(&mut inputs.eye[k]);
    }
    if inputs.layers.used {
        for (part, lanes) in n.iter().zip(&mut inputs.layers.coat_normal) {
            part.store_slice(lanes);
        }
        own.store_slice(&mut inputs.layers.coat_variance);
    }
    let side = splat(maps.side);
    let bitangent = [
        (n[1] * t[2] - n[2] * t[1]) * side,
        (n[2] * t[0] - n[0] * t[2]) * side,
        (n[0] * t[1] - n[1] * t[0]) * side,
    ];
    let mut turned = [zero; 3];
    for k in 0..3 {
        let of = |axis: usize| f32x16::from_slice(simd, &inputs.normal[axis]);
        turned[k] = t[k] * of(0) + bitangent[k] * of(1) + n[k] * of(2);
    }
    let per_turned = one_over_length(simd, &turned);
    for (part, out) in turned.iter().zip(&mut inputs.normal) {
        (*part * per_turned).store_slice(out);
    }
}

/// Normals in tangent space and their variance.
#[inline(always)]
fn take_normals(maps: &SurfaceMaps, count: usize, texels: &Texels, inputs: &mut Inputs) {
    let places = match &maps.maps[NORMALS] {
        Some(MapPlanes::Own(_)) => &texels.maps[NORMALS],
        Some(MapPlanes::LikeBase { .. }) => &texels.base,
        None => {
            let [x, y, z]: &mut [Lanes; 3] = &mut inputs.normal;
            (*x, *y, *z) = ([0.0; LANES], [0.0; LANES], [1.0; LANES]);
            inputs.variance = [0.0; LANES];
            return;
        }
    };
    for (k, &texel) in texels.colours[FIRST_MAP + NORMALS][..count]
        .iter()
        .enumerate()
    {
        let (mean, mut variance) = mean_normal(texel);
        if places.is_plain(k) {
            variance = 0.0;
        }
        inputs.normal[0][k] = mean.x;
        inputs.normal[1][k] = mean.y;
        inputs.normal[2][k] = mean.z;
        inputs.variance[k] = variance.max(variance_within(texel, places.long2(k)));
    }
}

/// 0 where the length is.
#[inline(always)]
fn one_over_length<S: Simd>(simd: S, [x, y, z]: &[f32x16<S>; 3]) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let length2 = *x * *x + *y * *y + *z * *z;
    length2
        .simd_gt(zero)
        .select(f32x16::splat(simd, 1.0) / length2.sqrt(), zero)
}
