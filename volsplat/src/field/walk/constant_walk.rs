//! A far brick of one colour in one tile: the planes of each ray inside the brick are counted and composited at once.
//!
//! The planes k0..k1 are those on which the brick would be sampled, so that neighbouring bricks share their faces
//! however each is drawn: k0 and k1 follow from where the ray crosses the faces of the box, and where
//! rounding could decide otherwise than the sampling of a brick, each plane is asked as it would be there.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::composite::{DepthRule, opacity};

use crate::field::settings::{TileContext, Uniform};
use crate::field::walk::cell_sample::{CellBox, inside, position};
use crate::field::walk::scratch::{FieldScratch, POSITION_ERROR, WeightedRow, Window};
use crate::slabs::view::{HalfRow, LANES, PlaneView};

/// Least movement per plane along an axis, voxels: below it, a ray is taken to run along the faces of that axis.
const LEAST_STEP: f32 = 1e-20;

/// The brick that a tile's rays cross.
struct Crossed<'a> {
    cells: &'a CellBox,
    uniform: Uniform,
    /// Its first plane and its last.
    ends: [PlaneView; 2],
}

/// The planes of the rays of half a row, counted from the brick's first, that lie inside: from..to.
struct Inside<S: Simd> {
    at: HalfRow,
    from: f32x8<S>,
    to: f32x8<S>,
}

/// Composites a brick of one colour. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
pub(crate) fn add_uniform<S: Simd>(
    simd: S,
    job: &TileContext,
    window: Window,
    uniform: Uniform,
    scratch: &mut FieldScratch,
) -> (usize, bool) {
    let settings = job.settings;
    let cells = CellBox::new(job.placed.brick, &settings.sheets.anchor);
    let [first, end] = job.placed.planes;
    let crossed = Crossed {
        cells: &cells,
        uniform,
        ends: [
            *scratch.plane(job.view, first),
            *scratch.plane(job.view, (end - 1).max(first + 1)),
        ],
    };
    let (mut touched, mut seen) = (0, false);
    let halves = window.columns[0] / LANES..window.columns[1].div_ceil(LANES);
    for row in window.rows[0]..window.rows[1] {
        for half in halves.clone() {
            let at = HalfRow {
                row,
                first: half * LANES,
            };
            let Some(inside) = planes_inside(simd, job, &crossed, at, scratch) else {
                continue;
            };
            touched += LANES;
            seen |= composite_step(simd, job, &crossed, &inside, scratch);
        }
    }
    (
        touched,
        seen && scratch
            .pixels
            .is_opaque(simd, settings.sheets.min_transmittance),
    )
}

/// The planes inside a brick's box for the rays of half a row; `None` if no ray has one.
#[inline(always)]
fn planes_inside<S: Simd>(
    simd: S,
    job: &TileContext,
    crossed: &Crossed,
    at: HalfRow,
    scratch: &mut FieldScratch,
) -> Option<Inside<S>> {
    let constant = |v: f32| f32x8::splat(simd, v);
    let Crossed { cells, ends, .. } = crossed;
    let [first, end] = job.placed.planes;
    let per_plane = constant(1.0 / ((end - 1).max(first + 1) - first) as f32);
    let (start, last) = (position(simd, &ends[0], at), position(simd, &ends[1], at));
    let zero = constant(0.0);
    // First and last crossing, each at its earliest and at its latest within the error of positions.
    let mut near = [zero, zero];
    let mut far = [
        constant((end - first) as f32),
        constant((end - first) as f32),
    ];
    for axis in 0..3 {
        let step = (last[axis] - start[axis]) * per_plane;
        let tiny = step.abs().simd_lt(constant(LEAST_STEP));
        let inverse = constant(1.0) / tiny.select(constant(LEAST_STEP), step);
        let low = (constant(cells.low[axis]) - start[axis]) * inverse;
        let high = (constant(cells.high[axis]) - start[axis]) * inverse;
        let error = constant(POSITION_ERROR) * inverse.abs();
        let (into, out) = (low.min(high), low.max(high));
        near = [near[0].max(into - error), near[1].max(into + error)];
        far = [far[0].min(out - error), far[1].min(out + error)];
    }
    let (from, to) = (near[0].ceil(), far[0].ceil());
    // A ray that surely misses is sure, wherever it would enter and leave.
    let misses = near[0].simd_ge(far[1]);
    let sure = (near[1].ceil().simd_eq(from) & far[1].ceil().simd_eq(to)) | misses;
    let (from, to) = if sure.all_true() {
        (misses.select(zero, from), misses.select(zero, to))
    } else {
        counted(simd, job, cells, at, scratch)
    };
    to.simd_gt(from)
        .any_true()
        .then_some(Inside { at, from, to })
}

