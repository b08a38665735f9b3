//! A list of samples, a vector at a time: the field, the transfer function, light.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, i32x16, mask32x16, u32x16};
use resample_core::composite::{DepthRule, opacity};

use super::one_by_one;
use crate::bricks::cells::{
    CELL_CORNERS, CELL_ROWS, DifferenceTable, FaceBytes, FromDifferences, GradientTable, Gradients,
    LAST_CELL, Scalars, TABLE_LEN, VERTEX_SIDE,
};
use crate::field::settings::TileContext;
use crate::field::walk::corners::{Corners, vertices};
use crate::field::walk::lists::{
    BetweenSteps, CELL_MASK, LANE_NUMBERS, LANES, Numbers, PIXEL_SHIFT, PackedSamples,
    ShownSamples, vertex,
};
use crate::light::{Lit, share_of_light};
use crate::slabs::table::TransferTable;

/// The field at the samples.
#[inline(always)]
pub(crate) fn interpolate<S: Simd>(simd: S, scalars: &Scalars, samples: &mut PackedSamples) {
    let count = samples.len();
    let table = match scalars {
        Scalars::Numbers(table) => table,
        Scalars::Bytes(faces) => return interpolate_bytes(simd, faces, samples),
    };
    let corners = &mut samples.between.corners;
    for (k, &place) in samples.place[..count].iter().enumerate() {
        one_by_one();
        let place = vertex(place);
        for edge in 0..4 {
            let at = place + CELL_CORNERS[2 * edge];
            corners[2 * edge][k] = table[at];
            corners[2 * edge + 1][k] = table[at + 1];
        }
    }
    for first in (0..count).step_by(LANES) {
        let range = first..first + LANES;
        let mut values = [f32x16::splat(simd, 0.0); 8];
        for (value, corner) in values.iter_mut().zip(&samples.between.corners) {
            *value = f32x16::from_slice(simd, &corner[range.clone()]);
        }
        let share = shares(simd, &samples.share, first);
        Corners { values }
            .interpolated(share)
            .store_slice(&mut samples.scalar[range]);
    }
}

/// The field at samples among bytes.
#[inline(always)]
fn interpolate_bytes<S: Simd>(simd: S, faces: &FaceBytes, samples: &mut PackedSamples) {
    let count = samples.len();
    let [front, back] = &mut samples.between.faces;
    for k in 0..count {
        one_by_one();
        let cell = (samples.place[k] & CELL_MASK) as usize;
        front[k] = faces[cell];
        back[k] = faces[cell + CELL_ROWS];
    }
    for first in (0..count).step_by(LANES) {
        let range = first..first + LANES;
        let [front, back] = &samples.between.faces;
        let front = u32x16::from_slice(simd, &front[range.clone()]);
        let back = u32x16::from_slice(simd, &back[range.clone()]);
        let share = shares(simd, &samples.share, first);
        Corners::of_faces(simd, front, back)
            .interpolated(share)
            .store_slice(&mut samples.scalar[range]);
    }
}

/// The positions of a vector of samples in their cells.
#[inline(always)]
pub(crate) fn shares<S: Simd>(simd: S, share: &[Numbers; 3], first: usize) -> [f32x16<S>; 3] {
    let range = first..first + LANES;
    [
        f32x16::from_slice(simd, &share[0][range.clone()]),
        f32x16::from_slice(simd, &share[1][range.clone()]),
        f32x16::from_slice(simd, &share[2][range]),
    ]
}

/// The scalars of the voxels that are nearest to the samples.
#[inline(always)]
pub(crate) fn nearest(scalars: &Scalars, samples: &mut PackedSamples) {
    for k in 0..samples.len() {
        let mut place = vertex(samples.place[k]);
        let mut stride = 1;
        for share in &samples.share {
            place += if share[k] >= 0.5 { stride } else { 0 };
            stride *= VERTEX_SIDE;
        }
        samples.scalar[k] = scalars.at(place.min(TABLE_LEN - 1));
    }
}

