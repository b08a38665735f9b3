//! The colours of a batch of sub-pixels: textures looked up, lit.
//!
//! Under the light of surroundings the maps of light become what light meets, in vectors.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::Vec4;
use resample_mesh::scene::AlphaMode;

use crate::light::physical::{Inputs, reflect};
use crate::prepare::NORMALS;
use crate::prepare::maps::{mean_normal, variance_within};
use crate::project::batch::Batch;
use crate::project::surface::{MapPlanes, Surface, SurfaceMaps};
use crate::screen::lanes::{LANES, Lanes};
use crate::tile::pixel_light::{put, shaded, unlit_colour};
use crate::tile::task::Tile;
use crate::tile::texels::{BASE, EMISSIVE, FIRST_MAP, Texels, look_up_batch};

/// Storage for a batch.
#[derive(Default)]
pub(crate) struct BatchBuffers {
    texels: Texels,
    inputs: Inputs,
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
    let BatchBuffers { texels, inputs } = buffers;
    let (Some(environment), Some(physical)) = (
        &tile.frame.scene.environment,
        &surface.material(tile.frame.scene).physical,
    ) else {
        return;
    };
    let (mut scales, mut added) = ([0.0; LANES], [Vec4::ZERO; LANES]);
    for k in 0..batch.count {
        let of = |texture: usize| texels.colours[texture][k];
        let own = unlit_colour(tile, surface, batch.at(k), (of(BASE), of(EMISSIVE)));
        let of_maps = [0, 1, 2, 3].map(|map: usize| of(FIRST_MAP + map));
        put(physical, maps, (&of_maps, &own), k, inputs);
        (scales[k], added[k]) = (own.scale, own.added);
    }
    take_normals(maps, batch.count, texels, inputs);
    turn_normals(tile, simd, (surface, maps, batch), inputs);
    reflect(simd, environment, inputs, batch.count, out);
    for k in 0..batch.count {
        out[k] = out[k] * scales[k] + added[k];
    }
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
