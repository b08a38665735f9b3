//! The image-sheets order, post-classified: slabs parallel to the image plane, one over another.
//!
//! 1. input: the voxels that visible cells need were collected into bricks ([`crate::field`]);
//! 2. sample: visible bricks are projected, each voxel is listed by the tiles that its kernel touches ([`frame`]);
//! 3. accumulate: each tile sorts its list by first plane and sums scalars and weights, plane by plane ([`tile`]);
//! 4. composite: a plane that no voxel can reach any more is classified per pixel and composited behind the others;
//! 5. image: sub-pixels become pixels.
//!
//! The kernel is trilinear: a sample on a plane is then exactly what a ray caster with trilinear interpolation reads
//! there, reached in object order, so that cost follows the visible voxels and not the box around them.
//! Source: K. Mueller, R. Crawfis, "Eliminating Popping Artifacts in Sheet Buffer-Based Splatting", IEEE Visualization
//! 1998, for the sheets; we sample the plane through a slab's middle instead of integrating the kernel over the slab.

pub(crate) mod classify;
pub(crate) mod frame;
pub(crate) mod section;
pub(crate) mod tile;

use cpu_time::ThreadTime;
use glam::DVec3;
use rayon::prelude::*;
use resample_core::composite::{DepthRule, TileCounts, TilePixels};
use resample_core::sort::{EXACT_KEYS, entry_key, sort_by_depth};
use resample_core::tile::{TILE_PX, TileGrid};
use resample_core::{Camera, GridView};

use self::classify::TransferTable;
use self::frame::{Anchor, Section, SheetChunk, SheetProjection, SheetSettings, TileView};
use self::section::SectionTable;
use self::tile::{SheetScratch, render_tile};
use crate::chunks::{runs_of_bricks, visible_bricks};
use crate::cull::ViewVolume;
use crate::field::Field;
use crate::options::{DepthPlane, RenderOptions, Subpixels};
use crate::picture::{TileDepth, TileLayout};
use crate::sample::bounds_in_world;
use crate::stats::{FrameStats, StageClock};
use crate::tiles::{TileSlot, elapsed_ms, tally};
use crate::transfer::TransferFunction;
use crate::volume::Volume;

/// Reach of the trilinear kernel along each grid axis, voxels.
const REACH: f64 = 1.0;

/// Renders a field in image-aligned sheets.
#[derive(Clone, Debug)]
pub(crate) struct ImageSheets {
    pub(crate) field: Field,
    table: TransferTable,
    options: RenderOptions,
    smallest_spacing: f64,
    /// The voxel in the middle of the volume.
    middle: DVec3,
    chunks: Vec<SheetChunk>,
}

impl ImageSheets {
    pub(crate) fn new(volume: &Volume, transfer: &TransferFunction, options: &RenderOptions) -> Self {
        Self {
            field: Field::new(volume, transfer, REACH as usize),
            table: TransferTable::new(transfer, options.opacity, volume.value_range()),
            options: options.clone(),
            smallest_spacing: volume.smallest_spacing(),
            middle: DVec3::from(volume.dims.map(|n| (n / 2) as f64)),
            chunks: Vec::new(),
        }
    }

    /// Renders the tiles of one frame.
    pub(crate) fn render(
        &mut self,
        camera: &Camera,
        tiles: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) -> TileLayout {
        let subpixels = self.subpixels(camera);
        // Sides of up to 2^15 px times 16 sub-pixels are more than a camera may have: fewer sub-pixels then.
        let (fine, subpixels) = match camera.resized(camera.width * subpixels, camera.height * subpixels) {
            Ok(fine) => (fine, subpixels),
            Err(_) => (*camera, 1),
        };
        let view = GridView::new(&fine, &self.field.world_from_index);
        let settings = self.settings(&view);
        let view_volume = ViewVolume::new(&fine, &view, REACH * 3f64.sqrt());
        let visible = visible_bricks(&self.field.bricks, &view_volume, stats);
        let runs = runs_of_bricks(&self.field.bricks, visible);
        self.chunks.resize_with(self.chunks.len().max(runs.len()), SheetChunk::default);
        self.project(&SheetProjection::new(&view, &fine, &settings), &runs, stats);
        let frame = SheetFrame { settings: &settings, view: &view, camera: &fine, subpixels };
        frame.run(&self.chunks[..runs.len()], tiles, stats);
        TileLayout { camera: *camera, subpixels, depth: TileDepth::CameraZ }
    }

    /// The number of sub-pixels along a pixel's side.
    fn subpixels(&self, camera: &Camera) -> u32 {
        let bounds = self.field.bricks.iter().map(|b| &b.bounds);
        match (self.options.subpixels, bounds_in_world(bounds, &self.field.world_from_index)) {
            (Subpixels::Fixed(n), _) => n,
            (Subpixels::Auto, None) => 1,
            (Subpixels::Auto, Some([low, high])) => {
                let middle = camera.camera_from_world.transform_point3(0.5 * (low + high));
                let view = GridView::new(camera, &self.field.world_from_index);
                let spacing_px = resample_core::view::largest_eigenvalue(view.gram_px2(middle)).sqrt();
                // Two sub-pixels a voxel: at one, thin structures lose 9 dB, beyond two it costs more than it gains.
                // A middle behind the eye, or one that is no number, gives 1.
                [1, 2, 4].into_iter().find(|&n| !(f64::from(n) * spacing_px < 1.5)).unwrap_or(8)
            }
        }
    }

