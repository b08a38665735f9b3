//! One tile of a frame: a walk over the samples of its bricks.
//!
//! Brick by brick, front to back, plane by plane, a row of pixels at a time. The walk finds the samples; a [`SampleRule`]
//! that is compiled into it classifies and composites them.
//! Bricks come in an order in which none hides an earlier one; a brick behind an opaque tile is never looked at.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, mask32x8};
use fearless_simd_macros::simd;
use resample_core::composite::TilePixels;
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use super::clipped::clipped;
use crate::field::settings::FieldSettings;
use crate::field::settings::{PlacedBrick, TileContext};
use crate::field::settings::{RayValues, at_start};
use crate::field::walk::cell_sample::{CellBox, Located, located};
use crate::field::walk::lists::PackedSamples;
use crate::field::walk::lists::SegmentList;
use crate::slabs::view::{HalfRow, LANES, PlaneView, TileView, covered};
use crate::stats::SampleCounts;

/// How far f32 may move a sample, voxels: positions count from the middle of the volume, and 2048 voxels away f32
/// counts in steps of 1.2e-4.
pub(crate) const POSITION_ERROR: f32 = 2e-4;

/// Planes whose views are remembered in a tile; neighbouring bricks share planes. A power of two; a brick of unit
/// cells spans at most 2 * 8 * sqrt(3) planes half a voxel apart.
pub(crate) const REMEMBERED_PLANES: usize = 64;

/// A rule for samples.
pub(crate) trait SampleRule {
    /// Composites one vector of samples of a plane. Returns whether a pixel became more opaque.
    fn take<S: Simd>(
        simd: S,
        job: &TileContext,
        plane: &PlaneView,
        located: &Located<S>,
        scratch: &mut GatherScratch,
    ) -> bool;
}

/// Storage of one task, reused from tile to tile.
#[derive(Clone, Debug)]
pub(crate) struct GatherScratch {
    pub(crate) planes: RememberedPlanes,
    /// Colour so far, premultiplied; interleaved, as one sample at a time is added.
    pub(crate) rgb: [[[f32; 4]; TILE_PX]; TILE_PX],
    pub(crate) pixels: TilePixels,
    /// Values of rays so far, by channel; only where a statistic is shown.
    pub(crate) rays: Vec<RayValues>,
    /// Camera z, relative to the anchor's, of the last surface that was hit.
    pub(crate) last_hit: TilePlane,
    /// The planes of the brick in work that may be met.
    pub(crate) runs: Vec<Range<u32>>,
    pub(crate) samples: PackedSamples,
    pub(crate) segments: SegmentList,
    /// Counts since the tile was begun or resumed.
    pub(crate) work: SampleCounts,
}

/// Per-tile state, carried from brick to brick.
#[derive(Clone, Debug)]
pub(crate) struct Unfinished {
    pixels: TilePixels,
    rays: Vec<RayValues>,
    last_hit: Option<Box<TilePlane>>,
}

impl Unfinished {
    /// Bytes that one takes.
    pub(crate) fn bytes(settings: &FieldSettings) -> usize {
        let rays = settings
            .statistic
            .map_or(0, |_| settings.channels.len() * size_of::<RayValues>());
        size_of::<Self>() + rays + settings.iso.map_or(0, |_| size_of::<TilePlane>())
    }
}

/// The views of some planes of a tile, by their numbers; made where they are asked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct RememberedPlanes {
    planes: Vec<(u32, PlaneView)>,
}

impl RememberedPlanes {
    /// The view of a plane.
    #[inline(always)]
    pub(crate) fn at(&mut self, view: &TileView, number: u32) -> &PlaneView {
        self.make(view, number..number + 1);
        self.made(number)
    }

    /// Makes the views of planes, no more than are remembered.
    #[inline(always)]
    pub(crate) fn make(&mut self, view: &TileView, numbers: Range<u32>) {
        for number in numbers {
            let (remembered, plane) = &mut self.planes[number as usize % REMEMBERED_PLANES];
            if *remembered != number {
                *remembered = number;
                view.put_plane(number, plane);
            }
        }
    }

    /// The view of a plane that was made.
    #[inline(always)]
    pub(crate) fn made(&self, number: u32) -> &PlaneView {
        &self.planes[number as usize % REMEMBERED_PLANES].1
    }

    /// Makes ready for another tile.
    fn forget(&mut self) {
        if self.planes.is_empty() {
            self.planes = vec![(u32::MAX, PlaneView::default()); REMEMBERED_PLANES];
        }
        self.planes.iter_mut().for_each(|plane| plane.0 = u32::MAX);
    }
}

impl Default for GatherScratch {
    fn default() -> Self {
        Self {
            planes: RememberedPlanes::default(),
            rgb: [[[0.0; 4]; TILE_PX]; TILE_PX],
            pixels: TilePixels::default(),
            rays: Vec::new(),
            last_hit: [[f32::NEG_INFINITY; TILE_PX]; TILE_PX],
            runs: Vec::new(),
            samples: PackedSamples::default(),
            segments: SegmentList::default(),
            work: SampleCounts::default(),
        }
    }
}

