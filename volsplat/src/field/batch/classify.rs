//! A list of samples, a vector at a time: the field, the transfer function, light.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, i32x16, u32x16};
use resample_core::composite::{DepthRule, opacity};

use super::interpolate::interpolate;
use super::one_by_one;
use super::scan::vertices;
use crate::bricks::cells::FromDifferences;
use crate::bricks::cells::{CELL_CORNERS, LAST_CELL, TABLE_LEN, VERTEX_SIDE};
use crate::bricks::cells::{DifferenceTable, GradientTable, Gradients};
use crate::field::settings::TileContext;
use crate::field::walk::lists::{
    BetweenSteps, CELL_MASK, LANES, Numbers, PIXEL_SHIFT, PackedSamples, ShownSamples, vertex,
};

/// Finds what shows something, and its opacity.
#[inline(always)]
pub(crate) fn classify<S: Simd>(simd: S, job: &TileContext, samples: &mut PackedSamples) {
    interpolate(simd, job.placed.brick, samples);
    let settings = job.settings;
    let table = &settings.sheets.table;
    let count = samples.len();
    let BetweenSteps {
        entry,
        strength,
        units,
        ..
    } = &mut samples.between;
    for first in (0..count).step_by(LANES) {
        let values = f32x16::from_slice(simd, &samples.scalar[first..first + LANES]);
        table
            .places16(simd, values)
            .store_slice(&mut entry[first..first + LANES]);
    }
    let units_per_slab = job.view.units_per_slab.as_flattened();
    for k in 0..count {
        one_by_one();
        strength[k] = table.strength(entry[k]);
        units[k] = units_per_slab[(samples.place[k] >> PIXEL_SHIFT) as usize % (LANES * LANES)];
    }
    // Beyond the count nothing is shown.
    strength[count..count + LANES].fill(0.0);
    let shown = &mut samples.shown;
    shown.count = 0;
    let with_depth = settings.sheets.depth == DepthRule::Expected;
    let with_light = settings.sheets.shade.is_some();
    for first in (0..count).step_by(LANES) {
        let range = first..first + LANES;
        let load = |numbers: &Numbers| f32x16::from_slice(simd, &numbers[range.clone()]);
        let strength = load(strength);
        let seen = strength.simd_gt(f32x16::splat(simd, 0.0));
        let found = seen.to_bitmask().count_ones() as usize;
        if found == 0 {
            continue;
        }
        let alpha = opacity(simd, settings.sheets.opacity, strength * load(units));
        let at = shown.count..shown.count + LANES;
        alpha
            .compress(seen)
            .store_slice(&mut shown.opacity[at.clone()]);
        u32x16::from_slice(simd, &samples.place[range.clone()])
            .compress(seen)
            .store_slice(&mut shown.place[at.clone()]);
        i32x16::from_slice(simd, &entry[range.clone()])
            .bitcast::<u32x16<S>>()
            .compress(seen)
            .store_slice(&mut shown.entry[at.clone()]);
        if with_depth {
            load(&samples.camera_z)
                .compress(seen)
                .store_slice(&mut shown.camera_z[at.clone()]);
        }
        if with_light {
            for axis in 0..3 {
                load(&samples.share[axis])
                    .compress(seen)
                    .store_slice(&mut shown.share[axis][at.clone()]);
            }
        }
        shown.count += found;
    }
}

/// Lights the samples that show something.
#[inline(always)]
pub(crate) fn light<S: Simd>(simd: S, job: &TileContext, samples: &mut PackedSamples) {
    let shown = &mut samples.shown;
    let (Some(shade), Some(gradients)) = (
        job.settings.sheets.shade.as_ref(),
        job.placed.brick.gradients.as_ref(),
    ) else {
        // What is not lit has its own colour.
        shown.body[..shown.count].fill(1.0);
        shown.highlight[..shown.count].fill(0.0);
        return;
    };
    match gradients {
        Gradients::Vectors(table) => of_vectors(simd, table, shown, &mut samples.between),
        Gradients::Differences(table) => {
            let from = &job.settings.from_differences;
            of_differences(simd, (table, from), shown, &mut samples.between);
        }
    }
    if shade.has_highlight() {
        look_up_rays(job, shown, &mut samples.between.ray);
    }
    let BetweenSteps { gradient, ray, .. } = &samples.between;
    for first in (0..shown.count).step_by(LANES) {
        let range = first..first + LANES;
        let load = |numbers: &Numbers| f32x16::from_slice(simd, &numbers[range.clone()]);
        let lit = shade.light(
            simd,
            [load(&gradient[0]), load(&gradient[1]), load(&gradient[2])],
            [load(&ray[0]), load(&ray[1]), load(&ray[2])],
        );
        lit.body.store_slice(&mut shown.body[range.clone()]);
        lit.highlight
            .store_slice(&mut shown.highlight[range.clone()]);
    }
}

