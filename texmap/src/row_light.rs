//! The light of surroundings on a row of sub-pixels: the maps of light are looked up, and light is reflected in vectors.
//!
//! Takes a row whose base colours are looked up; gives premultiplied colours in their place. Maps that are laid as the base
//! texture is share its places.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::Vec4;

use crate::lanes::{IOTA, LANES};
use crate::light::physical::{Inputs, reflect};
use crate::lookup::small_footprint;
use crate::maps::{mean_normal, variance_within};
use crate::pixel_light::straight;
use crate::places::Places;
use crate::prepare::{MAPS, NORMALS};
use crate::row::{RowRun, RowWork, look_up_row};
use crate::surface::{MapPlanes, SurfaceMaps};
use crate::tile::Tile;

/// Lights those of the first `count` runs of a row that reflect their surroundings.
#[inline(always)]
pub(crate) fn light_row<S: Simd>(simd: S, tile: &Tile, work: &mut RowWork, count: usize) {
    for map in 0..MAPS {
        look_up_map(simd, tile, work, (map, count));
    }
    let RowWork {
        colours,
        base,
        map_places,
        inputs,
        runs,
        ..
    } = work;
    let (mut first, mut end) = (usize::MAX, 0);
    for run in runs[..count].iter().flatten() {
        let Some(maps) = &run.surface.maps else {
            continue;
        };
        let places = match &maps.maps[NORMALS] {
            Some(MapPlanes::Own(_)) => &map_places[NORMALS],
            _ => &*base,
        };
        let columns = run.column..run.column + run.run.len;
        for at in columns.clone() {
            tile.take_maps(run, at, (&colours.maps, colours.base[at]), inputs);
        }
        if maps.maps[NORMALS].is_some() {
            take_normals(&colours.maps[NORMALS], places, columns.clone(), inputs);
        } else {
            for at in columns.clone() {
                inputs.normal[0][at] = 0.0;
                inputs.normal[1][at] = 0.0;
                inputs.normal[2][at] = 1.0;
                inputs.variance[at] = 0.0;
            }
        }
        let subpixel = tile.frame.filter.spacing_px.powi(2) / 12.0;
        let mut done = 0;
        while done < run.run.len {
            turn_normals(simd, (tile, run, maps), done, subpixel, inputs);
            done += LANES;
        }
        (first, end) = (first.min(columns.start), end.max(columns.end));
    }
    let Some(environment) = &tile.frame.scene.environment else {
        return;
    };
    let mut lit = [Vec4::ZERO; LANES];
    let mut at = first;
    while at < end {
        let some = LANES.min(end - at);
        reflect(simd, environment, inputs, (at, some), &mut lit);
        for run in runs[..count].iter().flatten() {
            if run.surface.maps.is_none() {
                continue;
            }
            let last = (run.column + run.run.len).min(at + some);
            for column in run.column.max(at)..last {
                let seen = (colours.base[column], colours.emissive[column]);
                let at_px = run.run.at(column - run.column);
                let shown = straight(tile, run.surface, at_px, seen);
                colours.base[column] = lit[column - at] * shown.scale + shown.added;
            }
        }
        at += some;
    }
}

/// Looks one map up for the runs of a row that have it.
#[inline(always)]
fn look_up_map<S: Simd>(simd: S, tile: &Tile, work: &mut RowWork, (map, count): (usize, usize)) {
    let RowWork {
        colours,
        base,
        map_places,
        runs,
        ..
    } = work;
    let side_px = tile.frame.filter.spacing_px;
    let out = &mut colours.maps[map];
    let (mut own, mut like_base) = (false, false);
    for RowRun {
        surface,
        run,
        column,
    } in runs[..count].iter().flatten()
    {
        let planes = surface
            .maps
            .as_ref()
            .and_then(|maps| maps.maps[map].as_ref());
        match planes {
            None => {}
            Some(MapPlanes::Own(planes)) => {
                own = true;
                let places = (&mut map_places[map], &mut *out);
                tile.place_run(simd, surface, Some(planes), (run, *column), places);
            }
            Some(MapPlanes::LikeBase { pyramid }) => {
                like_base = true;
                let pyramid = &tile.frame.scene.pyramids[*pyramid];
                out[*column..*column + run.len].fill(Vec4::ZERO);
                let Some(planes) = &surface.base else {
                    continue;
                };
                for k in 0..run.len {
                    if base.count[column + k] == 0.0 {
                        let uv = surface.uv_at(planes, run.at(k));
                        out[column + k] = small_footprint(pyramid, &uv, side_px, &planes.borders);
                    }
                }
            }
        }
    }
    let runs = &runs[..count];
    if like_base {
        let pyramid =
            |surface: &crate::surface::Surface| match surface.maps.as_ref()?.maps[map].as_ref()? {
                MapPlanes::LikeBase { pyramid } => Some(*pyramid),
                MapPlanes::Own(_) => None,
            };
        look_up_row(simd, tile, runs, pyramid, (base, &mut *out));
    }
    if own {
        let pyramid =
            |surface: &crate::surface::Surface| match surface.maps.as_ref()?.maps[map].as_ref()? {
                MapPlanes::LikeBase { .. } => None,
                MapPlanes::Own(planes) => Some(planes.pyramid),
            };
        look_up_row(simd, tile, runs, pyramid, (&map_places[map], out));
    }
}

