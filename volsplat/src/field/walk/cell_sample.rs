//! Samples on a plane inside a brick of cells: where they lie, and what the field is there.
//!
//! Half a row of a tile is one vector. A sample lies in exactly one brick's box; its cell gives eight values, and the
//! trilinear mix of them is the field. Source: the trilinear kernel, gathered. Limits: a brick's own cells only.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, mask32x8, u32x8};
use glam::DVec3;

use crate::bricks::cells::{
    CELL_CORNERS, CELL_ROWS, CELL_SIDE, CELLS, CellBrick, FaceBytes, LAST_CELL, Scalars, TABLE_LEN,
    Table, VERTEX_SIDE,
};
use crate::field::settings::TileContext;
use crate::slabs::settings::Anchor;
use crate::slabs::view::{HalfRow, LANES, PlaneView};

/// The box of a brick's visible cells, in grid units relative to the anchor.
#[derive(Clone, Copy)]
pub(crate) struct CellBox {
    /// The brick's first vertex.
    pub(crate) corner: [f32; 3],
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
}

impl CellBox {
    pub(crate) fn new(brick: &CellBrick, anchor: &Anchor) -> Self {
        let corner = DVec3::from(brick.bounds.corner.map(f64::from)) - anchor.grid;
        let [low, high] = brick.bounds.range();
        // Whole numbers: exact in f32, so that neighbouring bricks share their faces to the bit.
        let at = |v: [u8; 3]| {
            (corner + DVec3::from(v.map(f64::from)))
                .as_vec3()
                .to_array()
        };
        Self {
            corner: corner.as_vec3().to_array(),
            low: at(low),
            high: at(high),
        }
    }
}

/// Where half a row of samples on a plane lies.
#[derive(Clone, Copy)]
pub(crate) struct Located<S: Simd> {
    /// Their place in the tile.
    pub(crate) at: HalfRow,
    /// Lanes in the brick's box.
    pub(crate) inside: mask32x8<S>,
    /// Place of each one's cell in the brick's tables.
    pub(crate) places: [i32; LANES],
    /// Its position in the cell.
    pub(crate) share: [f32x8<S>; 3],
}

/// Where half a row of a plane lies in the grid, relative to the anchor. It comes out the same for every brick, so that
/// a sample on a face between two of them belongs to exactly one.
#[inline(always)]
pub(crate) fn position<S: Simd>(simd: S, plane: &PlaneView, at: HalfRow) -> [f32x8<S>; 3] {
    std::array::from_fn(|axis| {
        let start = plane.row(axis, at.row);
        f32x8::from_slice(simd, &plane.lanes[axis][at.first..at.first + LANES])
            + f32x8::splat(simd, start)
    })
}

/// The positions in the box of a brick's visible cells.
#[inline(always)]
pub(crate) fn inside<S: Simd>(simd: S, cells: &CellBox, position: [f32x8<S>; 3]) -> mask32x8<S> {
    // Written out: a call of the array's `map` is left as a call here, and costs half of the frame.
    let within = |axis: usize| {
        let p = position[axis];
        p.simd_ge(f32x8::splat(simd, cells.low[axis]))
            & p.simd_lt(f32x8::splat(simd, cells.high[axis]))
    };
    within(0) & within(1) & within(2)
}

/// Positions in cells of the box: a position outside the box counts on from the nearest.
#[inline(always)]
pub(crate) fn in_box_cells<S: Simd>(
    simd: S,
    cells: &CellBox,
    at: HalfRow,
    position: [f32x8<S>; 3],
) -> Located<S> {
    let constant = |v: f32| f32x8::splat(simd, v);
    let in_brick: [f32x8<S>; 3] =
        std::array::from_fn(|axis| position[axis] - constant(cells.corner[axis]));
    let cell_of = |axis: usize| {
        let (low, high) = (
            cells.low[axis] - cells.corner[axis],
            cells.high[axis] - cells.corner[axis] - 1.0,
        );
        in_brick[axis]
            .max(constant(low))
            .min(constant(high))
            .trunc()
    };
    let cell = [cell_of(0), cell_of(1), cell_of(2)];
    let share = std::array::from_fn(|axis| in_brick[axis] - cell[axis]);
    let places = places_of(simd, cell);
    Located {
        at,
        inside: constant(0.0).simd_eq(constant(0.0)),
        places,
        share,
    }
}

/// The places of cells in the tables.
#[inline(always)]
pub(crate) fn places_of<S: Simd>(simd: S, cell: [f32x8<S>; 3]) -> [i32; LANES] {
    let constant = |v: f32| f32x8::splat(simd, v);
    let row_stride = VERTEX_SIDE as f32;
    let places = cell[2].mul_add(
        constant(row_stride * row_stride),
        cell[1].mul_add(constant(row_stride), cell[0]),
    );
    places.to_int::<i32x8<S>>().to_array()
}

/// The trilinear mix of the scalars at the corners of each lane's cell.
#[inline(always)]
pub(crate) fn interpolated<S: Simd>(
    simd: S,
    scalars: &Scalars,
    places: &[i32; LANES],
    share: [f32x8<S>; 3],
) -> f32x8<S> {
    Corners::new(simd, scalars, places).interpolated(share)
}

