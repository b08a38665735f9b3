//! One tile of an image-sheets frame, its sheets gathered from cells instead of summed from voxels.
//!
//! The trilinear kernel reaches exactly the eight voxels of a sample's cell, so the sum that a voxel scatters into a
//! plane can be gathered there: brick by brick, front to back, plane by plane, a row of pixels at a time. It is the
//! same sum in another order, and it needs no list of voxels, no sorting and no ring of planes.
//! Bricks come in an order in which none hides an earlier one; a brick behind an opaque tile is never looked at.

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, f32x4, f32x8, i32x8, mask32x8};
use fearless_simd_macros::simd;
use glam::DVec3;
use resample_core::composite::{DepthRule, TileCounts, TilePixels, opacity};
use resample_core::tile::TILE_PX;

use super::frame::{Anchor, PlaneView, SheetSettings, TileView, covered};
use super::shade::Lit;
use crate::cells::{CELL_SIDE, CellBrick, TABLE_LEN, VERTEX_SIDE};

/// Lanes of a vector: half a row of a tile. A brick covers about half the lanes of a whole row, and a gather into a
/// whole row would come back from memory in pieces that a wider load has to wait for.
const LANES: usize = 8;

/// Planes whose views are remembered in a tile; neighbouring bricks share planes. A power of two; a brick of unit
/// cells spans at most 2 * 8 * sqrt(3) planes half a voxel apart.
const REMEMBERED_PLANES: usize = 64;

/// A brick as the tiles need it, from the view alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedBrick<'a> {
    pub(crate) brick: &'a CellBrick,
    /// Planes first..end that cut the box of its visible cells.
    pub(crate) planes: [u32; 2],
    /// Pixel columns first..end and rows first..end that the box covers.
    pub(crate) columns: [u16; 2],
    pub(crate) rows: [u16; 2],
    /// Camera x and y of the middle of the brick.
    pub(crate) middle: [f32; 2],
    /// Its camera z, relative to the anchor's.
    pub(crate) middle_z: f32,
}

/// Storage of one task, reused from tile to tile.
#[derive(Clone, Debug)]
pub(crate) struct GatherScratch {
    planes: Vec<(u32, PlaneView)>,
    /// Colour so far, premultiplied; interleaved, as one sample at a time is added.
    rgb: [[[f32; 4]; TILE_PX]; TILE_PX],
    pub(crate) pixels: TilePixels,
}

impl Default for GatherScratch {
    fn default() -> Self {
        Self {
            planes: vec![(u32::MAX, PlaneView::default()); REMEMBERED_PLANES],
            rgb: [[[0.0; 4]; TILE_PX]; TILE_PX],
            pixels: TilePixels::default(),
        }
    }
}

/// Renders a tile whose first pixel is `corner_px` from the bricks that touch it, in front-to-back order.
pub(crate) fn render_tile<'a>(
    settings: &SheetSettings,
    view: &TileView,
    corner_px: [usize; 2],
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    scratch: &mut GatherScratch,
) -> TileCounts {
    let mut counts = TileCounts::default();
    scratch.planes.iter_mut().for_each(|plane| plane.0 = u32::MAX);
    scratch.rgb = [[[0.0; 4]; TILE_PX]; TILE_PX];
    scratch.pixels = TilePixels::default();
    for placed in bricks {
        let window = Window::new(placed, corner_px);
        let brick = (placed, window);
        // Two kernels: what shading needs would spill the registers of the one that does without.
        let (touched, opaque) = if settings.shade.is_some() {
            dispatch!(settings.level, simd => add_brick::<_, true>(simd, settings, view, brick, scratch))
        } else {
            dispatch!(settings.level, simd => add_brick::<_, false>(simd, settings, view, brick, scratch))
        };
        counts.composited += 1;
        counts.pixels_touched += touched;
        if opaque {
            break;
        }
    }
    for (y, row) in scratch.rgb.iter().enumerate() {
        for (x, pixel) in row.iter().enumerate() {
            for (plane, value) in scratch.pixels.rgb.iter_mut().zip(pixel) {
                plane[y][x] = *value;
            }
        }
    }
    counts
}

