//! The tiles of samples: gathering, sorting, and compositing each tile's list (the stages accumulate and composite).
//!
//! A tile gathers its slices from the chunks in source order, sorts them by depth, and composites until it is opaque.
//! One task owns a tile from start to end.

use rayon::prelude::*;
use resample_core::clock::ThreadClock;
use resample_core::composite::{
    TilePixels, TileSettings, TileWork, composite_slices, composite_tile,
};
use resample_core::maps::{MapSource, TileMaps};
use resample_core::scratch::on_heap;
use resample_core::sort::{entry_key, sort_by_depth};
use resample_core::tile::{Primitive, TILE_PX, TileGrid};

use super::near::{NearSample, NearSetup, composite_near};
use super::project::ProjectedChunk;
use crate::picture::tiles::{Means, TileSlot};

/// The input of a frame's tiles.
pub(crate) struct TileStage<'a> {
    /// Compositing settings.
    pub(crate) settings: TileSettings,
    /// Per-pixel maps.
    pub(crate) maps: MapSource,
    /// Tiles of the picture.
    pub(crate) grid: TileGrid,
    /// Samples at the eye, nearest first.
    pub(crate) near: Vec<NearSample>,
    /// How those of each layer are integrated.
    pub(crate) near_setups: &'a [NearSetup],
    /// The samples that are composited together.
    pub(crate) layers: Layers,
    /// Sub-pixels along a pixel's side.
    pub(crate) subpixels: usize,
}

/// The samples that are composited together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layers {
    /// A sample; points in sheets of their own.
    Samples,
    /// All of one sorting key.
    Slices,
}

/// Storage of one task, reused from tile to tile.
#[derive(Default)]
struct Scratch {
    ready: Vec<u64>,
    sort: Vec<u64>,
    work: TileWork,
}

/// A tile between two batches of samples.
#[derive(Clone, Debug, Default)]
pub(crate) struct OpenTile {
    /// Accumulated pixels; made when something touches the tile.
    pixels: Option<Box<TilePixels>>,
    /// Listed samples that may still have something before them.
    pending: Vec<u64>,
    pub(crate) is_opaque: bool,
}

impl OpenTile {
    /// Forgets the last frame.
    fn reset(&mut self) {
        self.pixels = None;
        self.pending.clear();
        self.is_opaque = false;
    }
}

impl TileStage<'_> {
    /// Makes tiles ready for a frame.
    pub(crate) fn begin(&self, slots: &mut Vec<TileSlot>, open: &mut Vec<OpenTile>) {
        let count = self.grid.columns() * self.grid.rows();
        slots.resize_with(count, TileSlot::default);
        open.resize_with(count, OpenTile::default);
        slots.par_iter_mut().for_each(|slot| slot.reset(0));
        open.par_iter_mut().for_each(OpenTile::reset);
    }

    /// Composites what the chunks from `first` on hold, and what was left before, as far as nothing that is still to come
    /// lies before it: up to the sheet that holds the depth `frontier`. A tile is shown once it is opaque or nothing is to
    /// come (`frontier` is infinite).
    pub(crate) fn advance(
        &self,
        chunks: &[ProjectedChunk],
        first: usize,
        frontier: f64,
        slots: &mut [TileSlot],
        open: &mut [OpenTile],
    ) {
        let columns = self.grid.columns();
        let primitives: Vec<&[Primitive]> = chunks
            .iter()
            .map(|chunk| chunk.bins.primitives.as_slice())
            .collect();
        let tiles = slots.par_iter_mut().zip(open).enumerate();
        tiles.for_each_init(on_heap::<Scratch>, |scratch, (index, (slot, open))| {
            let at = [index % columns, index / columns];
            let start = ThreadClock::start();
            let before = open.pending.len();
            for chunk in &chunks[first..] {
                // Tile numbers fit: a picture side is at most 32768 px.
                open.pending
                    .extend_from_slice(chunk.bins.tile(at[0] as u16, at[1] as u16));
            }
            slot.list_more(open.pending.len() - before);
            let is_begun = first > 0 || self.near.is_empty();
            if open.is_opaque {
                open.pending.clear();
                return;
            }
            if !(open.pending.is_empty() && is_begun) {
                self.take_ready(frontier, open, &mut scratch.ready);
                sort_by_depth(&mut scratch.ready, &mut scratch.sort);
                slot.sort_ms += start.elapsed_ms();
                let start = ThreadClock::start();
                let corner_px = at.map(|tile| tile * TILE_PX);
                if !is_begun {
                    let kept = open.pixels.get_or_insert_default();
                    composite_near(self.near_setups, &self.near, corner_px, kept);
                }
                self.composite(corner_px, &primitives, slot, open, scratch);
                slot.composite_ms += start.elapsed_ms();
            }
            if (open.is_opaque || frontier == f64::INFINITY)
                && let Some(pixels) = open.pixels.take()
            {
                slot.show(&pixels, self.subpixels, Means::Own);
            }
        });
    }

    /// Moves what may be composited now out of the pending entries.
    fn take_ready(&self, frontier: f64, open: &mut OpenTile, ready: &mut Vec<u64>) {
        ready.clear();
        if self.layers == Layers::Slices || frontier == f64::INFINITY {
            ready.append(&mut open.pending);
            return;
        }
        // As the points of a sheet are numbered when they are composited: a sheet is not cut in two.
        let sheets_per_unit = 1.0 / self.settings.sheet_thickness;
        let number = |depth: f32| (depth * sheets_per_unit) as u32;
        let end = number(frontier.max(0.0) as f32);
        open.pending.retain(|&entry| {
            let is_ready = number(f32::from_bits(entry_key(entry))) < end;
            if is_ready {
                ready.push(entry);
            }
            !is_ready
        });
    }

    fn composite(
        &self,
        corner_px: [usize; 2],
        primitives: &[&[Primitive]],
        slot: &mut TileSlot,
        open: &mut OpenTile,
        scratch: &mut Scratch,
    ) {
        let Scratch { work, ready, .. } = scratch;
        if ready.is_empty() && open.pixels.is_none() {
            return;
        }
        let kept = open.pixels.get_or_insert_default();
        if !ready.is_empty() {
            std::mem::swap(&mut work.pixels, kept);
            TileMaps::fill(&mut work.maps, self.settings.level, &self.maps, corner_px);
            let composite = match self.layers {
                Layers::Samples => composite_tile,
                Layers::Slices => composite_slices,
            };
            slot.count(composite(
                &self.settings,
                work,
                corner_px,
                ready,
                primitives,
            ));
            std::mem::swap(&mut work.pixels, kept);
        }
        let most = kept
            .transmittance
            .iter()
            .flatten()
            .fold(0.0f32, |most, &t| most.max(t));
        open.is_opaque = most < self.settings.min_transmittance;
        if open.is_opaque {
            open.pending.clear();
        }
    }
}