/// The values at the corners of each lane's cell, x fastest.
pub(crate) struct Corners<S: Simd> {
    values: [f32x8<S>; 8],
}

impl<S: Simd> Corners<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, scalars: &Scalars, places: &[i32; LANES]) -> Self {
        match scalars {
            Scalars::Numbers(table) => Self::of_numbers(simd, table, places),
            Scalars::Bytes(faces) => Self::of_bytes(simd, faces, places),
        }
    }

    #[inline(always)]
    fn of_numbers(simd: S, table: &Table, places: &[i32; LANES]) -> Self {
        let corners = corners(table, places);
        let mut values = [f32x8::splat(simd, 0.0); 8];
        for (value, corner) in values.iter_mut().zip(&corners) {
            *value = f32x8::from_slice(simd, corner);
        }
        Self { values }
    }

    #[inline(always)]
    pub(crate) fn of_bytes(simd: S, faces: &FaceBytes, places: &[i32; LANES]) -> Self {
        let cells = cells_of(simd, places);
        let (mut front, mut back) = ([0u32; LANES], [0u32; LANES]);
        for lane in 0..LANES {
            let cell = cells[lane] as usize % CELLS;
            front[lane] = faces[cell];
            back[lane] = faces[cell + CELL_ROWS];
        }
        let faces = [
            u32x8::from_slice(simd, &front),
            u32x8::from_slice(simd, &back),
        ];
        let mut values = [f32x8::splat(simd, 0.0); 8];
        for (k, value) in values.iter_mut().enumerate() {
            let byte = faces[k / 4] >> (8 * (k % 4) as u32) & u32x8::splat(simd, 0xff);
            *value = byte.bitcast::<i32x8<S>>().to_float();
        }
        Self { values }
    }

    /// The trilinear mix.
    #[inline(always)]
    pub(crate) fn interpolated(&self, share: [f32x8<S>; 3]) -> f32x8<S> {
        let v = &self.values;
        let y = [
            mix(
                mix(v[0], v[1], share[0]),
                mix(v[2], v[3], share[0]),
                share[1],
            ),
            mix(
                mix(v[4], v[5], share[0]),
                mix(v[6], v[7], share[0]),
                share[1],
            ),
        ];
        mix(y[0], y[1], share[2])
    }
}

#[inline(always)]
fn mix<S: Simd>(a: f32x8<S>, b: f32x8<S>, t: f32x8<S>) -> f32x8<S> {
    (b - a).mul_add(t, a)
}

/// The values at the eight corners of each lane's cell, corner by corner, x fastest. A plain loop over the lanes: it
/// becomes vector code where the CPU has what it takes.
#[inline(always)]
fn corners(table: &Table, places: &[i32; LANES]) -> [[f32; LANES]; 8] {
    let mut corners = [[0.0; LANES]; 8];
    for lane in 0..LANES {
        let place = (places[lane] as usize).min(LAST_CELL);
        for (corner, offset) in corners.iter_mut().zip(CELL_CORNERS) {
            corner[lane] = table[place + offset];
        }
    }
    corners
}

/// The numbers of cells, of the places of their first vertices: as [`cell_of`](crate::bricks::cells::cell_of).
#[inline(always)]
fn cells_of<S: Simd>(simd: S, places: &[i32; LANES]) -> [i32; LANES] {
    const ROW: f32 = VERTEX_SIDE as f32;
    let constant = |v: f32| f32x8::splat(simd, v);
    let place: f32x8<S> = i32x8::from_slice(simd, places).to_float();
    // Half a place on, no quotient of places below 729 is rounded over a whole number.
    let middle = place + constant(0.5);
    let row = (middle * constant(1.0 / ROW)).floor();
    let layer = (middle * constant(1.0 / (ROW * ROW))).floor();
    let cell = place - layer.mul_add(constant(CELL_SIDE as f32), row);
    cell.to_int::<i32x8<S>>().to_array()
}

/// The places of the voxels that are nearest to samples.
#[inline(always)]
fn nearest_places<S: Simd>(simd: S, located: &Located<S>) -> [i32; LANES] {
    let constant = |v: f32| f32x8::splat(simd, v);
    let step = |axis: usize, stride: usize| {
        located.share[axis]
            .simd_ge(constant(0.5))
            .select(constant(stride as f32), constant(0.0))
    };
    let steps = step(0, 1) + step(1, VERTEX_SIDE) + step(2, VERTEX_SIDE * VERTEX_SIDE);
    let mut places = steps.to_int::<i32x8<S>>().to_array();
    for (place, cell) in places.iter_mut().zip(located.places) {
        *place += cell;
    }
    places
}

/// The samples without those whose nearest voxel the mask hides.
#[inline(always)]
pub(crate) fn masked<S: Simd>(simd: S, job: &TileContext, located: &Located<S>) -> Located<S> {
    let Some(mask) = job.placed.brick.mask.as_deref() else {
        return *located;
    };
    let places = nearest_places(simd, located);
    let mut shown = [0.0f32; LANES];
    for (shown, place) in shown.iter_mut().zip(places) {
        *shown = f32::from(mask[(place as usize).min(TABLE_LEN - 1)]);
    }
    let shown = f32x8::from_slice(simd, &shown).simd_gt(f32x8::splat(simd, 0.0));
    Located {
        inside: located.inside & shown,
        ..*located
    }
}