    fn settings(&self, view: &GridView) -> SheetSettings {
        let sections = SectionTable::of_cube(view.camera_from_grid.matrix3);
        let thickness = self.options.slab_voxels * self.smallest_spacing;
        SheetSettings {
            level: self.options.simd.resolve(),
            table: self.table.clone(),
            ring_len: SheetSettings::ring_len(&sections, thickness),
            sections,
            thickness,
            unit_in_world: self.options.opacity_unit.unwrap_or(self.smallest_spacing),
            anchor: Anchor {
                grid: self.middle,
                camera_z: view.camera_from_grid.transform_point3(self.middle).z,
            },
            opacity: self.options.opacity,
            depth: match self.options.depth {
                DepthPlane::None => DepthRule::Skip,
                DepthPlane::Expected => DepthRule::Expected,
            },
            min_transmittance: self.options.min_transmittance,
        }
    }

    /// Projects each run of bricks into its chunk and lists it by tile.
    fn project(&mut self, setup: &SheetProjection, runs: &[Vec<usize>], stats: &mut FrameStats) {
        let clock = StageClock::start();
        let bricks = &self.field.bricks;
        let parts: Vec<[f64; 2]> = self.chunks[..runs.len()]
            .par_iter_mut()
            .zip(runs)
            .enumerate()
            .map(|(number, (chunk, run))| {
                let start = ThreadTime::try_now().ok();
                chunk.clear();
                for &brick in run {
                    chunk.project(setup, &bricks[brick]);
                }
                let project_ms = elapsed_ms(start);
                let start = ThreadTime::try_now().ok();
                chunk.bins.bin(number);
                [project_ms, elapsed_ms(start)]
            })
            .collect();
        let cpu_ms = parts.iter().fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
        [stats.stages.project, stats.stages.bin] = clock.stop().shared(cpu_ms);
        for chunk in &self.chunks[..runs.len()] {
            stats.culled += chunk.culled;
            stats.splats += chunk.bins.primitives.len() as u64;
        }
    }
}

/// What the tiles of a frame are rendered with.
struct SheetFrame<'a> {
    settings: &'a SheetSettings,
    view: &'a GridView,
    camera: &'a Camera,
    subpixels: u32,
}

impl SheetFrame<'_> {
    fn run(&self, chunks: &[SheetChunk], slots: &mut Vec<TileSlot>, stats: &mut FrameStats) {
        let clock = StageClock::start();
        let grid = TileGrid { width: self.camera.width as usize, height: self.camera.height as usize };
        let columns = grid.columns();
        slots.resize_with(columns * grid.rows(), TileSlot::default);
        let sections: Vec<&[Section]> = chunks.iter().map(|chunk| chunk.bins.primitives.as_slice()).collect();
        slots.par_iter_mut().enumerate().for_each_init(SheetScratch::default, |scratch, (index, slot)| {
            let at = [index % columns, index / columns];
            slot.entries.clear();
            for chunk in chunks {
                slot.entries.extend_from_slice(chunk.bins.tile(at[0] as u16, at[1] as u16));
            }
            self.tile(at.map(|tile| tile * TILE_PX), &sections, slot, scratch);
        });
        tally(slots, clock, stats);
    }

    fn tile(
        &self,
        corner_px: [usize; 2],
        sections: &[&[Section]],
        slot: &mut TileSlot,
        scratch: &mut SheetScratch,
    ) {
        scratch.pixels = TilePixels::default();
        slot.counts = TileCounts::default();
        let start = ThreadTime::try_now().ok();
        sort_by_plane(&mut slot.entries, &mut scratch.sort);
        slot.sort_ms = elapsed_ms(start);
        let start = ThreadTime::try_now().ok();
        if !slot.entries.is_empty() {
            let view = TileView::new(self.view, corner_px, self.settings);
            slot.counts = render_tile(self.settings, &view, &slot.entries, sections, scratch);
        }
        slot.pixels = scratch.pixels.averaged(self.subpixels as usize);
        slot.composite_ms = elapsed_ms(start);
    }
}

/// Sorts entries by their plane, exactly: the tile relies on it.
fn sort_by_plane(entries: &mut [u64], scratch: &mut Vec<u64>) {
    let planes = entries.iter().map(|&e| entry_key(e));
    let (nearest, farthest) = planes.fold((u32::MAX, 0), |(lo, hi), plane| (lo.min(plane), hi.max(plane)));
    if farthest.saturating_sub(nearest) < EXACT_KEYS {
        sort_by_depth(entries, scratch);
    } else {
        entries.sort_unstable();
    }
}