impl GatherScratch {
    /// The view of a plane, remembered.
    #[inline(always)]
    pub(crate) fn plane(&mut self, view: &TileView, number: u32) -> &PlaneView {
        self.planes.at(view, number)
    }

    /// Makes ready for an empty tile.
    pub(crate) fn begin(&mut self, settings: &FieldSettings) {
        self.planes.forget();
        self.rgb = [[[0.0; 4]; TILE_PX]; TILE_PX];
        self.pixels = TilePixels::default();
        self.rays = at_start(settings.statistic, &settings.channels);
        self.last_hit = [[f32::NEG_INFINITY; TILE_PX]; TILE_PX];
        self.work = SampleCounts::default();
    }

    /// Makes ready for a tile that was begun before.
    pub(crate) fn resume(&mut self, settings: &FieldSettings, begun: &Unfinished) {
        self.begin(settings);
        self.pixels = begun.pixels.clone();
        for (y, row) in self.rgb.iter_mut().enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                let [red, green, blue] = &begun.pixels.rgb;
                *pixel = [red[y][x], green[y][x], blue[y][x], 0.0];
            }
        }
        self.rays.clone_from(&begun.rays);
        if let Some(last_hit) = &begun.last_hit {
            self.last_hit = **last_hit;
        }
    }

    /// Returns the state from which [`GatherScratch::resume`] goes on.
    pub(crate) fn suspend(&mut self, settings: &FieldSettings) -> Unfinished {
        self.place_colours();
        let last_hit = settings.iso.map(|_| Box::new(self.last_hit));
        Unfinished {
            pixels: self.pixels.clone(),
            rays: self.rays.clone(),
            last_hit,
        }
    }

    pub(crate) fn place_colours(&mut self) {
        for (y, row) in self.rgb.iter().enumerate() {
            for (x, pixel) in row.iter().enumerate() {
                for (plane, value) in self.pixels.rgb.iter_mut().zip(pixel) {
                    plane[y][x] = *value;
                }
            }
        }
    }
}

/// How many lanes a mask holds.
#[inline(always)]
pub(crate) fn set_lanes<S: Simd>(lanes: mask32x8<S>) -> usize {
    lanes.to_bitmask().count_ones() as usize
}

/// The pixels of a tile that a brick covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    pub(crate) columns: [usize; 2],
    pub(crate) rows: [usize; 2],
}

impl Window {
    pub(crate) fn new(placed: &PlacedBrick, view: &TileView) -> Self {
        let corner_px = view.first_px();
        let inside = |pixel: u16, axis: usize| {
            usize::from(pixel)
                .saturating_sub(corner_px[axis])
                .min(TILE_PX)
        };
        Self {
            columns: placed.columns.map(|c| inside(c, 0)),
            rows: placed.rows.map(|r| inside(r, 1)),
        }
    }

    /// The part that one plane's section of the brick covers; empty where it covers nothing.
    #[inline(always)]
    pub(crate) fn section<S: Simd>(
        &self,
        simd: S,
        settings: &FieldSettings,
        plane: &PlaneView,
        placed: &PlacedBrick,
    ) -> Self {
        let Some(reach) = settings.brick_sections.at(plane.offset_z - placed.middle_z) else {
            return Self {
                columns: [0; 2],
                rows: [0; 2],
            };
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

/// Takes all samples of a brick in. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
pub(crate) fn add_brick<S: Simd, R: SampleRule>(
    simd: S,
    job: &TileContext,
    window: Window,
    scratch: &mut GatherScratch,
) -> (usize, bool) {
    let (settings, placed) = (job.settings, job.placed);
    let cells = CellBox::new(placed.brick, &settings.sheets.anchor);
    let is_cut = placed.cuts != 0 || placed.brick.mask.is_some();
    let mut touched = 0;
    let mut seen = false;
    let runs = std::mem::take(&mut scratch.runs);
    for number in runs.iter().cloned().flatten() {
        let plane = *scratch.plane(job.view, number);
        let section = window.section(simd, settings, &plane, placed);
        let halves = section.columns[0] / LANES..section.columns[1].div_ceil(LANES);
        for row in section.rows[0]..section.rows[1] {
            for first in halves.clone().map(|half| half * LANES) {
                let at = HalfRow { row, first };
                touched += LANES;
                let left = f32x8::from_slice(
                    simd,
                    &scratch.pixels.transmittance[row][first..first + LANES],
                );
                // Opaque pixels take no more samples, one by one, so that the picture does not depend on which other
                // bricks the tile saw before.
                let open = left.simd_ge(f32x8::splat(simd, settings.sheets.min_transmittance));
                if open.all_false() {
                    continue;
                }
                let Some(mut located) = located(simd, &plane, &cells, open, at) else {
                    continue;
                };
                if is_cut {
                    let Some(kept) = clipped(simd, job, &located) else {
                        continue;
                    };
                    located = kept;
                }
                scratch.work.computed += LANES;
                scratch.work.shown += set_lanes(located.inside);
                seen |= R::take(simd, job, &plane, &located, scratch);
            }
        }
    }
    scratch.runs = runs;
    (
        touched,
        seen && scratch
            .pixels
            .is_opaque(simd, settings.sheets.min_transmittance),
    )
}
