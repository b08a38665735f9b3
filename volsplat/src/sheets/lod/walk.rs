//! A far brick in one tile: the ray's planes inside the brick are counted, and taken in long steps.
//!
//! The planes k0..k1 that a ray would be sampled on are those of the unmerged brick, so that neighbouring bricks share
//! their faces whatever their levels: k0 and k1 follow from where the ray crosses the faces of the box, and where
//! rounding could decide otherwise than the sampling of an unmerged brick, each plane is asked as it would be there.
//! A step spans several planes, reads the block or the cell at its middle, and weighs it by its planes inside.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::composite::{DepthRule, opacity};
use resample_core::tile::TILE_PX;

use super::merged::read_blocks;
use super::samples::SIDES;
use super::skip::{first_sheet, read_cells};
use super::{Choice, Stride};
use crate::sheets::cell_sample::{CellBox, HalfRow, LANES, inside, position};
use crate::sheets::frame::{PlaneView, TileView};
use crate::sheets::gather::{GatherScratch, Job, PlacedBrick, Window};

/// How far f32 may move a sample, voxels: positions count from the middle of the volume, and 2048 voxels away f32
/// counts in steps of 1.2e-4.
const POSITION_ERROR: f32 = 2e-4;

/// Least movement per plane along an axis, voxels: below it, a ray is taken to run along the faces of that axis.
const LEAST_STEP: f32 = 1e-20;

/// The planes of a brick, and the rays of half a row through it.
pub(super) struct Rays<S: Simd> {
    /// Position on the brick's first plane, relative to the anchor, and movement per plane.
    pub(super) start: [f32x8<S>; 3],
    pub(super) step: [f32x8<S>; 3],
    /// Planes, counted from the brick's first, that lie inside: from..to.
    from: f32x8<S>,
    to: f32x8<S>,
}

/// Composites a brick in steps, from its blocks or from its cells. Returns the pixels looked at, and whether the tile
/// is opaque now.
#[simd]
pub(in crate::sheets) fn add_in_steps<S: Simd, const MERGED: bool>(
    simd: S,
    job: &Job,
    window: Window,
    scratch: &mut GatherScratch,
) -> (usize, bool) {
    let Job {
        settings,
        view,
        placed,
    } = *job;
    let cells = CellBox::new(placed.brick, &settings.anchor);
    let [first, end] = placed.planes;
    let ends = [
        *scratch.plane(view, first),
        *scratch.plane(view, (end - 1).max(first + 1)),
    ];
    let (mut touched, mut seen) = (0, false);
    let halves = window.columns[0] / LANES..window.columns[1].div_ceil(LANES);
    for row in window.rows[0]..window.rows[1] {
        for half in halves.clone() {
            let at = HalfRow {
                row,
                first: half * LANES,
            };
            let Some(rays) = rays(simd, view, (&ends, at), (placed, &cells), scratch) else {
                continue;
            };
            let walk = (at, &rays, &ends);
            let (steps, any) = composite_steps::<S, MERGED>(simd, job, &cells, walk, scratch);
            touched += steps * LANES;
            seen |= any;
        }
    }
    (
        touched,
        seen && scratch.pixels.is_opaque(simd, settings.min_transmittance),
    )
}

/// The rays of half a row through a brick's box; `None` if none of them has a plane inside.
#[inline(always)]
fn rays<S: Simd>(
    simd: S,
    view: &TileView,
    (ends, at): (&[PlaneView; 2], HalfRow),
    (placed, cells): (&PlacedBrick, &CellBox),
    scratch: &mut GatherScratch,
) -> Option<Rays<S>> {
    let constant = |v: f32| f32x8::splat(simd, v);
    let [first, end] = placed.planes;
    let per_plane = constant(1.0 / ((end - 1).max(first + 1) - first) as f32);
    let (start, last) = (position(simd, &ends[0], at), position(simd, &ends[1], at));
    let step: [f32x8<S>; 3] = std::array::from_fn(|axis| (last[axis] - start[axis]) * per_plane);
    let zero = constant(0.0);
    // First and last crossing, each at its earliest and at its latest within the error of positions.
    let mut near = [zero, zero];
    let mut far = [
        constant((end - first) as f32),
        constant((end - first) as f32),
    ];
    for axis in 0..3 {
        let tiny = step[axis].abs().simd_lt(constant(LEAST_STEP));
        let inverse = constant(1.0) / tiny.select(constant(LEAST_STEP), step[axis]);
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
        counted(simd, view, at, (placed, cells), scratch)
    };
    to.simd_gt(from).any_true().then_some(Rays {
        start,
        step,
        from,
        to,
    })
}

