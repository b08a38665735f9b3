//! Surfaces that another renderer drew, in the field: every ray is drawn up to the first of them, then that surface, then on to the
//! next.
//!
//! A surface is one depth and one colour at each sub-pixel, so that it has no thickness: it cuts the ray into spans. A tile draws its
//! bricks once for each span, front to back, and composites the surface that ends it. Bricks that lie outside the spans of all pixels are
//! skipped, those inside are drawn as without surfaces. A sample stands for the slab around its plane; a surface in the
//! slab leaves it the part that lies before, so that opacity grows evenly with depth and no contours of slabs show.
//! Source: ray segments up to the depth of opaque geometry, as in Levoy, "A Hybrid Ray Tracer for Rendering Polygon and Volume Data",
//! IEEE Computer Graphics and Applications 10(2), 1990.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, mask32x16};
use resample_core::maps::TilePlane;
use resample_core::narrow::single;
use resample_core::tile::TILE_PX;
use resample_core::{Surface, SurfaceTile};

use crate::slabs::settings::SheetSettings;
use crate::slabs::view::{BLOCK_PX, HalfRow, LANES, PlaneView};

/// The surfaces of a frame, at its sub-pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surfaces<'a> {
    pub(crate) all: &'a [Surface],
    /// Camera z at which the depths of the frame begin, world units.
    pub(crate) depth_origin: f64,
    /// World units of the length in which the frame counts.
    pub(crate) length: f64,
}

/// The surfaces of a tile, front to back at each sub-pixel: their depths are camera z, relative to the anchor's.
#[derive(Clone, Debug)]
pub(crate) struct TileSurfaces {
    layers: Vec<SurfaceTile>,
}

/// The parts of a tile's rays between two surfaces: camera z, relative to the anchor's. No part where the near end is infinite.
#[derive(Clone, Debug)]
pub(crate) struct Spans {
    near: TilePlane,
    far: TilePlane,
}

/// How a brick lies to the spans of the pixels that it covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    Outside,
    Inside,
    Across,
}

impl Surfaces<'_> {
    /// Returns the surfaces in a tile, sorted; `None` if no pixel of it sees one.
    pub(crate) fn of_tile(
        &self,
        settings: &SheetSettings,
        tile: [usize; 2],
    ) -> Option<TileSurfaces> {
        let origin = self.depth_origin / self.length + settings.anchor.camera_z;
        let mut layers = Surface::sorted(self.all, tile);
        for z in layers
            .iter_mut()
            .flat_map(|layer| layer.depth.as_flattened_mut())
        {
            *z = single(f64::from(*z) / self.length - origin);
        }
        (!layers.is_empty()).then_some(TileSurfaces { layers })
    }
}

impl TileSurfaces {
    /// The first surface at each sub-pixel, the second, and so on.
    pub(crate) fn layers(&self) -> &[SurfaceTile] {
        &self.layers
    }

    /// The parts of rays before the surface of this number, behind the one before it.
    pub(crate) fn spans(&self, number: usize) -> Spans {
        let near = match number.checked_sub(1) {
            Some(before) => self.layers[before].depth,
            None => [[f32::NEG_INFINITY; TILE_PX]; TILE_PX],
        };
        let far = match self.layers.get(number) {
            Some(layer) => layer.depth,
            None => [[f32::INFINITY; TILE_PX]; TILE_PX],
        };
        Spans { near, far }
    }

    /// The parts of rays before the first surface of more than half alpha, for statistics of rays.
    pub(crate) fn unhidden(&self) -> Spans {
        let mut spans = Spans {
            near: [[f32::NEG_INFINITY; TILE_PX]; TILE_PX],
            far: [[f32::INFINITY; TILE_PX]; TILE_PX],
        };
        for layer in self.layers.iter().rev() {
            let ends = spans.far.as_flattened_mut().iter_mut();
            let surface = layer
                .depth
                .as_flattened()
                .iter()
                .zip(layer.rgba.as_flattened());
            for (far, (z, rgba)) in ends.zip(surface) {
                *far = if rgba[3] > 0.5 { *z } else { *far };
            }
        }
        spans
    }
}

impl Spans {
    /// Returns how the slabs of these planes, those of a brick, lie to the spans of these pixels.
    pub(crate) fn place(
        &self,
        settings: &SheetSettings,
        planes: [u32; 2],
        (columns, rows): (Range<usize>, Range<usize>),
    ) -> Place {
        let [low, high] = reach(settings, planes);
        let (mut is_outside, mut is_inside) = (true, true);
        for row in rows {
            for column in columns.clone() {
                let (near, far) = (self.near[row][column], self.far[row][column]);
                is_outside &= high <= near || low >= far;
                is_inside &= near <= low && high <= far;
            }
        }
        match (is_outside, is_inside) {
            (true, _) => Place::Outside,
            (_, true) => Place::Inside,
            _ => Place::Across,
        }
    }

    /// The pixels of a row whose spans meet the slabs of these planes.
    #[inline(always)]
    pub(crate) fn open<S: Simd>(
        &self,
        simd: S,
        settings: &SheetSettings,
        planes: [u32; 2],
        row: usize,
    ) -> mask32x16<S> {
        let [low, high] = reach(settings, planes).map(|z| f32x16::splat(simd, z));
        let near = f32x16::from_slice(simd, &self.near[row]);
        let far = f32x16::from_slice(simd, &self.far[row]);
        near.simd_lt(high) & far.simd_gt(low)
    }

    /// The part of the slab of a plane that lies in the span of each pixel of a block, from 0 to 1.
    #[inline(always)]
    pub(crate) fn part_of_slab<S: Simd>(
        &self,
        simd: S,
        thickness: f32,
        plane: &PlaneView,
        at: [usize; 2],
    ) -> f32x16<S> {
        let slab = (plane.offset_z, thickness);
        part_before(simd, &self.far, at, slab) - part_before(simd, &self.near, at, slab)
    }

    /// Where the spans of half a row begin and end.
    #[inline(always)]
    pub(crate) fn ends<S: Simd>(&self, simd: S, at: HalfRow) -> [f32x8<S>; 2] {
        let range = at.first..at.first + LANES;
        [
            f32x8::from_slice(simd, &self.near[at.row][range.clone()]),
            f32x8::from_slice(simd, &self.far[at.row][range]),
        ]
    }
}

/// Least and greatest camera z, relative to the anchor's, of the slabs of planes first..end, and of one more at either end for what
/// lies between planes.
fn reach(settings: &SheetSettings, [first, end]: [u32; 2]) -> [f32; 2] {
    let z = |plane: f64| single(plane * settings.thickness - settings.anchor.camera_z);
    [z(f64::from(first) - 1.0), z(f64::from(end) + 1.0)]
}

/// The part of a slab, of this middle and thickness, that lies before these ends, for each pixel of a block.
#[inline(always)]
fn part_before<S: Simd>(
    simd: S,
    ends: &TilePlane,
    [x, y]: [usize; 2],
    (middle, thickness): (f32, f32),
) -> f32x16<S> {
    let constant = |v: f32| f32x16::splat(simd, v);
    let mut z = [0.0; BLOCK_PX * BLOCK_PX];
    for (row, z) in z.chunks_exact_mut(BLOCK_PX).enumerate() {
        z.copy_from_slice(&ends[y * BLOCK_PX + row][x * BLOCK_PX..][..BLOCK_PX]);
    }
    let height = f32x16::from_slice(simd, &z) - constant(middle);
    let part = height.mul_add(constant(1.0 / thickness), constant(0.5));
    part.max(constant(0.0)).min(constant(1.0))
}