/// The rays of samples that show something: their three parts in one pass.
#[inline(always)]
fn look_up_rays(job: &TileContext, shown: &ShownSamples, ray: &mut [Numbers; 3]) {
    let [x, y, z] = &job.view.ray_in_world;
    let (x, y, z) = (x.as_flattened(), y.as_flattened(), z.as_flattened());
    for (k, &place) in shown.place[..shown.count].iter().enumerate() {
        one_by_one();
        let pixel = (place >> PIXEL_SHIFT) as usize % (LANES * LANES);
        ray[0][k] = x[pixel];
        ray[1][k] = y[pixel];
        ray[2][k] = z[pixel];
    }
}

/// The gradients of samples that show something, from vectors.
#[inline(always)]
fn of_vectors<S: Simd>(
    simd: S,
    table: &GradientTable,
    shown: &ShownSamples,
    between: &mut BetweenSteps,
) {
    for k in 0..shown.count {
        let vector = gradient_at(simd, table, shown, k);
        let parts = between.gradient.iter_mut().zip(vector);
        parts.for_each(|(part, value)| part[k] = value);
    }
}

/// The same from differences of bytes: looked up one by one, and mixed a vector at a time.
#[inline(always)]
fn of_differences<S: Simd>(
    simd: S,
    (table, from): (&DifferenceTable, &FromDifferences),
    shown: &ShownSamples,
    between: &mut BetweenSteps,
) {
    let BetweenSteps {
        gradient,
        vertex,
        differences,
        ..
    } = between;
    for first in (0..shown.count).step_by(LANES) {
        let range = first..first + LANES;
        let place = u32x16::from_slice(simd, &shown.place[range.clone()]);
        vertices(simd, place & u32x16::splat(simd, CELL_MASK)).store_slice(&mut vertex[range]);
    }
    for (k, &place) in vertex[..shown.count].iter().enumerate() {
        one_by_one();
        let place = (place as usize).min(LAST_CELL);
        for edge in 0..4 {
            let at = place + CELL_CORNERS[2 * edge];
            differences[edge][k] = [table[at], table[at + 1]];
        }
    }
    for first in (0..shown.count).step_by(LANES) {
        let range = first..first + LANES;
        let mut corners = [u32x16::splat(simd, 0); 8];
        for edge in 0..4 {
            let pairs = differences[edge][range.clone()].as_flattened();
            let (first, second) = (
                u32x16::from_slice(simd, &pairs[..LANES]),
                u32x16::from_slice(simd, &pairs[LANES..]),
            );
            (corners[2 * edge], corners[2 * edge + 1]) = first.deinterleave(second);
        }
        let share = [
            f32x16::from_slice(simd, &shown.share[0][range.clone()]),
            f32x16::from_slice(simd, &shown.share[1][range.clone()]),
            f32x16::from_slice(simd, &shown.share[2][range.clone()]),
        ];
        let found = from.gradient16(simd, &corners, &share);
        for (part, numbers) in found.into_iter().zip(gradient.iter_mut()) {
            part.store_slice(&mut numbers[range.clone()]);
        }
    }
}

/// The trilinear mix of the vectors at the corners of a sample's cell, a vector at a time: eight loads instead of
/// twenty-four.
#[inline(always)]
fn gradient_at<S: Simd>(
    simd: S,
    table: &GradientTable,
    shown: &ShownSamples,
    number: usize,
) -> [f32; 4] {
    let place = vertex(shown.place[number]);
    let share = |axis: usize| f32x4::splat(simd, shown.share[axis][number]);
    let (x, y, z) = (share(0), share(1), share(2));
    let front = face_of(simd, table, place, x, y);
    let back = face_of(simd, table, place + TABLE_LEN / VERTEX_SIDE, x, y);
    (back - front).mul_add(z, front).to_array()
}

/// The mix over four corners.
#[inline(always)]
fn face_of<S: Simd>(
    simd: S,
    table: &GradientTable,
    place: usize,
    x: f32x4<S>,
    y: f32x4<S>,
) -> f32x4<S> {
    let load = |k: usize| f32x4::from_slice(simd, &table[place + CELL_CORNERS[k]]);
    let (a, b, c, d) = (load(0), load(1), load(2), load(3));
    let (near, far) = ((b - a).mul_add(x, a), (d - c).mul_add(x, c));
    (far - near).mul_add(y, near)
}
