//! Image sheets summed from voxels: each voxel adds its scalar and its weight to every plane that cuts its kernel.
//!
//! Visible bricks are projected voxel by voxel, each is listed by the tiles that its kernel touches, each tile sorts
//! its list by first plane and sums plane by plane ([`super::scatter_tile`]). Any compact kernel could be laid down this way;
//! for the trilinear one, gathering from cells gives the same sums in a fraction of the time.

use cpu_time::ThreadTime;
use rayon::prelude::*;
use resample_core::composite::TilePixels;
use resample_core::sort::{EXACT_KEYS, entry_key, sort_by_depth};
use resample_core::tile::{TILE_PX, TileGrid};

use super::SheetFrame;
use super::frame::{Section, SheetChunk, SheetProjection, Span, TileView};
use super::scatter_tile::{SheetScratch, render_tile};
use crate::chunks::{chunk_target, project_runs, runs_of_bricks, visible_bricks};
use crate::cull::ViewVolume;
use crate::field::Field;
use crate::stats::{FrameStats, StageClock};
use crate::tiles::{TileSlot, elapsed_ms, tally};
use crate::transfer::TransferFunction;
use crate::volume::Volume;

/// Reach of the trilinear kernel along each grid axis, voxels.
const REACH: usize = 1;

/// Voxels and the chunks that they are projected in, kept from frame to frame.
#[derive(Clone, Debug)]
pub(crate) struct VoxelSheets {
    pub(crate) field: Field,
    chunks: Vec<SheetChunk>,
}

impl VoxelSheets {
    pub(crate) fn new(volume: &Volume, transfer: &TransferFunction) -> Self {
        Self {
            field: Field::new(volume, transfer, REACH),
            chunks: Vec::new(),
        }
    }

    /// Renders the tiles of one frame.
    pub(crate) fn render(
        &mut self,
        frame: &SheetFrame,
        slots: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) {
        // The corners of the trilinear kernel's box lie sqrt(3) away.
        let view_volume = ViewVolume::new(frame.camera, frame.view, REACH as f64 * 3f64.sqrt());
        let visible = visible_bricks(&self.field.bricks, &view_volume, stats);
        stats.bricks_empty = self.field.empty;
        let in_view = visible
            .iter()
            .map(|&i| self.field.bricks[i].places.len())
            .sum();
        let runs = runs_of_bricks(&self.field.bricks, visible, chunk_target(in_view));
        self.chunks
            .resize_with(self.chunks.len().max(runs.len()), SheetChunk::default);
        self.project(
            &SheetProjection::new(frame.view, frame.camera, frame.settings, Span::Plane),
            &runs,
            stats,
        );
        frame.scatter(&self.chunks[..runs.len()], slots, stats);
    }

    /// Projects each run of bricks into its chunk and lists it by tile.
    fn project(&mut self, setup: &SheetProjection, runs: &[Vec<usize>], stats: &mut FrameStats) {
        let bricks = &self.field.bricks;
        let project = |chunk: &mut SheetChunk, run: &Vec<usize>| {
            chunk.clear();
            run.iter()
                .for_each(|&brick| chunk.project(setup, &bricks[brick]));
        };
        let chunks = &mut self.chunks[..runs.len()];
        project_runs(chunks, runs, stats, project, |chunk, number| {
            chunk.bins.bin(number)
        });
        for chunk in &self.chunks[..runs.len()] {
            stats.culled += chunk.culled;
            stats.splats += chunk.bins.primitives.len() as u64;
        }
    }
}

impl SheetFrame<'_> {
    /// Renders the tiles from projected voxels.
    fn scatter(&self, chunks: &[SheetChunk], slots: &mut Vec<TileSlot>, stats: &mut FrameStats) {
        let clock = StageClock::start();
        let grid = TileGrid {
            width: self.camera.width as usize,
            height: self.camera.height as usize,
        };
        let columns = grid.columns();
        slots.resize_with(columns * grid.rows(), TileSlot::default);
        let sections: Vec<&[Section]> = chunks
            .iter()
            .map(|chunk| chunk.bins.primitives.as_slice())
            .collect();
        slots.par_iter_mut().enumerate().for_each_init(
            SheetScratch::default,
            |scratch, (index, slot)| {
                let at = [index % columns, index / columns];
                slot.reset(0);
                for chunk in chunks {
                    slot.entries
                        .extend_from_slice(chunk.bins.tile(at[0] as u16, at[1] as u16));
                }
                self.scatter_tile(at.map(|tile| tile * TILE_PX), &sections, slot, scratch);
            },
        );
        tally(slots, clock.stop(), stats);
    }

    fn scatter_tile(
        &self,
        corner_px: [usize; 2],
        sections: &[&[Section]],
        slot: &mut TileSlot,
        scratch: &mut SheetScratch,
    ) {
        if slot.entries.is_empty() {
            return;
        }
        scratch.pixels = TilePixels::default();
        let start = ThreadTime::try_now().ok();
        sort_by_plane(&mut slot.entries, &mut scratch.sort);
        slot.sort_ms = elapsed_ms(start);
        let start = ThreadTime::try_now().ok();
        let view = TileView::new(self.view, corner_px, self.settings);
        slot.counts = render_tile(self.settings, &view, &slot.entries, sections, scratch);
        slot.show(&scratch.pixels, self.subpixels as usize);
        slot.composite_ms = elapsed_ms(start);
    }
}

/// Sorts entries by their plane, exactly: the tile relies on it.
pub(crate) fn sort_by_plane(entries: &mut [u64], scratch: &mut Vec<u64>) {
    let planes = entries.iter().map(|&e| entry_key(e));
    let (nearest, farthest) = planes.fold((u32::MAX, 0), |(lo, hi), plane| {
        (lo.min(plane), hi.max(plane))
    });
    if farthest.saturating_sub(nearest) < EXACT_KEYS {
        sort_by_depth(entries, scratch);
    } else {
        entries.sort_unstable();
    }
}
