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

use crate::Error;
use crate::axis_sheets::SliceOrder;
use crate::chunks::{chunk_target, project_runs, runs_of_bricks, visible_bricks};
use crate::clip::{Clip, Cut};
use crate::cull::ViewVolume;
use crate::geometry::Lens;
use crate::layer::{Layer, cells_of, layers, layers_in_world};
use crate::near::{NearSample, NearSetup};
use crate::options::{Cells, DepthPlane, Order, RenderOptions, Subpixels};
use crate::picture::{TileDepth, TileLayout};
use crate::project::{ProjectSetup, ProjectedChunk, SortKeys};
use crate::scene::Scene;
use crate::stats::FrameStats;
use crate::subpixels::{automatic, refined};
use crate::tiles::{Layers, TileSlot, TileStage};

/// How far apart samples are at least, in sub-pixels, that are composited on their own: about one.
const SPACING_IN_SUBPIXELS: f64 = 0.75;

/// Renders samples one over another.
#[derive(Clone, Debug)]
pub(crate) struct EverySample {
    layers: Vec<Layer>,
    /// Voxels that the transfer function leaves visible.
    pub(crate) non_transparent: u64,
    /// Voxels of the volume.
    pub(crate) voxels: u64,
    options: RenderOptions,
    kernel: Kernel,
    profile: FootprintProfile,
    filter: PixelFilter,
    dims: [usize; 3],
    bounds_in_world: Option<[DVec3; 2]>,
    smallest_spacing: f64,
    unit_in_world: f64,
    chunks: Vec<ProjectedChunk>,
}

/// Bricks of one layer that one task projects.
struct Run {
    layer: usize,
    bricks: Vec<usize>,
}

impl EverySample {
    /// [`Error::Option`] where a label map has too many labels.
    pub(crate) fn new(scene: &Scene, options: &RenderOptions) -> Result<Self, Error> {
        let volume = scene.grid();
        let kernel = Kernel::new(options.kernel);
        let layers = layers(scene, options)?;
        let non_transparent = match cells_of(scene, options) {
            Cells::Off => layers[0].samples.count,
            _ => scene.count_visible(),
        };
        Ok(Self {
            bounds_in_world: layers_in_world(&layers),
            layers,
            non_transparent,
            voxels: volume.len() as u64,
            options: options.clone(),
            kernel,
            profile: FootprintProfile::new(&kernel),
            filter: PixelFilter::new(),
            dims: volume.dims,
            smallest_spacing: volume.smallest_spacing(),
            unit_in_world: options.opacity_unit.unwrap_or_else(|| volume.smallest_spacing()),
            chunks: Vec::new(),
        })
    }

    /// Takes options that differ in what is read anew for each frame.
    pub(crate) fn adopt(&mut self, options: &RenderOptions) -> bool {
        self.options = options.clone();
        true
    }

    /// Changes what is kept of the volume.
    pub(crate) fn set_clip(&mut self, clip: &Clip) {
        for layer in &mut self.layers {
            layer.set_clip(clip);
        }
        self.bounds_in_world = layers_in_world(&self.layers);
    }