/// Normals in tangent space and their variance.
#[inline(always)]
fn take_normals(
    texels: &[Vec4],
    places: &Places,
    columns: std::ops::Range<usize>,
    inputs: &mut Inputs,
) {
    for at in columns {
        let (mean, mut variance) = mean_normal(texels[at]);
        if places.is_plain(at) {
            variance = 0.0;
        }
        inputs.normal[0][at] = mean.x;
        inputs.normal[1][at] = mean.y;
        inputs.normal[2][at] = mean.z;
        inputs.variance[at] = variance.max(variance_within(texels[at], places.long2(at)));
    }
}

/// Turns sixteen normals from tangent space into the world, and adds the variance of the surface's own.
#[inline(always)]
fn turn_normals<S: Simd>(
    simd: S,
    (tile, run, maps): (&Tile, &RowRun, &SurfaceMaps),
    done: usize,
    footprint: f32,
    inputs: &mut Inputs,
) {
    let splat = |x: f32| f32x16::splat(simd, x);
    let zero = splat(0.0);
    let x = f32x16::from_slice(simd, &IOTA) + splat(done as f32);
    let range = run.column + done..run.column + done + LANES;
    let (mut normal, mut tangent, mut ray) = ([zero; 3], [zero; 3], [zero; 3]);
    for k in 0..3 {
        let [slope, start] = run.run.line(&run.surface.normal[k]);
        normal[k] = splat(slope) * x + splat(start);
        let [slope, start] = run.run.line(&maps.tangent[k]);
        tangent[k] = splat(slope) * x + splat(start);
        let [slope, start] = run.run.line(&tile.view.rays[k]);
        ray[k] = splat(slope) * x + splat(start);
    }
    let per_length = one_over_length(simd, &normal);
    let mut slopes = zero;
    for axis in 0..2 {
        let [a, b, c] = [0, 1, 2].map(|k: usize| run.surface.normal[k][axis]);
        let along =
            (normal[0] * splat(a) + normal[1] * splat(b) + normal[2] * splat(c)) * per_length;
        slopes += splat(a * a + b * b + c * c) - along * along;
    }
    let own = slopes.max(zero) * per_length * per_length * splat(footprint);
    let variance = f32x16::from_slice(simd, &inputs.variance[range.clone()]) + own;
    variance.store_slice(&mut inputs.variance[range.clone()]);
    let per_tangent = one_over_length(simd, &tangent);
    let per_ray = one_over_length(simd, &ray);
    let (mut n, mut t) = ([zero; 3], [zero; 3]);
    for k in 0..3 {
        n[k] = normal[k] * per_length;
        t[k] = tangent[k] * per_tangent;
        (zero - ray[k] * per_ray).store_slice(&mut inputs.eye[k][range.clone()]);
    }
    let side = splat(maps.side);
    let bitangent = [
        (n[1] * t[2] - n[2] * t[1]) * side,
        (n[2] * t[0] - n[0] * t[2]) * side,
        (n[0] * t[1] - n[1] * t[0]) * side,
    ];
    let mx = f32x16::from_slice(simd, &inputs.normal[0][range.clone()]);
    let my = f32x16::from_slice(simd, &inputs.normal[1][range.clone()]);
    let mz = f32x16::from_slice(simd, &inputs.normal[2][range.clone()]);
    let mut turned = [zero; 3];
    for k in 0..3 {
        turned[k] = t[k] * mx + bitangent[k] * my + n[k] * mz;
    }
    let per_turned = one_over_length(simd, &turned);
    for (part, out) in turned.iter().zip(&mut inputs.normal) {
        (*part * per_turned).store_slice(&mut out[range.clone()]);
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