/// Finds what shows something, and its opacity.
#[inline(always)]
pub(crate) fn classify<S: Simd>(simd: S, job: &TileContext, samples: &mut PackedSamples) {
    interpolate(simd, &job.placed.brick.scalars, samples);
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
    if job.spans.is_some() {
        take_parts(&mut units[..count], &samples.part);
    }
    // Beyond the count nothing is shown.
    strength[count..count + LANES].fill(0.0);
    samples.shown.count = 0;
    let with_depth = settings.sheets.depth == DepthRule::Expected;
    let with_share = settings.is_lit();
    for first in (0..count).step_by(LANES) {
        let range = first..first + LANES;
        let strength = f32x16::from_slice(simd, &samples.between.strength[range.clone()]);
        let seen = strength.simd_gt(f32x16::splat(simd, 0.0));
        if seen.all_false() {
            continue;
        }
        let units = f32x16::from_slice(simd, &samples.between.units[range]);
        let alpha = opacity(simd, settings.sheets.opacity, strength * units);
        append_shown(
            simd,
            samples,
            (first, seen),
            alpha,
            (with_depth, with_share),
        );
    }
}

/// Leaves of each slab the part that surfaces leave.
#[inline(always)]
pub(crate) fn take_parts(units: &mut [f32], parts: &[f32]) {
    for (units, part) in units.iter_mut().zip(parts) {
        *units *= part;
    }
}

/// Appends those of a vector of samples that are seen to the samples that show something.
#[inline(always)]
fn append_shown<S: Simd>(
    simd: S,
    samples: &mut PackedSamples,
    (first, seen): (usize, mask32x16<S>),
    opacity: f32x16<S>,
    (with_depth, with_share): (bool, bool),
) {
    let range = first..first + LANES;
    let shown = &mut samples.shown;
    let at = shown.count..shown.count + LANES;
    opacity
        .compress(seen)
        .store_slice(&mut shown.opacity[at.clone()]);
    u32x16::from_slice(simd, &samples.place[range.clone()])
        .compress(seen)
        .store_slice(&mut shown.place[at.clone()]);
    i32x16::from_slice(simd, &samples.between.entry[range.clone()])
        .bitcast::<u32x16<S>>()
        .compress(seen)
        .store_slice(&mut shown.entry[at.clone()]);
    if with_depth {
        f32x16::from_slice(simd, &samples.camera_z[range.clone()])
            .compress(seen)
            .store_slice(&mut shown.camera_z[at.clone()]);
    }
    if with_share {
        for (shown, share) in shown.share.iter_mut().zip(&samples.share) {
            f32x16::from_slice(simd, &share[range.clone()])
                .compress(seen)
                .store_slice(&mut shown[at.clone()]);
        }
    }
    shown.count += seen.to_bitmask().count_ones() as usize;
}

/// Finds the samples that one channel of several shows, and its extinction there.
#[inline(always)]
pub(crate) fn classify_channel<S: Simd>(
    simd: S,
    table: &TransferTable,
    samples: &mut PackedSamples,
    with_share: bool,
) {
    let count = samples.len();
    samples.shown.count = 0;
    for first in (0..count).step_by(LANES) {
        let range = first..first + LANES;
        let values = f32x16::from_slice(simd, &samples.scalar[range.clone()]);
        let entry = &mut samples.between.entry[range.clone()];
        table.places16(simd, values).store_slice(entry);
        let strength = &mut samples.between.strength[range.clone()];
        strength.fill(0.0);
        for (strength, &entry) in strength.iter_mut().zip(&*entry).take(count - first) {
            *strength = table.strength(entry);
        }
        let strength = f32x16::from_slice(simd, strength);
        let seen = strength.simd_gt(f32x16::splat(simd, 0.0));
        if seen.all_false() {
            continue;
        }
        let numbers = u32x16::from_slice(simd, &LANE_NUMBERS) + u32x16::splat(simd, first as u32);
        let at = samples.shown.count;
        numbers
            .compress(seen)
            .store_slice(&mut samples.shown.number[at..at + LANES]);
        append_shown(simd, samples, (first, seen), strength, (false, with_share));
    }
}