    /// The box, in the world, of the samples that are drawn.
    pub(crate) fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        self.bounds_in_world
    }

    /// Renders the tiles of one frame.
    pub(crate) fn render(
        &mut self,
        camera: &Camera,
        tiles: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) -> TileLayout {
        let (fine, subpixels) = refined(camera, self.subpixels(camera));
        let grid = TileGrid { width: fine.width as usize, height: fine.height as usize };
        let maps: Vec<MapSource> = self.layers.iter().map(|layer| self.maps(layer, &fine)).collect();
        let setups: Vec<ProjectSetup> = self
            .layers
            .iter()
            .zip(&maps)
            .map(|(layer, source)| self.project_setup(layer, source, (&fine, &maps[0].view)))
            .collect();
        let runs = self.runs(&setups, stats);
        self.chunks.resize_with(self.chunks.len().max(runs.len()), ProjectedChunk::default);
        project(&mut self.chunks[..runs.len()], &setups, &self.layers, &runs, stats);

        let chunks = &self.chunks[..runs.len()];
        let near = nearest_first(chunks);
        let near_setup =
            |&source: &MapSource| NearSetup { source, kernel: self.kernel, opacity: self.options.opacity };
        let stage = TileStage {
            settings: self.tile_settings(&maps[0]),
            maps: maps[0],
            grid,
            near: &near,
            near_setups: &maps.iter().map(near_setup).collect::<Vec<_>>(),
            chunks,
            layers: match self.options.order {
                Order::AxisSheets => Layers::Slices,
                Order::EverySample | Order::ImageSheets => Layers::Samples,
            },
            subpixels: subpixels as usize,
        };
        stage.run(tiles, stats);
        TileLayout { camera: *camera, subpixels, depth: TileDepth::Distance }
    }

    /// The number of sub-pixels along a pixel's side.
    fn subpixels(&self, camera: &Camera) -> u32 {
        match (self.options.subpixels, self.bounds_in_world) {
            (Subpixels::Fixed(n), _) => n,
            (Subpixels::Auto, Some([low, high])) if self.options.order == Order::EverySample => {
                let world_from_grid = self.usual_layer().samples.world_from_index;
                let middle = world_from_grid.inverse().transform_point3(0.5 * (low + high));
                automatic(camera, &world_from_grid, middle, SPACING_IN_SUBPIXELS)
            }
            (Subpixels::Auto, _) => 1,
        }
    }

    /// The layer of the sample in the middle, where all are put in order of their size.
    fn usual_layer(&self) -> &Layer {
        let half = self.layers.iter().map(|layer| layer.samples.count).sum::<u64>() / 2;
        let mut before = 0;
        let reached = |layer: &&Layer| {
            before += layer.samples.count;
            before > half
        };
        self.layers.iter().find(reached).unwrap_or(&self.layers[0])
    }

    /// The bricks in view, cut into what one task projects.
    fn runs(&self, setups: &[ProjectSetup], stats: &mut FrameStats) -> Vec<Run> {
        let mut visible = Vec::new();
        for (layer, setup) in self.layers.iter().zip(setups) {
            visible.push(visible_bricks(&layer.samples.bricks, &setup.view_volume, stats));
            stats.bricks_empty += layer.samples.empty;
        }
        let samples = |layer: &Layer, seen: &[usize]| -> usize {
            seen.iter().map(|&number| layer.samples.bricks[number].places.len()).sum()
        };
        let total = self.layers.iter().zip(&visible).map(|(layer, seen)| samples(layer, seen)).sum();
        let target = chunk_target(total);
        let cut = |(number, seen): (usize, Vec<usize>)| {
            let runs = runs_of_bricks(&self.layers[number].samples.bricks, seen, target);
            runs.into_iter().map(move |bricks| Run { layer: number, bricks })
        };
        visible.into_iter().enumerate().flat_map(cut).collect()
    }

    fn maps(&self, layer: &Layer, camera: &Camera) -> MapSource {
        MapSource {
            view: GridView::new(camera, &layer.samples.world_from_index),
            radius: self.kernel.radius(),
            unit_in_world: self.unit_in_world,
            mode: self.evaluated_footprint(),
        }
    }

    /// The footprint that the tiles evaluate: EWA is affine by construction.
    fn evaluated_footprint(&self) -> FootprintMode {
        if self.options.select == SelectMode::Ewa { FootprintMode::Affine } else { self.options.footprint }
    }

    /// How a layer is projected, given its view and that of the first layer.
    fn project_setup(
        &self,
        layer: &Layer,
        maps: &MapSource,
        (camera, first): (&Camera, &GridView),
    ) -> ProjectSetup {
        let threshold = self.options.point_threshold_px;
        let modes = (self.options.footprint, self.options.select);
        ProjectSetup {
            lens: Lens::new((&maps.view, layer.halvings), &self.kernel, modes, self.unit_in_world),
            view_volume: ViewVolume::new(camera, &maps.view, self.kernel.radius()),
            grid: TileGrid { width: camera.width as usize, height: camera.height as usize },
            select: self.options.select,
            threshold2_px2: threshold * threshold,
            colour_by: self.options.colour_by,
            level: self.options.simd.resolve(),
            keys: match self.options.order {
                Order::AxisSheets => {
                    SortKeys::Slice(SliceOrder::new(first, self.dims).halved(layer.halvings))
                }
                Order::EverySample | Order::ImageSheets => SortKeys::Depth,
            },
            layer: layer.halvings as u8,
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
    setups: &[ProjectSetup],
    layers: &[Layer],
    runs: &[Run],
    stats: &mut FrameStats,
) {
    let project = |chunk: &mut ProjectedChunk, run: &Run| {
        chunk.clear();
        let (layer, setup) = (&layers[run.layer], &setups[run.layer]);
        for brick in run.bricks.iter().map(|&number| &layer.samples.bricks[number]) {
            match layer.clip.cut(&brick.bounds) {
                Cut::Outside => {}
                Cut::By(0) => chunk.project(setup, brick),
                Cut::By(_) => chunk.project(setup, &brick.kept(&layer.clip)),
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