/// The pixels of a tile that a brick covers.
#[derive(Clone, Copy, Debug)]
struct Window {
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Window {
    fn new(placed: &PlacedBrick, corner_px: [usize; 2]) -> Self {
        let inside =
            |pixel: u16, axis: usize| usize::from(pixel).saturating_sub(corner_px[axis]).min(TILE_PX);
        Self { columns: placed.columns.map(|c| inside(c, 0)), rows: placed.rows.map(|r| inside(r, 1)) }
    }

    /// The part that one plane's section of the brick covers; empty where it covers nothing.
    #[inline(always)]
    fn section<S: Simd>(
        &self,
        simd: S,
        settings: &SheetSettings,
        plane: &PlaneView,
        placed: &PlacedBrick,
    ) -> Self {
        let Some(reach) = settings.brick_sections.at(plane.offset_z - placed.middle_z) else {
            return Self { columns: [0; 2], rows: [0; 2] };
        };
        let [x, y] = placed.middle;
        let ends = f32x4::from_slice(simd, &[x, y, x, y]) + f32x4::from_slice(simd, &reach.ends);
        let [x0, y0, x1, y1] = covered(simd, plane, ends);
        Self {
            columns: [x0.max(self.columns[0]), x1.min(self.columns[1])],
            rows: [y0.max(self.rows[0]), y1.min(self.rows[1])],
        }
    }
}

/// The box of a brick's visible cells, in grid units relative to the anchor.
#[derive(Clone, Copy)]
struct CellBox {
    /// The brick's first vertex.
    corner: [f32; 3],
    low: [f32; 3],
    high: [f32; 3],
}

impl CellBox {
    fn new(brick: &CellBrick, anchor: &Anchor) -> Self {
        let corner = DVec3::from(brick.bounds.corner.map(f64::from)) - anchor.grid;
        let [low, high] = brick.bounds.range();
        // Whole numbers: exact in f32, so that neighbouring bricks share their faces to the bit.
        let at = |v: [u8; 3]| (corner + DVec3::from(v.map(f64::from))).as_vec3().to_array();
        Self { corner: corner.as_vec3().to_array(), low: at(low), high: at(high) }
    }
}

/// Composites all samples of a brick. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
fn add_brick<S: Simd, const SHADED: bool>(
    simd: S,
    settings: &SheetSettings,
    view: &TileView,
    (placed, window): (&PlacedBrick, Window),
    scratch: &mut GatherScratch,
) -> (usize, bool) {
    let cells = CellBox::new(placed.brick, &settings.anchor);
    let mut touched = 0;
    let mut seen = false;
    for number in placed.planes[0]..placed.planes[1] {
        let slot = number as usize % REMEMBERED_PLANES;
        if scratch.planes[slot].0 != number {
            scratch.planes[slot] = (number, view.plane(number));
        }
        let plane = scratch.planes[slot].1;
        let section = window.section(simd, settings, &plane, placed);
        let halves = section.columns[0] / LANES..section.columns[1].div_ceil(LANES);
        for row in section.rows[0]..section.rows[1] {
            for first in halves.clone().map(|half| half * LANES) {
                let at = HalfRow { row, first };
                touched += LANES;
                let Some(sample) = sample(simd, &plane, &cells, at, placed.brick) else { continue };
                let sample = (&sample, placed.brick);
                seen |= composite_samples::<S, SHADED>(simd, settings, view, (at, &plane), sample, scratch);
            }
        }
    }
    (touched, seen && scratch.pixels.is_opaque(simd, settings.min_transmittance))
}

/// A vector's place in a tile.
#[derive(Clone, Copy)]
struct HalfRow {
    row: usize,
    first: usize,
}

/// Half a row of samples on a plane.
#[derive(Clone, Copy)]
struct Sample<S: Simd> {
    scalar: f32x8<S>,
    /// Which of them lie in the brick's box.
    inside: mask32x8<S>,
    /// Place of each one's cell in the brick's tables, and its position in the cell.
    places: [i32; LANES],
    share: [f32x8<S>; 3],
}

/// The scalars on half a row of a plane, and which of them lie in the box; `None` if none does.
#[inline(always)]
fn sample<S: Simd>(
    simd: S,
    plane: &PlaneView,
    cells: &CellBox,
    at: HalfRow,
    brick: &CellBrick,
) -> Option<Sample<S>> {
    let constant = |v: f32| f32x8::splat(simd, v);
    // Positions relative to the anchor come out the same for every brick, so that a sample on a face between two of
    // them belongs to exactly one.
    let position: [f32x8<S>; 3] = std::array::from_fn(|axis| {
        let start = plane.first[axis] + at.row as f32 * plane.step_y[axis];
        f32x8::from_slice(simd, &plane.lanes[axis][at.first..at.first + LANES]) + constant(start)
    });
    // Written out: a call of the array's `map` is left as a call here, and costs half of the frame.
    let within = |axis: usize| {
        let p = position[axis];
        p.simd_ge(constant(cells.low[axis])) & p.simd_lt(constant(cells.high[axis]))
    };
    let inside = within(0) & within(1) & within(2);
    if inside.all_false() {
        return None;
    }
    let in_brick: [f32x8<S>; 3] = std::array::from_fn(|axis| position[axis] - constant(cells.corner[axis]));
    // Samples outside the box are read from a cell inside, and left out later.
    let cell_of = |p: f32x8<S>| p.max(constant(0.0)).min(constant(CELL_SIDE as f32 - 1.0)).trunc();
    let cell = [cell_of(in_brick[0]), cell_of(in_brick[1]), cell_of(in_brick[2])];
    let share: [f32x8<S>; 3] = std::array::from_fn(|axis| in_brick[axis] - cell[axis]);
    let row_stride = VERTEX_SIDE as f32;
    let places =
        cell[2].mul_add(constant(row_stride * row_stride), cell[1].mul_add(constant(row_stride), cell[0]));
    let places = places.to_int::<i32x8<S>>().to_array();
    Some(Sample { scalar: interpolated(simd, &brick.scalars, &places, share), inside, places, share })
}

/// The trilinear mix of a table's values at the corners of each lane's cell.
#[inline(always)]
fn interpolated<S: Simd>(
    simd: S,
    table: &[f32; TABLE_LEN],
    places: &[i32; LANES],
    share: [f32x8<S>; 3],
) -> f32x8<S> {
    let corners = corners(table, places);
    let load = |k: usize| f32x8::from_slice(simd, &corners[k]);
    let mix = |a: f32x8<S>, b: f32x8<S>, t: f32x8<S>| (b - a).mul_add(t, a);
    let x: [f32x8<S>; 4] = std::array::from_fn(|k| mix(load(2 * k), load(2 * k + 1), share[0]));
    let y = [mix(x[0], x[1], share[1]), mix(x[2], x[3], share[1])];
    mix(y[0], y[1], share[2])
}

/// The values at the eight corners of each lane's cell, corner by corner, x fastest. A plain loop over the lanes: it
/// becomes vector code where the CPU has what it takes.
#[inline(always)]
fn corners(table: &[f32; TABLE_LEN], places: &[i32; LANES]) -> [[f32; LANES]; 8] {
    const OFFSETS: [usize; 8] = {
        let (row, layer) = (VERTEX_SIDE, VERTEX_SIDE * VERTEX_SIDE);
        [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1]
    };
    let mut corners = [[0.0; LANES]; 8];
    for lane in 0..LANES {
        let place = places[lane] as usize & 1023;
        for (corner, offset) in corners.iter_mut().zip(OFFSETS) {
            corner[lane] = table[place + offset];
        }
    }
    corners
}

/// Classifies half a row of samples and composites it. Returns whether anything was seen.
#[inline(always)]
fn composite_samples<S: Simd, const SHADED: bool>(
    simd: S,
    settings: &SheetSettings,
    view: &TileView,
    (at, plane): (HalfRow, &PlaneView),
    (sample, brick): (&Sample<S>, &CellBrick),
    scratch: &mut GatherScratch,
) -> bool {
    let places = settings.table.places(simd, sample.scalar).to_array();
    let mut strengths = [0.0f32; LANES];
    for (strength, &place) in strengths.iter_mut().zip(&places) {
        *strength = settings.table.entry(place)[3];
    }
    let zero = f32x8::splat(simd, 0.0);
    let strength = sample.inside.select(f32x8::from_slice(simd, &strengths), zero);
    if strength.simd_gt(zero).all_false() {
        return false;
    }
    let range = at.first..at.first + LANES;
    let load = |plane: &[f32; TILE_PX]| f32x8::from_slice(simd, &plane[range.clone()]);
    let added = strength * load(&view.units_per_slab[at.row]);
    let before = load(&scratch.pixels.transmittance[at.row]);
    let weight = before * opacity(simd, settings.opacity, added);
    (before - weight).store_slice(&mut scratch.pixels.transmittance[at.row][range.clone()]);
    if settings.depth == DepthRule::Expected {
        let sum = weight.mul_add(f32x8::splat(simd, plane.camera_z), load(&scratch.pixels.depth[at.row]));
        sum.store_slice(&mut scratch.pixels.depth[at.row][range.clone()]);
    }
    let sums = &mut scratch.rgb[at.row][range];
    // What is not lit has its own colour.
    let lit = if SHADED { lit(simd, settings, view, at, (brick, sample)) } else { None };
    match lit {
        None => {
            let weights = weight.to_array();
            for ((sum, &place), weight) in sums.iter_mut().zip(&places).zip(weights) {
                for (sum, value) in sum.iter_mut().zip(settings.table.entry(place)) {
                    *sum += weight * value;
                }
            }
        }
        Some(lit) => {
            let bodies = (weight * lit.body).to_array();
            let highlights = (weight * lit.highlight).to_array();
            for (lane, sum) in sums.iter_mut().enumerate() {
                for (sum, value) in sum.iter_mut().zip(settings.table.entry(places[lane])) {
                    *sum += bodies[lane] * value + highlights[lane];
                }
            }
        }
    }
    true
}

/// What light makes of samples; `None` where nothing is shaded.
#[inline(always)]
fn lit<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    view: &TileView,
    at: HalfRow,
    (brick, sample): (&CellBrick, &Sample<S>),
) -> Option<Lit<S>> {
    let (shade, gradients) = (settings.shade.as_ref()?, brick.gradients.as_ref()?);
    let range = at.first..at.first + LANES;
    let ray =
        std::array::from_fn(|axis| f32x8::from_slice(simd, &view.ray_in_world[axis][at.row][range.clone()]));
    let gradient =
        std::array::from_fn(|axis| interpolated(simd, &gradients[axis], &sample.places, sample.share));
    Some(shade.light(simd, gradient, ray))
}