/// The planes inside, asked one by one.
#[inline(never)]
fn counted<S: Simd>(
    simd: S,
    view: &TileView,
    at: HalfRow,
    (placed, cells): (&PlacedBrick, &CellBox),
    scratch: &mut GatherScratch,
) -> (f32x8<S>, f32x8<S>) {
    let [first, end] = placed.planes;
    let constant = |v: f32| f32x8::splat(simd, v);
    let (mut from, mut to) = (constant((end - first) as f32), constant(0.0));
    for number in first..end {
        let plane = scratch.plane(view, number);
        let within = inside(simd, cells, position(simd, plane, at));
        let here = constant((number - first) as f32);
        from = within.select(from.min(here), from);
        to = within.select(here + constant(1.0), to);
    }
    (from, to)
}

/// Where the steps of half a row begin and how many planes each spans, for rays whose planes are least..most.
fn steps(placed: &PlacedBrick, row: usize, [least, most]: [f32; 2]) -> [f32; 2] {
    match placed.detail {
        Choice::EverySheet => [least, 1.0],
        Choice::Skipping(Stride(stride)) => {
            let before = (placed.planes[0] + least as u32 + stride - first_sheet(row, stride))
                & (stride - 1);
            [least - before as f32, stride as f32]
        }
        // The coarsest level has one block: one step is enough.
        Choice::Merged(merged) if SIDES[merged.level - 1] == 1 => [least, most - least],
        Choice::Merged(merged) => [least, (1 << merged.level) as f32],
    }
}

/// Takes the steps front to back. Returns how many, and whether anything was seen.
#[inline(always)]
fn composite_steps<S: Simd, const MERGED: bool>(
    simd: S,
    job: &Job,
    cells: &CellBox,
    (at, rays, ends): (HalfRow, &Rays<S>, &[PlaneView; 2]),
    scratch: &mut GatherScratch,
) -> (usize, bool) {
    let Job {
        settings,
        view,
        placed,
    } = *job;
    let constant = |v: f32| f32x8::splat(simd, v);
    let used = rays.to.simd_gt(rays.from);
    let least = used
        .select(rays.from, constant(f32::MAX))
        .to_array()
        .into_iter()
        .fold(f32::MAX, f32::min);
    let most = rays.to.to_array().into_iter().fold(0.0, f32::max);
    let [mut first, stride] = steps(placed, at.row, [least, most]);
    let units = f32x8::from_slice(
        simd,
        &view.units_per_slab[at.row][at.first..at.first + LANES],
    );
    let (mut count, mut seen) = (0, false);
    while first < most {
        count += 1;
        let from = rays.from.max(constant(first));
        let to = rays.to.min(constant(first + stride));
        first += stride;
        let planes = (to - from).max(constant(0.0));
        // The middle of the step's planes; where it has none, anywhere.
        let middle = (from + to - constant(1.0)) * constant(0.5);
        let [red, green, blue, strength] = match placed.detail {
            Choice::Merged(merged) if MERGED => read_blocks(simd, (cells, merged), rays, middle),
            _ => read_cells(simd, settings, (placed.brick, cells), rays, middle),
        };
        let added = planes * units * strength;
        if added.simd_gt(constant(0.0)).all_false() {
            continue;
        }
        seen = true;
        let range = at.first..at.first + LANES;
        let load = |plane: &[f32; TILE_PX]| f32x8::from_slice(simd, &plane[range.clone()]);
        let before = load(&scratch.pixels.transmittance[at.row]);
        // What is opaque is left alone, as on every sheet.
        let open = before.simd_ge(constant(settings.min_transmittance));
        let mut weight = open.select(
            before * opacity(simd, settings.opacity, added),
            constant(0.0),
        );
        let least = constant(settings.min_transmittance);
        if ((before - weight).simd_lt(least) & open).any_true() {
            let added = until_opaque(
                simd,
                settings.min_transmittance,
                before,
                (units * strength, planes),
            );
            weight = open.select(
                before * opacity(simd, settings.opacity, added),
                constant(0.0),
            );
        }
        (before - weight).store_slice(&mut scratch.pixels.transmittance[at.row][range.clone()]);
        if settings.depth == DepthRule::Expected {
            let thickness = constant(settings.thickness as f32);
            let z = middle.mul_add(thickness, constant(ends[0].camera_z));
            let sum = weight.mul_add(z, load(&scratch.pixels.depth[at.row]));
            sum.store_slice(&mut scratch.pixels.depth[at.row][range.clone()]);
        }
        let (red, green, blue) = (
            (weight * red).to_array(),
            (weight * green).to_array(),
            (weight * blue).to_array(),
        );
        for (lane, sum) in scratch.rgb[at.row][range].iter_mut().enumerate() {
            sum[0] += red[lane];
            sum[1] += green[lane];
            sum[2] += blue[lane];
        }
    }
    (count, seen)
}

/// Optical depths of the planes that are composited before a pixel is opaque: sheet by sheet it would end there, and a
/// step must not go on. `added` is the optical depth of one plane, and there are so many planes.
#[inline(never)]
fn until_opaque<S: Simd>(
    simd: S,
    min_transmittance: f32,
    before: f32x8<S>,
    (added, planes): (f32x8<S>, f32x8<S>),
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