/// The planes inside, asked one by one.
#[inline(never)]
fn counted<S: Simd>(
    simd: S,
    job: &TileContext,
    cells: &CellBox,
    at: HalfRow,
    scratch: &mut FieldScratch,
) -> (f32x8<S>, f32x8<S>) {
    let [first, end] = job.placed.planes;
    let constant = |v: f32| f32x8::splat(simd, v);
    let (mut from, mut to) = (constant((end - first) as f32), constant(0.0));
    for number in first..end {
        let plane = scratch.plane(job.view, number);
        let within = inside(simd, cells, position(simd, plane, at));
        let here = constant((number - first) as f32);
        from = within.select(from.min(here), from);
        to = within.select(here + constant(1.0), to);
    }
    (from, to)
}

/// Composites the planes inside. Returns whether anything was seen.
#[inline(always)]
fn composite_step<S: Simd>(
    simd: S,
    job: &TileContext,
    crossed: &Crossed,
    inside: &Inside<S>,
    scratch: &mut FieldScratch,
) -> bool {
    let (settings, view, at) = (job.settings, job.view, inside.at);
    let constant = |v: f32| f32x8::splat(simd, v);
    let range = at.first..at.first + LANES;
    let units = f32x8::from_slice(simd, &view.units_per_slab[at.row][range.clone()]);
    let planes = (inside.to - inside.from).max(constant(0.0));
    let [red, green, blue, strength] = crossed.uniform.value;
    let added = planes * units * constant(strength);
    if added.simd_gt(constant(0.0)).all_false() {
        return false;
    }
    let before = f32x8::from_slice(simd, &scratch.pixels.transmittance[at.row][range.clone()]);
    let least = constant(settings.sheets.min_transmittance);
    // Opaque pixels take no more, as on every plane.
    let open = before.simd_ge(least);
    let mut weight = open.select(
        before * opacity(simd, settings.sheets.opacity, added),
        constant(0.0),
    );
    if ((before - weight).simd_lt(least) & open).any_true() {
        let added = until_opaque(
            simd,
            settings.sheets.min_transmittance,
            before,
            units * constant(strength),
            planes,
        );
        weight = open.select(
            before * opacity(simd, settings.sheets.opacity, added),
            constant(0.0),
        );
    }
    let middle = (inside.from + inside.to - constant(1.0)) * constant(0.5);
    let z = middle.mul_add(
        constant(settings.sheets.thickness as f32),
        constant(crossed.ends[0].camera_z),
    );
    let samples = WeightedRow {
        weight,
        camera_z: (settings.sheets.depth == DepthRule::Expected).then_some(z),
        body: weight,
        highlight: constant(0.0),
        rgb: [red, green, blue],
    };
    scratch.pixels.add_row(simd, at, &samples);
    true
}

/// Optical depths of the planes that are composited before a pixel is opaque: sheet by sheet it would end there, and a
/// step must not go on. `added` is the optical depth of one plane, and there are so many planes.
#[inline(never)]
fn until_opaque<S: Simd>(
    simd: S,
    min_transmittance: f32,
    before: f32x8<S>,
    added: f32x8<S>,
    planes: f32x8<S>,
) -> f32x8<S> {
    let (before, added, planes) = (before.to_array(), added.to_array(), planes.to_array());
    let mut depths = [0.0f32; LANES];
    for lane in 0..LANES {
        // The least number of planes after which less than the least transmittance is left.
        let enough = ((before[lane] / min_transmittance).ln() / added[lane]).floor() + 1.0;
        // Without extinction this is no number or infinite, and all planes are taken.
        let taken = if enough >= 1.0 {
            enough.min(planes[lane])
        } else {
            planes[lane]
        };
        depths[lane] = taken * added[lane];
    }
    f32x8::from_slice(simd, &depths)
}
