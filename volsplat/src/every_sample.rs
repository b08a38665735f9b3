//! The every-sample order: each sample over those behind it, in strict depth order (the paper's choice, section 4.1).
//!
//! 1. input: a volume and a transfer function were classified into bricks of samples ([`crate::sample`]);
//! 2. sample and select: visible bricks are projected, each sample becomes a point or a splat (`project`);
//! 3. accumulate: primitives are listed by screen tile, each tile sorts its list by depth;
//! 4. composite: points and splats are composited front to back, tile by tile, until the tile is opaque.
//!
//! The axis-sheets order ([`crate::axis_sheets`]) runs the same stages; it sorts by slice and composites whole slices.

use glam::DVec3;
use resample_core::composite::{DepthRule, IndexRule, TileSettings};
use resample_core::maps::MapSource;
use resample_core::point::PixelFilter;
use resample_core::table::FootprintProfile;
use resample_core::tile::TileGrid;
use resample_core::{Camera, FootprintMode, GridView, Kernel, SelectMode};

use crate::axis_sheets::SliceOrder;
use crate::chunks::{project_runs, runs_of_bricks, visible_bricks};
use crate::clip::{Clip, Cut, GridClip};
use crate::cull::ViewVolume;
use crate::geometry::Lens;
use crate::near::{NearSample, NearSetup};
use crate::options::{DepthPlane, Order, RenderOptions};
use crate::picture::{TileDepth, TileLayout};
use crate::project::{ProjectSetup, ProjectedChunk, SortKeys};
use crate::sample::{Brick, Samples, bounds_in_world};
use crate::scene::Scene;
use crate::stats::FrameStats;
use crate::tiles::{Layers, TileSlot, TileStage};

/// Renders samples one over another.
#[derive(Clone, Debug)]
pub(crate) struct EverySample {
    pub(crate) samples: Samples,
    options: RenderOptions,
    clip: GridClip,
    kernel: Kernel,
    profile: FootprintProfile,
    filter: PixelFilter,
    dims: [usize; 3],
    smallest_spacing: f64,
    unit_in_world: f64,
    chunks: Vec<ProjectedChunk>,
}

impl EverySample {
    pub(crate) fn new(scene: &Scene, options: &RenderOptions) -> Self {
        let volume = scene.grid();
        let kernel = Kernel::new(options.kernel);
        Self {
            samples: Samples::of_scene(scene, options.opacity),
            options: options.clone(),
            clip: options.clip.in_grid(&volume.world_from_index),
            kernel,
            profile: FootprintProfile::new(&kernel),
            filter: PixelFilter::new(),
            dims: volume.dims,
            smallest_spacing: volume.smallest_spacing(),
            unit_in_world: options.opacity_unit.unwrap_or_else(|| volume.smallest_spacing()),
            chunks: Vec::new(),
        }
    }

    /// Changes what is kept of the volume.
    pub(crate) fn set_clip(&mut self, clip: &Clip) {
        self.clip = clip.in_grid(&self.samples.world_from_index);
    }

