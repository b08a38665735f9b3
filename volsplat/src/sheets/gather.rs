//! One tile of an image-sheets frame, its sheets gathered from cells instead of summed from voxels.
//!
//! The trilinear kernel reaches exactly the eight voxels of a sample's cell, so the sum that a voxel scatters into a
//! plane can be gathered there: brick by brick, front to back, plane by plane, a row of pixels at a time. It is the
//! same sum in another order, and it needs no list of voxels, no sorting and no ring of planes.
//! Bricks come in an order in which none hides an earlier one; a brick behind an opaque tile is never looked at.

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, f32x16, i32x16};
use fearless_simd_macros::simd;
use glam::DVec3;
use resample_core::composite::{DepthRule, TileCounts, TilePixels, opacity};
use resample_core::tile::TILE_PX;

use super::frame::{Anchor, PlaneView, SheetSettings, TileView};
use crate::cells::{CELL_SIDE, CellBrick, VERTEX_SIDE};

/// Lanes of a vector: one row of a tile.
const LANES: usize = TILE_PX;

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
        let (touched, opaque) = dispatch!(settings.level, simd =>
            add_brick(simd, settings, view, (placed, window), scratch));
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

/// The rows of a tile that a brick covers.
#[derive(Clone, Copy, Debug)]
struct Window {
    rows: [usize; 2],
}

impl Window {
    fn new(placed: &PlacedBrick, corner_px: [usize; 2]) -> Self {
        let row = |pixel: u16| usize::from(pixel).saturating_sub(corner_px[1]).min(TILE_PX);
        Self { rows: placed.rows.map(row) }
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
fn add_brick<S: Simd>(
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
        for row in window.rows[0]..window.rows[1] {
            let (inside, samples) = sample_row(simd, &plane, &cells, row, placed.brick);
            touched += LANES;
            if inside == 0 {
                continue;
            }
            seen |= composite_row(simd, settings, view, (row, &plane), (inside, &samples), scratch);
        }
    }
    (touched, seen && scratch.pixels.is_opaque(simd, settings.min_transmittance))
}

/// The scalars on one row of a plane, and the bits of the pixels whose samples lie in the box.
#[inline(always)]
fn sample_row<S: Simd>(
    simd: S,
    plane: &PlaneView,
    cells: &CellBox,
    row: usize,
    brick: &CellBrick,
) -> (u64, [f32; LANES]) {
    let constant = |v: f32| f32x16::splat(simd, v);
    // Positions relative to the anchor come out the same for every brick, so that a sample on a face between two of
    // them belongs to exactly one.
    let position: [f32x16<S>; 3] = std::array::from_fn(|axis| {
        let start = plane.first[axis] + row as f32 * plane.step_y[axis];
        f32x16::from_slice(simd, &plane.lanes[axis]) + constant(start)
    });
    let mut inside = u64::MAX;
    for axis in 0..3 {
        let p = position[axis];
        inside &= p.simd_ge(constant(cells.low[axis])).to_bitmask();
        inside &= p.simd_lt(constant(cells.high[axis])).to_bitmask();
    }
    if inside == 0 {
        return (0, [0.0; LANES]);
    }
    let in_brick: [f32x16<S>; 3] = std::array::from_fn(|axis| position[axis] - constant(cells.corner[axis]));
    let cell = in_brick.map(|p| p.max(constant(0.0)).min(constant(CELL_SIDE as f32 - 1.0)).trunc());
    let share: [f32x16<S>; 3] = std::array::from_fn(|axis| in_brick[axis] - cell[axis]);
    let row_stride = VERTEX_SIDE as f32;
    let places =
        cell[2].mul_add(constant(row_stride * row_stride), cell[1].mul_add(constant(row_stride), cell[0]));
    let places = places.to_int::<i32x16<S>>().to_array();
    let corners = corners(&places, inside, brick);
    let load = |k: usize| f32x16::from_slice(simd, &corners[k]);
    let mix = |a: f32x16<S>, b: f32x16<S>, t: f32x16<S>| (b - a).mul_add(t, a);
    let x: [f32x16<S>; 4] = std::array::from_fn(|k| mix(load(2 * k), load(2 * k + 1), share[0]));
    let y = [mix(x[0], x[1], share[1]), mix(x[2], x[3], share[1])];
    (inside, mix(y[0], y[1], share[2]).to_array())
}

/// The scalars at the eight corners of each lane's cell, corner by corner, for the lanes from the first to the last
/// that is inside.
#[inline(always)]
fn corners(places: &[i32; LANES], inside: u64, brick: &CellBrick) -> [[f32; LANES]; 8] {
    const OFFSETS: [usize; 8] = {
        let (row, layer) = (VERTEX_SIDE, VERTEX_SIDE * VERTEX_SIDE);
        [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1]
    };
    let mut corners = [[0.0; LANES]; 8];
    for lane in inside.trailing_zeros() as usize..(64 - inside.leading_zeros() as usize).min(LANES) {
        let place = places[lane] as usize & 1023;
        for (corner, offset) in corners.iter_mut().zip(OFFSETS) {
            corner[lane] = brick.scalars[place + offset];
        }
    }
    corners
}

/// Classifies a row of samples and composites it. Returns whether anything was seen.
#[inline(always)]
fn composite_row<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    view: &TileView,
    (row, plane): (usize, &PlaneView),
    (inside, samples): (u64, &[f32; LANES]),
    scratch: &mut GatherScratch,
) -> bool {
    let lanes = inside.trailing_zeros() as usize..(64 - inside.leading_zeros() as usize).min(LANES);
    let places = settings.table.places(simd, samples);
    let mut strength = [0.0f32; LANES];
    let mut any = 0.0f32;
    for lane in lanes.clone() {
        if inside >> lane & 1 == 1 {
            strength[lane] = settings.table.entry(places[lane])[3];
            any += strength[lane];
        }
    }
    if !(any > 0.0) {
        return false;
    }
    let mut weights = [0.0f32; LANES];
    for start in (0..LANES).step_by(S::f32s::LEN) {
        let range = start..start + S::f32s::LEN;
        let load = |plane: &[f32; LANES]| S::f32s::from_slice(simd, &plane[range.clone()]);
        let added = load(&strength) * load(&view.units_per_slab[row]);
        let before = load(&scratch.pixels.transmittance[row]);
        let weight = before * opacity(simd, settings.opacity, added);
        (before - weight).store_slice(&mut scratch.pixels.transmittance[row][range.clone()]);
        weight.store_slice(&mut weights[range.clone()]);
        if settings.depth == DepthRule::Expected {
            let z = S::f32s::splat(simd, plane.camera_z);
            let sum = weight.mul_add(z, load(&scratch.pixels.depth[row]));
            sum.store_slice(&mut scratch.pixels.depth[row][range]);
        }
    }
    for lane in lanes {
        let colour = settings.table.entry(places[lane]);
        for (sum, value) in scratch.rgb[row][lane].iter_mut().zip(colour) {
            *sum += weights[lane] * value;
        }
    }
    true
}
