//! One frame from bricks of cells in memory.
//!
//! Takes the bricks, drops those outside the view, puts the others on the screen in front-to-back order, and has each
//! tile sample what it sees of them (`gather`).

use rayon::prelude::*;
use resample_core::clock::{StageClock, ThreadClock};
use resample_core::scratch::on_heap;
use resample_core::tile::{TILE_PX, TileGrid, TileLists};

use crate::bricks::cells::CellField;
use crate::bricks::cull::ViewVolume;
use crate::bricks::support::Support;
use crate::bricks::visible::visible_bricks;
use crate::field::place::placed;
use crate::field::setup::settings::FieldFrame;
use crate::field::tile::render_tile;
use crate::field::walk::gather::GatherScratch;
use crate::picture::tiles::{TileSlot, tally};
use crate::slabs::view::TileView;
use crate::stats::FrameStats;

impl FieldFrame<'_> {
    /// Renders the tiles from cells. Bricks without any of the scalars that are `seen` now are passed over.
    pub(super) fn gather(
        &self,
        field: &CellField,
        seen: Option<&Support>,
        slots: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) {
        let view_volume = ViewVolume::new(self.camera, self.view, 0.0);
        let mut visible = visible_bricks(&field.bricks, &view_volume, stats);
        if let Some(seen) = seen {
            let in_view = visible.len();
            visible.retain(|&i| {
                let [least, greatest] = field.bricks[i].range;
                seen.meets(least, greatest)
            });
            stats.bricks_empty = (in_view - visible.len()) as u64;
        }

        let clock = StageClock::start();
        let (bricks, rects) = placed(self, &field.bricks, &visible);
        stats.stages.project = clock.stop();
        stats.bricks = bricks.len() as u64;
        stats.bricks_uniform = bricks.iter().filter(|b| b.uniform.is_some()).count() as u64;
        stats.bricks_empty += field.empty;

        let clock = StageClock::start();
        let grid = TileGrid::new(self.camera.width as usize, self.camera.height as usize);
        let lists = TileLists::new(&grid, &rects);
        stats.stages.bin = clock.stop();

        let clock = StageClock::start();
        let columns = grid.columns();
        slots.resize_with(columns * grid.rows(), TileSlot::default);
        slots.par_iter_mut().enumerate().for_each_init(
            on_heap::<GatherScratch>,
            |scratch, (index, slot)| {
                let at = [index % columns, index / columns];
                let list = lists.tile(at[0], at[1]);
                slot.reset(list.len());
                if list.is_empty() || self.stop.is_asked() {
                    return;
                }
                let start = ThreadClock::start();
                let corner_px = at.map(|tile| tile * TILE_PX);
                let view = TileView::new(self.view, corner_px, &self.settings.sheets);
                let front_to_back = list.iter().map(|&brick| &bricks[brick as usize]);
                let counts = render_tile(self.settings, &view, front_to_back, scratch);
                slot.count(counts);
                slot.count_samples(scratch.work);
                slot.show(&scratch.pixels, self.subpixels as usize, self.means);
                slot.composite_ms = start.elapsed_ms();
            },
        );
        tally(slots, clock.stop(), stats);
        count_hidden(&lists, slots, columns, stats);
    }
}

/// Counts the bricks that no tile looked at: each tile looked at the first of its list.
fn count_hidden(lists: &TileLists, slots: &[TileSlot], columns: usize, stats: &mut FrameStats) {
    let mut looked_at = vec![false; stats.bricks as usize];
    for (index, slot) in slots.iter().enumerate() {
        let list = lists.tile(index % columns, index / columns);
        for &brick in &list[..slot.counts.composited] {
            looked_at[brick as usize] = true;
        }
    }
    stats.bricks_hidden = looked_at.iter().filter(|looked_at| !**looked_at).count() as u64;
}
