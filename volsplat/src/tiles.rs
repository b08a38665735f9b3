//! The tiles of a frame: gathering, sorting, and compositing each tile's list (the stages accumulate and composite).
//!
//! A tile gathers its slices from the chunks in source order, sorts them by depth, and composites until it is opaque.
//! One task owns a tile from start to end.

use cpu_time::ThreadTime;
use rayon::prelude::*;
use resample_core::composite::{
    TileCounts, TilePixels, TileSettings, TileWork, composite_slices, composite_tile,
};
use resample_core::maps::{MapSource, TileMaps, TilePlane};
use resample_core::sort::sort_by_depth;
use resample_core::tile::{Primitive, TILE_PX, TileGrid};

use crate::near::{NearSample, NearSetup, composite_near};
use crate::project::ProjectedChunk;
use crate::stats::{FrameStats, StageClock, seconds_to_ms};

/// What a frame's tiles are made with.
pub(crate) struct TileStage<'a> {
    /// Compositing settings.
    pub(crate) settings: TileSettings,
    /// Per-pixel maps.
    pub(crate) maps: MapSource,
    /// Tiles of the picture.
    pub(crate) grid: TileGrid,
    /// Samples at the eye, nearest first.
    pub(crate) near: &'a [NearSample],
    /// How those of each layer are integrated.
    pub(crate) near_setups: &'a [NearSetup],
    /// Projected chunks, binned.
    pub(crate) chunks: &'a [ProjectedChunk],
    /// What is composited at a time.
    pub(crate) layers: Layers,
    /// Sub-pixels along a pixel's side.
    pub(crate) subpixels: usize,
}

/// What is composited at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layers {
    /// A sample; points in sheets of their own.
    Samples,
    /// All of one sorting key.
    Slices,
}

/// One tile of the frame buffer, with what it cost.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileSlot {
    /// What the tile's pixels hold, row by row, made when the tile first shows something: memory follows what is
    /// visible. Read it with [`TileSlot::shown`].
    pixels: Vec<ShownPixel>,
    /// Whether `pixels` are of this frame.
    seen: bool,
    pub(crate) entries: Vec<u64>,
    /// Items listed in the tile, where they are not in `entries`.
    listed: usize,
    pub(crate) counts: TileCounts,
    pub(crate) sort_ms: f64,
    pub(crate) composite_ms: f64,
}

/// A pixel of the picture, premultiplied.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ShownPixel {
    pub(crate) rgb: [f32; 3],
    pub(crate) transmittance: f32,
    /// Depth times the opacity that it was seen with.
    pub(crate) depth: f32,
}

/// Storage of one task, reused from tile to tile.
#[derive(Default)]
struct Scratch {
    sort: Vec<u64>,
    work: TileWork,
}

impl TileSlot {
    /// An empty tile that `listed` items touch.
    pub(crate) fn reset(&mut self, listed: usize) {
        self.seen = false;
        self.entries.clear();
        self.listed = listed;
        self.counts = TileCounts::default();
        (self.sort_ms, self.composite_ms) = (0.0, 0.0);
    }

    /// Takes note of more items that touch the tile.
    pub(crate) fn list_more(&mut self, listed: usize) {
        self.listed += listed;
    }

    /// Adds to what the tile cost.
    pub(crate) fn count(&mut self, counts: TileCounts) {
        self.counts.composited += counts.composited;
        self.counts.pixels_touched += counts.pixels_touched;
    }

    /// Keeps what the tile shows in this frame: the means over squares of `subpixels` on a side.
    pub(crate) fn show(&mut self, pixels: &TilePixels, subpixels: usize) {
        self.seen = true;
        let means = pixels.averaged(subpixels);
        let side = TILE_PX / subpixels;
        self.pixels.clear();
        self.pixels.extend((0..side * side).map(|i| {
            let at = |plane: &TilePlane| plane[i / side][i % side];
            let [red, green, blue] = &means.rgb;
            let rgb = [at(red), at(green), at(blue)];
            ShownPixel { rgb, transmittance: at(&means.transmittance), depth: at(&means.depth) }
        }));
    }

    /// What the tile shows in this frame, row by row; `None` where that is nothing.
    pub(crate) fn shown(&self) -> Option<&[ShownPixel]> {
        self.seen.then_some(self.pixels.as_slice())
    }
}

impl TileStage<'_> {
    /// Renders every tile into `slots`, which are resized to the grid.
    pub(crate) fn run(&self, slots: &mut Vec<TileSlot>, stats: &mut FrameStats) {
        let clock = StageClock::start();
        let columns = self.grid.columns();
        slots.resize_with(columns * self.grid.rows(), TileSlot::default);
        let primitives: Vec<&[Primitive]> =
            self.chunks.iter().map(|chunk| chunk.bins.primitives.as_slice()).collect();
        slots.par_iter_mut().enumerate().for_each_init(Scratch::default, |scratch, (index, slot)| {
            self.render_tile([index % columns, index / columns], &primitives, slot, scratch);
        });
        tally(slots, clock, stats);
    }

    fn render_tile(
        &self,
        at: [usize; 2],
        primitives: &[&[Primitive]],
        slot: &mut TileSlot,
        scratch: &mut Scratch,
    ) {
        let start = ThreadTime::try_now().ok();
        slot.reset(0);
        for chunk in self.chunks {
            // Tile numbers fit: a picture side is at most 32768 px.
            slot.entries.extend_from_slice(chunk.bins.tile(at[0] as u16, at[1] as u16));
        }
        if slot.entries.is_empty() && self.near.is_empty() {
            return;
        }
        sort_by_depth(&mut slot.entries, &mut scratch.sort);
        slot.sort_ms = elapsed_ms(start);

        let start = ThreadTime::try_now().ok();
        let corner_px = at.map(|tile| tile * TILE_PX);
        let work = &mut scratch.work;
        work.pixels = TilePixels::default();
        if !self.near.is_empty() {
            composite_near(self.near_setups, self.near, corner_px, &mut work.pixels);
        }
        if !slot.entries.is_empty() {
            TileMaps::fill(&mut work.maps, self.settings.level, &self.maps, corner_px);
            let composite = match self.layers {
                Layers::Samples => composite_tile,
                Layers::Slices => composite_slices,
            };
            slot.counts = composite(&self.settings, work, corner_px, &slot.entries, primitives);
        }
        slot.show(&work.pixels, self.subpixels);
        slot.composite_ms = elapsed_ms(start);
    }
}

/// Adds up what the tiles cost.
pub(crate) fn tally(slots: &[TileSlot], clock: StageClock, stats: &mut FrameStats) {
    let whole = clock.stop();
    let (mut sort_ms, mut composite_ms) = (0.0, 0.0);
    for slot in slots {
        sort_ms += slot.sort_ms;
        composite_ms += slot.composite_ms;
        let listed = slot.entries.len() + slot.listed;
        stats.tile_pairs += listed as u64;
        stats.hidden_pairs += (listed - slot.counts.composited) as u64;
        stats.pixels_touched += slot.counts.pixels_touched as u64;
    }
    [stats.stages.sort, stats.stages.composite] = whole.shared([sort_ms, composite_ms]);
}

/// CPU time of this thread since `start`, ms; 0 where the system keeps no such clock.
pub(crate) fn elapsed_ms(start: Option<ThreadTime>) -> f64 {
    start.and_then(|s| s.try_elapsed().ok()).map_or(0.0, |d| seconds_to_ms(d.as_secs_f64()))
}
