//! A frame of a volume that stays in its file: layer by layer from the eye away, in batches that fit the memory.
//!
//! Along a ray the number of layers of bricks between the eye's layer and another only grows, and so does that of rows in a
//! layer: taken in this order, no batch hides a part of an earlier one. Inside a batch bricks are sorted as in memory.
//! Tiles keep their state from batch to batch: colours, the last surface, or what a statistic of the ray has met. Pixels that
//! are opaque take nothing more, so that the picture is the same to the bit as that of a volume in memory. (Where two samples
//! of a ray share its greatest or least scalar, its depth may be that of either.) Bricks behind tiles that are opaque are never read.
//! Where the tiles' states do not fit either, bands of tiles are drawn one after the other.

use std::ops::Range;

use rayon::prelude::*;
use resample_core::clock::{StageClock, ThreadClock};
use resample_core::scratch::on_heap;
use resample_core::tile::{TILE_PX, TileGrid, TileLists, TileRect};
use resample_volume::Watch;

use crate::Error;
use crate::bricks::cells::{CELL_SIDE, CellBrick};
use crate::bricks::cull::ViewVolume;
use crate::field::frame::{axis_distance, placed, tile_rect};
use crate::field::settings::{FieldFrame, FieldSettings};
use crate::field::streamed::{Budget, IndexedBrick, StreamedCells};
use crate::field::tile::{TileState, advance_tile, end_tile};
use crate::field::walk::scratch::{FieldScratch, Unfinished};
use crate::look::clip::Cut;
use crate::picture::{TileSlot, tally};
use crate::shadow::coarse::CoarseField;
use crate::slabs::view::TileView;
use crate::stats::FrameStats;

/// Fewest bricks of a batch: below, the lists of tiles cost more than the bricks. A guess.
const MIN_BATCH: usize = 64;

/// Most bricks of a batch: a batch never reads bricks that it finds hidden, so that small ones read less. A guess.
const MAX_BATCH: usize = 1 << 14;

/// The state of a tile.
enum Progress {
    /// Nothing was drawn yet.
    Empty,
    /// Its state so far.
    Begun(Box<Unfinished>),
    /// Nothing more can be seen in it, and what it shows was handed on.
    Opaque,
}

/// A brick that is going to be read.
struct Candidate {
    at: [usize; 2],
    /// Its place in its row.
    place: usize,
    brick: IndexedBrick,
}

/// One band of tiles.
struct Band<'a> {
    cells: &'a StreamedCells,
    frame: &'a FieldFrame<'a>,
    view_volume: &'a ViewVolume,
    /// Bytes that stay from frame to frame.
    kept_bytes: u64,
    grid: TileGrid,
    /// Rows of tiles.
    rows: Range<usize>,
    tiles: Vec<Progress>,
    batch_len: usize,
}

impl StreamedCells {
    /// Renders the tiles of a frame.
    pub(crate) fn render(
        &self,
        frame: &FieldFrame,
        slots: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
        watch: &mut Watch,
    ) -> Result<(), Error> {
        let clock = StageClock::start();
        let grid = TileGrid::new(frame.camera.width as usize, frame.camera.height as usize);
        slots.resize_with(grid.columns() * grid.rows(), TileSlot::default);
        slots.iter_mut().for_each(|slot| slot.reset(0));
        let view_volume = ViewVolume::new(frame.camera, frame.view, 0.0);
        let row_bytes = (grid.columns() * tile_bytes(frame.settings)) as u64;
        let band_rows = ((self.budget.tiles / row_bytes.max(1)) as usize).clamp(1, grid.rows());
        let bands: Vec<Range<usize>> = (0..grid.rows())
            .step_by(band_rows)
            .map(|row| row..(row + band_rows).min(grid.rows()))
            .collect();
        let of_light = frame.coarse.map_or(0, CoarseField::bytes) + frame.light.bytes();
        let kept_bytes = self.kept_bytes + of_light;
        stats.resident_bytes = kept_bytes;
        for (done, rows) in bands.iter().enumerate() {
            let mut band = Band {
                cells: self,
                frame,
                view_volume: &view_volume,
                kept_bytes,
                grid,
                rows: rows.clone(),
                tiles: Vec::new(),
                batch_len: batch_len(&self.budget, self.reader.brick_bytes()),
            };
            let slots = &mut slots[rows.start * grid.columns()..rows.end * grid.columns()];
            band.draw(slots, stats, &mut |share| {
                watch((done as f64 + share) / bands.len() as f64)
            })?;
        }
        tally(slots, clock.stop(), stats);
        Ok(())
    }
}