/// Lights the samples that show something by these gradients.
#[inline(always)]
pub(crate) fn light<S: Simd>(
    simd: S,
    job: &TileContext,
    gradients: Option<&Gradients>,
    samples: &mut PackedSamples,
) {
    if let (Some(_), Some(gradients)) = (&job.settings.sheets.shade, gradients) {
        find_gradients(simd, job, gradients, samples);
    }
    shade(simd, job, gradients.is_some(), samples);
}

/// The gradients of samples that show something.
#[inline(always)]
pub(crate) fn find_gradients<S: Simd>(
    simd: S,
    job: &TileContext,
    gradients: &Gradients,
    samples: &mut PackedSamples,
) {
    let PackedSamples { shown, between, .. } = samples;
    match gradients {
        Gradients::Vectors(table) => of_vectors(simd, table, shown, between),
        Gradients::Differences(table) => {
            let from = &job.settings.from_differences;
            of_differences(simd, (table, from), shown, between);
        }
    }
}

/// Lights the samples that show something, if their gradients were found; others have their own colour.
#[inline(always)]
pub(crate) fn shade<S: Simd>(
    simd: S,
    job: &TileContext,
    has_gradients: bool,
    samples: &mut PackedSamples,
) {
    let shown = &mut samples.shown;
    let Some(shade) = job.settings.sheets.shade.as_ref().filter(|_| has_gradients) else {
        shown.body[..shown.count].fill(1.0);
        shown.highlight[..shown.count].fill(0.0);
        return darken(simd, job, samples);
    };
    if shade.has_highlight() {
        look_up_rays(job, shown, &mut samples.between.ray);
    }
    let BetweenSteps { gradient, ray, .. } = &samples.between;
    for first in (0..shown.count).step_by(LANES) {
        let range = first..first + LANES;
        let lit = shade.light(
            simd,
            shares(simd, gradient, first),
            shares(simd, ray, first),
        );
        lit.body.store_slice(&mut shown.body[range.clone()]);
        lit.highlight.store_slice(&mut shown.highlight[range]);
    }
    darken(simd, job, samples);
}

/// Lets as much light through to the samples that show something as reaches them, where shadows or occlusion are drawn.
#[inline(always)]
fn darken<S: Simd>(simd: S, job: &TileContext, samples: &mut PackedSamples) {
    let (gains, light) = (job.settings.gains, job.placed.light);
    if let (Some(gain), Some(faces)) = (gains.sun, light.sun) {
        darken_by(simd, faces, samples, |lit, root| {
            lit.shadowed(simd, share_of_light(simd, root, gain))
        });
    }
    if let (Some(gain), Some(faces)) = (gains.sky, light.sky) {
        let has_shadows = light.sun.is_some();
        darken_by(simd, faces, samples, |lit, root| {
            lit.occluded(simd, share_of_light(simd, root, gain), has_shadows)
        });
    }
}

/// Changes the light on samples by what a table holds at their places.
#[inline(always)]
fn darken_by<S: Simd>(
    simd: S,
    faces: &FaceBytes,
    samples: &mut PackedSamples,
    change: impl Fn(Lit<f32x16<S>>, f32x16<S>) -> Lit<f32x16<S>>,
) {
    let PackedSamples { shown, between, .. } = samples;
    let [front, back] = &mut between.faces;
    for (k, &place) in shown.place[..shown.count].iter().enumerate() {
        one_by_one();
        let cell = (place & CELL_MASK) as usize;
        front[k] = faces[cell];
        back[k] = faces[cell + CELL_ROWS];
    }
    for first in (0..shown.count).step_by(LANES) {
        let range = first..first + LANES;
        let front = u32x16::from_slice(simd, &front[range.clone()]);
        let back = u32x16::from_slice(simd, &back[range.clone()]);
        let share = shares(simd, &shown.share, first);
        let root = Corners::of_faces(simd, front, back).interpolated(share);
        let lit = Lit {
            body: f32x16::from_slice(simd, &shown.body[range.clone()]),
            highlight: f32x16::from_slice(simd, &shown.highlight[range.clone()]),
        };
        let lit = change(lit, root);
        lit.body.store_slice(&mut shown.body[range.clone()]);
        lit.highlight.store_slice(&mut shown.highlight[range]);
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
        let share = shares(simd, &shown.share, first);
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
