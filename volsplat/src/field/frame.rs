//! One frame from bricks of cells in memory: drops those outside the view, puts the others on the screen in front-to-back order, each with
//! the planes and the pixels that it covers, and has each tile sample its bricks.
//!
//! In a regular grid a ray that leaves a brick never returns, and along each axis it only moves away from the eye. So
//! the number of bricks between the eye's brick and another, added up over the axes, grows along every ray: sorted by
//! it, no brick hides one that came before. This holds in a sheared grid too, because rays stay straight in it.

use rayon::prelude::*;
use resample_core::clock::{StageClock, ThreadClock};
use resample_core::scratch::on_heap;
use resample_core::tile::{TILE_PX, TileGrid, TileLists, TileRect};
use resample_core::{GridView, Projection};

use crate::bricks::cells::{CELL_SIDE, CellBrick, CellField};
use crate::bricks::cull::{ViewVolume, visible_bricks};
use crate::bricks::support::Support;
use crate::field::settings::{FieldFrame, FieldSettings, PlacedBrick};
use crate::field::tile::render_tile;
use crate::field::walk::scratch::FieldScratch;
use crate::grid::Bounds;
use crate::look::clip::Cut;
use crate::picture::{TileSlot, tally};
use crate::shadow::tables::{BrickLight, Reaching};
use crate::slabs::view::TileView;
use crate::stats::FrameStats;

/// The bricks numbered in `visible`, front to back, with the tiles that each covers.
pub(crate) fn placed<'a>(
    frame: &FieldFrame<'a>,
    bricks: &'a [CellBrick],
    visible: &[usize],
    light: &'a Reaching,
) -> (Vec<PlacedBrick<'a>>, Vec<TileRect>) {
    let (view, camera) = (frame.view, frame.camera);
    let grid = TileGrid::new(camera.width as usize, camera.height as usize);
    let mut ordered: Vec<(u64, usize)> = visible
        .iter()
        .map(|&i| (distance(view, &bricks[i]), i))
        .collect();
    ordered.sort_unstable();
    ordered
        .into_par_iter()
        .filter_map(|(_, i)| {
            let Cut::By(cuts) = frame.clip.cut(&bricks[i].bounds) else {
                return None;
            };
            let placed = PlacedBrick {
                cuts,
                // What the clip leaves whole may be crossed in one step.
                uniform: if cuts == 0 {
                    frame.uniform(&bricks[i])
                } else {
                    None
                },
                light: light.of_brick(i),
                ..place(&bricks[i], view, grid, frame.settings)?
            };
            Some((placed, grid.rect(placed.columns, placed.rows)))
        })
        .unzip()
}

/// Bricks between the eye's brick and this one, added up over the axes.
fn distance(view: &GridView, brick: &CellBrick) -> u64 {
    (0..3)
        .map(|axis| axis_distance(view, brick.bounds.corner[axis], axis))
        .sum()
}

/// Bricks along one axis between the eye's brick and one whose first voxel is `corner`.
pub(crate) fn axis_distance(view: &GridView, corner: u32, axis: usize) -> u64 {
    let side = CELL_SIDE as f64;
    let number = f64::from(corner) / side;
    match view.projection {
        Projection::Perspective => (number - (view.origin[axis] / side).floor()).abs() as u64,
        // Every ray has the same direction: count along it, from an end that no volume reaches.
        Projection::Orthographic if view.w0[axis] < 0.0 => u64::from(u32::MAX) - number as u64,
        Projection::Orthographic => number as u64,
    }
}

/// The tiles that a brick covers whose visible cells lie in this box; `None` where it is not seen.
pub(crate) fn tile_rect(
    bounds: &Bounds,
    view: &GridView,
    grid: TileGrid,
    settings: &FieldSettings,
) -> Option<TileRect> {
    extent(bounds, view, grid, settings).map(|extent| grid.rect(extent.columns, extent.rows))
}

/// The extent of a box of cells.
struct Extent {
    planes: [u32; 2],
    columns: [u16; 2],
    rows: [u16; 2],
}

fn extent(
    bounds: &Bounds,
    view: &GridView,
    grid: TileGrid,
    settings: &FieldSettings,
) -> Option<Extent> {
    let corners = bounds
        .corners_in_grid(0.0)
        .map(|corner| view.camera_from_grid.transform_point3(corner));
    let (near, far) = corners
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(n, f), c| {
            (n.min(c.z), f.max(c.z))
        });
    // A sample on a face lies in this brick or in the next, as its f32 position says: both must look at its plane.
    let margin = settings.sheets.margin_z();
    let first = settings
        .sheets
        .plane_from_z(near - margin)
        .ceil()
        .max(settings.sheets.plane_from_z(view.near).ceil())
        .max(0.0);
    let end = settings.sheets.plane_from_z(far + margin).floor() + 1.0;
    // A surface or a shell may lie between two planes.
    let is_seen = if settings.walks_rays() {
        far + margin > view.near
    } else {
        first < end
    };
    if !(is_seen && end < f64::from(u32::MAX)) {
        return None;
    }
    // A box that reaches the first plane's depth may cover any pixel from there on.
    let whole = near <= 0.0 && view.projection == Projection::Perspective;
    let cover = |axis: usize, count: usize| {
        if whole {
            return [0, count as u16];
        }
        let ends = corners
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| {
                let scale = if view.projection == Projection::Perspective {
                    c.z
                } else {
                    1.0
                };
                let pixel = c[axis] * view.focal[axis] / scale + view.principal_px[axis];
                (low.min(pixel), high.max(pixel))
            });
        // A sixteenth of a pixel more than the box: the f32 positions of samples may lie outside by less.
        let pixel = |p: f64| (p - 0.5).ceil().clamp(0.0, count as f64) as u16;
        [pixel(ends.0 - 0.0625), pixel(ends.1 + 0.0625)]
    };
    let (columns, rows) = (cover(0, grid.width), cover(1, grid.height));
    let seen = columns[0] < columns[1] && rows[0] < rows[1];
    seen.then_some(Extent {
        planes: [first as u32, end as u32],
        columns,
        rows,
    })
}

fn place<'a>(
    brick: &'a CellBrick,
    view: &GridView,
    grid: TileGrid,
    settings: &FieldSettings,
) -> Option<PlacedBrick<'a>> {
    let Extent {
        planes,
        columns,
        rows,
    } = extent(&brick.bounds, view, grid, settings)?;
    Some(PlacedBrick {
        brick,
        uniform: None,
        light: BrickLight::default(),
        planes,
        columns,
        rows,
        cuts: 0,
    })
}

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
        let (bricks, rects) = placed(self, &field.bricks, &visible, self.light);
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
            on_heap::<FieldScratch>,
            |scratch, (index, slot)| {
                let at = [index % columns, index / columns];
                let list = lists.tile(at[0], at[1]);
                slot.reset(list.len());
                let surfaces = self.surfaces.of_tile(&self.settings.sheets, at);
                if list.is_empty() && surfaces.is_none() || self.stop.is_asked() {
                    return;
                }
                let start = ThreadClock::start();
                let corner_px = at.map(|tile| tile * TILE_PX);
                let view = TileView::new(self.view, corner_px, &self.settings.sheets);
                let front_to_back = list.iter().map(|&brick| &bricks[brick as usize]);
                let (counts, pixels) = render_tile(
                    self.settings,
                    &view,
                    front_to_back,
                    surfaces.as_ref(),
                    scratch,
                );
                slot.count(counts);
                slot.count_samples(scratch.work);
                slot.show(&pixels, self.subpixels as usize, self.means);
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