/// Bytes that the state of a tile takes.
fn tile_bytes(settings: &FieldSettings) -> usize {
    Unfinished::bytes(settings) + size_of::<Progress>()
}

fn batch_len(budget: &Budget, brick_bytes: u64) -> usize {
    ((budget.batch / brick_bytes) as usize).clamp(MIN_BATCH, MAX_BATCH)
}

impl Band<'_> {
    fn draw(
        &mut self,
        slots: &mut [TileSlot],
        stats: &mut FrameStats,
        watch: &mut Watch,
    ) -> Result<(), Error> {
        self.tiles = slots.iter().map(|_| Progress::Empty).collect();
        let [layers, rows] = self.cells.index.layers_and_rows();
        let layers = self.outwards(layers, 2);
        let rows = self.outwards(rows, 1);
        let mut waiting: Vec<Candidate> = Vec::new();
        for (done, &layer) in layers.iter().enumerate() {
            if self.frame.stop.is_asked() {
                return Err(Error::Stopped);
            }
            let found = self.candidates(layer, &rows);
            let count: usize = found.iter().map(Vec::len).sum();
            // Layers that hold little are drawn together; one that holds much is cut between rows.
            if waiting.len() + count > self.batch_len {
                self.composite(std::mem::take(&mut waiting), slots, stats)?;
            }
            for row in found {
                if count > self.batch_len
                    && !waiting.is_empty()
                    && waiting.len() + row.len() > self.batch_len
                {
                    self.composite(std::mem::take(&mut waiting), slots, stats)?;
                }
                waiting.extend(row);
            }
            if count > self.batch_len {
                self.composite(std::mem::take(&mut waiting), slots, stats)?;
            }
            watch((done + 1) as f64 / layers.len() as f64);
        }
        self.composite(waiting, slots, stats)?;
        self.show_rest(slots);
        Ok(())
    }

    /// Numbers of layers or rows along an axis, from the eye away.
    fn outwards(&self, count: usize, axis: usize) -> Vec<usize> {
        let mut numbers: Vec<usize> = (0..count).collect();
        numbers.sort_by_key(|&i| axis_distance(self.frame.view, (i * CELL_SIDE) as u32, axis));
        numbers
    }

    /// The bricks of a layer that may be seen in this band, row by row.
    fn candidates(&self, layer: usize, rows: &[usize]) -> Vec<Vec<Candidate>> {
        let of_row = |&row: &usize| {
            let at = [layer, row];
            let bricks = self.cells.index.row(at).iter().enumerate();
            let seen = bricks.filter(|(_, brick)| self.may_be_seen(brick, at));
            seen.map(|(place, &brick)| Candidate { at, place, brick })
                .collect()
        };
        rows.par_iter().map(of_row).collect()
    }

    fn may_be_seen(&self, brick: &IndexedBrick, at: [usize; 2]) -> bool {
        let bounds = brick.bounds(at);
        if !self.view_volume.sees(&bounds) || self.frame.clip.cut(&bounds) == Cut::Outside {
            return false;
        }
        let Some(rect) = tile_rect(&bounds, self.frame.view, self.grid, self.frame.settings) else {
            return false;
        };
        let rows =
            usize::from(rect.y0).max(self.rows.start)..usize::from(rect.y1).min(self.rows.end);
        let columns = usize::from(rect.x0)..usize::from(rect.x1);
        rows.into_iter().any(|y| {
            let first = (y - self.rows.start) * self.grid.columns();
            self.tiles[first + columns.start..first + columns.end]
                .iter()
                .any(|t| !matches!(t, Progress::Opaque))
        })
    }

    /// Reads bricks and composites them behind what the tiles hold.
    fn composite(
        &mut self,
        batch: Vec<Candidate>,
        slots: &mut [TileSlot],
        stats: &mut FrameStats,
    ) -> Result<(), Error> {
        if batch.is_empty() {
            return Ok(());
        }
        let bricks = self.load(&batch, stats)?;
        drop(batch);
        let all: Vec<usize> = (0..bricks.len()).collect();
        let settings = self.frame.settings;
        let light = self
            .frame
            .coarse
            .map(|coarse| self.frame.light.finer(coarse, &bricks));
        let light = light.unwrap_or_default();
        let (placed, rects) = placed(self.frame, &bricks, &all, &light);
        stats.bricks += placed.len() as u64;
        let rects: Vec<TileRect> = rects.into_iter().map(|rect| self.inside(rect)).collect();
        let lists = TileLists::new(&self.grid, &rects);
        let (columns, first_row) = (self.grid.columns(), self.rows.start);
        let tiles = self.tiles.par_iter_mut().zip(slots).enumerate();
        tiles.for_each_init(on_heap::<FieldScratch>, |scratch, (index, (tile, slot))| {
            let at = [index % columns, first_row + index / columns];
            let list = lists.tile(at[0], at[1]);
            slot.list_more(list.len());
            if list.is_empty() || matches!(tile, Progress::Opaque) {
                return;
            }
            let start = ThreadClock::start();
            match tile {
                Progress::Begun(begun) => scratch.resume(settings, begun),
                _ => scratch.begin(settings),
            }
            let corner_px = at.map(|tile| tile * TILE_PX);
            let view = TileView::new(self.frame.view, corner_px, &settings.sheets);
            let front_to_back = list.iter().map(|&brick| &placed[brick as usize]);
            let (counts, state) = advance_tile(settings, &view, front_to_back, None, scratch);
            slot.count(counts);
            slot.count_samples(scratch.work);
            *tile = match state {
                TileState::Opaque => {
                    slot.show(
                        &end_tile(settings, scratch),
                        self.frame.subpixels as usize,
                        self.frame.means,
                    );
                    Progress::Opaque
                }
                TileState::Open => Progress::Begun(Box::new(scratch.suspend(settings))),
            };
            slot.composite_ms += start.elapsed_ms();
        });
        let begun = self
            .tiles
            .iter()
            .filter(|tile| matches!(tile, Progress::Begun(_)))
            .count();
        let held = bricks.len() as u64 * self.cells.reader.brick_bytes()
            + light.bytes()
            + (begun * Unfinished::bytes(settings) + self.tiles.len() * size_of::<Progress>())
                as u64;
        stats.resident_bytes = stats.resident_bytes.max(self.kept_bytes + held);
        Ok(())
    }

    /// The part of a rectangle that lies in this band.
    fn inside(&self, rect: TileRect) -> TileRect {
        let [y0, y1] =
            [rect.y0, rect.y1].map(|y| usize::from(y).clamp(self.rows.start, self.rows.end) as u16);
        if y0 < y1 {
            TileRect { y0, y1, ..rect }
        } else {
            TileRect::default()
        }
    }

    /// The bricks of a batch: from memory where they stayed there, else from the file.
    fn load(&self, batch: &[Candidate], stats: &mut FrameStats) -> Result<Vec<CellBrick>, Error> {
        let rows: Vec<&[Candidate]> = batch.chunk_by(|a, b| a.at == b.at).collect();
        let loaded = rows
            .par_iter()
            .map(|row| self.load_row(row))
            .collect::<Result<Vec<_>, Error>>()?;
        stats.bricks_read += loaded.iter().map(|(_, read)| read).sum::<u64>();
        Ok(loaded.into_iter().flat_map(|(bricks, _)| bricks).collect())
    }

    /// The bricks of one row, and how many of them were read from the file.
    fn load_row(&self, row: &[Candidate]) -> Result<(Vec<CellBrick>, u64), Error> {
        let bricks = row
            .iter()
            .map(|candidate| (candidate.place, candidate.brick));
        self.cells.load_row(row[0].at, bricks)
    }

    /// Shows what the tiles hold that are not opaque.
    fn show_rest(&mut self, slots: &mut [TileSlot]) {
        let FieldFrame {
            subpixels,
            means,
            settings,
            ..
        } = *self.frame;
        let tiles = self.tiles.par_iter().zip(slots);
        tiles.for_each_init(on_heap::<FieldScratch>, |scratch, (tile, slot)| {
            if let Progress::Begun(begun) = tile {
                scratch.resume(settings, begun);
                slot.show(&end_tile(settings, scratch), subpixels as usize, means);
            }
        });
    }
}
