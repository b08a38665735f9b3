//! The tiles of a frame: what each shows, and what it cost.

use resample_core::clock::StageTime;
use resample_core::composite::{TileCounts, TilePixels};
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use crate::stats::{FrameStats, SampleCounts};

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
    /// What became of the samples of a field.
    pub(crate) work: SampleCounts,
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

impl TileSlot {
    /// An empty tile that `listed` items touch.
    pub(crate) fn reset(&mut self, listed: usize) {
        self.seen = false;
        self.entries.clear();
        self.listed = listed;
        self.counts = TileCounts::default();
        self.work = SampleCounts::default();
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

    /// Adds to what became of the samples of a field.
    pub(crate) fn count_samples(&mut self, work: SampleCounts) {
        self.work.computed += work.computed;
        self.work.shown += work.shown;
        self.work.contributed += work.contributed;
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
            ShownPixel {
                rgb,
                transmittance: at(&means.transmittance),
                depth: at(&means.depth),
            }
        }));
    }

    /// What the tile shows in this frame, row by row; `None` where that is nothing.
    pub(crate) fn shown(&self) -> Option<&[ShownPixel]> {
        self.seen.then_some(self.pixels.as_slice())
    }
}

/// Adds up what the tiles cost.
pub(crate) fn tally(slots: &[TileSlot], whole: StageTime, stats: &mut FrameStats) {
    let (mut sort_ms, mut composite_ms) = (0.0, 0.0);
    for slot in slots {
        sort_ms += slot.sort_ms;
        composite_ms += slot.composite_ms;
        let listed = slot.entries.len() + slot.listed;
        stats.tile_pairs += listed as u64;
        stats.hidden_pairs += (listed - slot.counts.composited) as u64;
        stats.pixels_touched += slot.counts.pixels_touched as u64;
        stats.lanes_computed += slot.work.computed as u64;
        stats.samples_shown += slot.work.shown as u64;
        stats.samples_contributed += slot.work.contributed as u64;
    }
    [stats.stages.sort, stats.stages.composite] = whole.shared([sort_ms, composite_ms]);
}