    /// The box, in the world, of the voxels that are drawn.
    pub(crate) fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        let bounds = self.samples.bricks.iter().map(|brick| brick.bounds);
        bounds_in_world(bounds, &self.clip, &self.samples.world_from_index)
    }

    /// Renders the tiles of one frame.
    pub(crate) fn render(
        &mut self,
        camera: &Camera,
        tiles: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) -> TileLayout {
        let view = GridView::new(camera, &self.samples.world_from_index);
        let grid = TileGrid { width: camera.width as usize, height: camera.height as usize };
        let maps = MapSource {
            view,
            radius: self.kernel.radius(),
            unit_in_world: self.unit_in_world,
            mode: self.evaluated_footprint(),
        };

        let view_volume = ViewVolume::new(camera, &view, self.kernel.radius());
        let bricks = &self.samples.bricks;
        let visible = visible_bricks(bricks, &view_volume, stats);
        stats.bricks_empty = self.samples.empty;
        let runs = runs_of_bricks(bricks, visible);

        let (keys, layers) = match self.options.order {
            Order::AxisSheets => (SortKeys::Slice(SliceOrder::new(&view, self.dims)), Layers::Slices),
            Order::EverySample | Order::ImageSheets => (SortKeys::Depth, Layers::Samples),
        };
        let setup = self.project_setup(&maps, grid, view_volume, keys);
        self.chunks.resize_with(self.chunks.len().max(runs.len()), ProjectedChunk::default);
        let bricks = (self.samples.bricks.as_slice(), &self.clip);
        project(&mut self.chunks[..runs.len()], &setup, bricks, &runs, stats);

        let chunks = &self.chunks[..runs.len()];
        let near = nearest_first(chunks);
        let stage = TileStage {
            settings: self.tile_settings(&maps),
            maps,
            grid,
            near: &near,
            near_setup: NearSetup { source: maps, kernel: self.kernel, opacity: self.options.opacity },
            chunks,
            layers,
        };
        stage.run(tiles, stats);
        TileLayout { camera: *camera, subpixels: 1, depth: TileDepth::Distance }
    }

    /// The footprint that the tiles evaluate: EWA is affine by construction.
    fn evaluated_footprint(&self) -> FootprintMode {
        if self.options.select == SelectMode::Ewa { FootprintMode::Affine } else { self.options.footprint }
    }

    fn project_setup(
        &self,
        maps: &MapSource,
        grid: TileGrid,
        view_volume: ViewVolume,
        keys: SortKeys,
    ) -> ProjectSetup {
        let threshold = self.options.point_threshold_px;
        let modes = (self.options.footprint, self.options.select);
        ProjectSetup {
            lens: Lens::new(&maps.view, &self.kernel, modes, self.unit_in_world),
            view_volume,
            grid,
            select: self.options.select,
            threshold2_px2: threshold * threshold,
            colour_by: self.options.colour_by,
            level: self.options.simd.resolve(),
            keys,
        }
    }

    fn tile_settings(&self, maps: &MapSource) -> TileSettings {
        let smallest = self.smallest_spacing;
        TileSettings {
            level: self.options.simd.resolve(),
            profile: self.profile,
            filter: self.filter.clone(),
            opacity: self.options.opacity,
            index: match maps.mode {
                FootprintMode::Table => IndexRule::ConeCorrected,
                _ => IndexRule::Direct,
            },
            depth: match self.options.depth {
                DepthPlane::None => DepthRule::Skip,
                DepthPlane::Expected => DepthRule::Expected,
            },
            sheet_thickness: (self.options.sheet_voxels * smallest) as f32,
            min_transmittance: self.options.min_transmittance,
        }
    }
}

/// Projects each run of bricks into its chunk and lists it by tile.
fn project(
    chunks: &mut [ProjectedChunk],
    setup: &ProjectSetup,
    (bricks, clip): (&[Brick], &GridClip),
    runs: &[Vec<usize>],
    stats: &mut FrameStats,
) {
    let project = |chunk: &mut ProjectedChunk, run: &[usize]| {
        chunk.clear();
        for brick in run.iter().map(|&number| &bricks[number]) {
            match clip.cut(&brick.bounds) {
                Cut::Outside => {}
                Cut::By(0) => chunk.project(setup, brick),
                Cut::By(_) => chunk.project(setup, &brick.kept(clip)),
            }
        }
    };
    project_runs(chunks, runs, stats, project, |chunk, number| chunk.bins.bin(number));
    for chunk in chunks.iter() {
        stats.culled += chunk.culled;
        stats.points += chunk.points;
        stats.splats += chunk.splats;
        stats.near_splats += chunk.near.len() as u64;
    }
}

/// The samples at the eye, of all chunks, in the order of compositing.
fn nearest_first(chunks: &[ProjectedChunk]) -> Vec<NearSample> {
    let mut near: Vec<NearSample> = chunks.iter().flat_map(|chunk| chunk.near.iter().copied()).collect();
    near.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    near
}
